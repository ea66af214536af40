"""The table of hypotheses: every fitted set of effects, with and without something unnamed beside it.

Each row has the logarithm of its marginal likelihood over that of nothing. Fits of several kinds serve one row: that of
an individual and that of the mean drive, and sets that differ by effects too small to matter. The best of them counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..estimation.least_squares import Fit, by_cost
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion, remainder
from ..estimation.search import is_degenerate
from ..estimation.weighting import INDIVIDUAL_SIZE, MEAN_DRIVE_SIZE
from ..inference.evidence import Evidence
from ..inference.model_comparison import is_within_tolerances
from ..inference.nonparametric import CURVE, TermFit, fit_terms, fit_terms_to
from .marginal_likelihood import log_volume, material_effects

LEAST_SIZE = 0.1
"""Smallest amplitude, over the typical size, that counts as an effect: a tenth of a tolerance's deviation is within
what every drive deviates by."""
COVARIANCE_ERROR = 0.02
"""Error of the trace of large effects on an individual, over the trace: the laws of effects and the scatter beside them
are no better known. Chosen among 0, 0.02, 0.05 and 0.1 by the calibration of the probabilities; on the mean drive 0 was
best."""
N_INDIVIDUALS = 8
"""Individuals whose nonparametric terms are computed. Chosen by judgement to bound the time."""
N_BEST, N_BEST_BY_SIZE, N_MEAN_DRIVE = 8, 4, 4
"""Fits that are compared with nonparametric terms: the best of all, of every number of effects, and refitted for the
mean drive. Chosen by judgement to bound the time at a tenth of a diagnosis."""


@dataclass(frozen=True)
class Row:
    """One hypothesis.

    effects: that are missing; unnamed: whether something without a name is missing as well; log_evidence: log marginal
    likelihood over that of nothing missing; fit: of the effects; beside: the nonparametric term, of something unnamed
    or of a curve within tolerances, None where there is none; unnamed_share: rms of what is unnamed, over full torque,
    0 where nothing is. On the mean drive all that is left is unnamed, and not only what the term fits.
    """

    effects: frozenset[str]
    unnamed: bool
    log_evidence: float
    fit: Fit
    beside: TermFit | None = None
    unnamed_share: float = 0.0


def hypothesis_table(evidence: Evidence, chosen: Fit, sizes: Mapping[str, float]) -> tuple[Row, ...]:
    """The rows of all fitted sets, each hypothesis once; nothing, and the chosen set without effects that are too small
    to matter, are always among them.

    chosen: the fit of the named effects; sizes: typical ones, SI, by `effect.parameter`, where they are stated: no
    other effect is too small.
    """
    problem, base = evidence.problem, evidence.search.base
    fits = [fit for fit in _fits(evidence) if not (fit.names and is_degenerate(problem, fit))]
    best_fits = _best(fits)
    compared = [*best_fits, *_for_mean_drive(problem, base, best_fits)]
    compared += [] if any(fit is chosen for fit in compared) else [chosen]
    dispersion = _dispersion(problem, base, fits, compared)
    chance = unnamed_gain_of_individuals(problem, base)

    def row(fit: Fit, gain: float = 0.0, beside: TermFit | None = None, unnamed: bool = False) -> Row:
        effects = material_effects(problem, fit, sizes, LEAST_SIZE)
        log_evidence = _log_evidence(evidence, fit, sizes, dispersion, gain)
        rms = beside.rms if unnamed and beside else 0.0
        if unnamed and not _scatter(fit):
            rms = max(rms, remainder(problem, fit))
        return Row(effects, unnamed, log_evidence, fit, beside, rms / problem.base.full_torque)

    # An effect that moves the contacts must bring more than the scatter that they then have.
    moved = [problem.fit_from((), base.parameters, fit.weighting) for fit in best_fits if fit.names and _scatter(fit)]
    rows = [row(fit) for fit in (*fits, chosen, *moved)]
    for fit in compared:
        is_tolerance, curve, terms = _nonparametric(problem, fit)
        if is_tolerance:
            rows.append(row(fit, max(0.0, curve.gain), curve))
        unnamed = max((t for t in terms if not (is_tolerance and t.term.coordinate == CURVE)), key=lambda t: t.gain)
        rows.append(row(fit, max(0.0, unnamed.gain) - (chance if _scatter(fit) else 0.0), unnamed, unnamed=True))
    best: dict[tuple[frozenset[str], bool], Row] = {}
    for found in rows:
        key = found.effects, found.unnamed
        if key not in best or found.log_evidence > best[key].log_evidence:
            best[key] = found
    return tuple(best.values())


def _log_evidence(evidence: Evidence, fit: Fit, sizes: Mapping[str, float], dispersion: float, gain: float) -> float:
    """Log marginal likelihood of a fit over that of nothing; gain: in -2 log likelihood, of what is beside its
    effects."""
    gain += evidence.search.base.cost - fit.cost
    return gain / (2 * dispersion) + log_volume(evidence.problem, fit, sizes, dispersion)


def unnamed_gain_of_individuals(problem: Problem, base: Fit, seed: int = 0) -> float:
    """Greatest gain, in -2 log likelihood, of any nonparametric term beside the base curve on simulated individuals
    without effects; 0 where no drawing states tolerances."""
    if not len(problem.individuals) or problem.is_mean_drive:
        return 0.0
    individual = replace(base, weighting=problem.weights.with_size(1.0))
    rng = np.random.default_rng(np.random.SeedSequence([seed, N_INDIVIDUALS]))
    noise = np.sqrt(problem.block_variance) * rng.standard_normal((N_INDIVIDUALS, len(problem.torque)))
    drives = problem.individuals[:N_INDIVIDUALS] + noise
    return max(0.0, *(fit_terms_to(problem, individual, drive)[0].gain for drive in drives))


def _fits(evidence: Evidence) -> list[Fit]:
    """All fitted sets, the best first."""
    return sorted((fit for fits in evidence.search.best.values() for fit in fits), key=by_cost)


def _best(fits: Sequence[Fit]) -> list[Fit]:
    """The best of all sets, and of every number of effects."""
    count: dict[int, int] = {}
    found: list[Fit] = []
    for place, fit in enumerate(fits):
        number = count.get(len(fit.names), 0)
        count[len(fit.names)] = number + 1
        if place < N_BEST or number < N_BEST_BY_SIZE:
            found.append(fit)
    return found


def _for_mean_drive(problem: Problem, base: Fit, fits: Sequence[Fit]) -> Iterator[Fit]:
    """The best sets under the hypothesis of the mean drive, where they scatter more, and the fit without effects."""
    weights = problem.weights.for_mean_drive()
    scattering = [fit for fit in fits if fit.names and _scatter(fit, MEAN_DRIVE_SIZE)][:N_MEAN_DRIVE]
    for fit in (*scattering, base):
        yield problem.fit_from(fit.names, fit.parameters, weights)


def _scatter(fit: Fit, least: float = INDIVIDUAL_SIZE) -> float:
    """Size of a fit's scatter, 0 below `least` or without random effects."""
    size = fit.weighting.size
    return size if len(fit.weighting.eigenvalues) and size >= least else 0.0


def _dispersion(problem: Problem, base: Fit, fits: Sequence[Fit], compared: Sequence[Fit]) -> float:
    """Variance of the residual over that of the weights: by what all sets leave, and by the error of the covariance
    beside large effects."""
    left = min(estimate_overdispersion(problem, fit) for fit in compared)
    error = COVARIANCE_ERROR if _scatter(fits[0]) else 0.0
    return left + error**2 * max(base.cost - fits[0].cost, 0.0)


def _nonparametric(problem: Problem, fit: Fit) -> tuple[bool, TermFit, list[TermFit]]:
    """Whether the curve that a fit leaves is one that tolerances make, that curve, and all nonparametric terms."""
    terms = fit_terms(problem, fit)
    curve = next(term for term in terms if term.term.coordinate == CURVE)
    return is_within_tolerances(problem, fit, curve), curve, terms
