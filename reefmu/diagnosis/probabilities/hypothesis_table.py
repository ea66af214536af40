"""The table of hypotheses: every fitted set of effects, with and without something unnamed beside it.

Each row has the logarithm of its marginal likelihood over that of nothing. Fits of several kinds serve one row: that of
an individual and that of the mean drive, and sets that differ by effects too small to matter. The best of them counts.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ..estimation.intervals import is_degenerate
from ..estimation.least_squares import Fit, by_cost
from ..estimation.problem import Problem
from ..estimation.residuals import remainder
from ..estimation.weighting import INDIVIDUAL_SIZE, MEAN_DRIVE_SIZE
from ..inference.dispersion import ChanceGains, dispersion
from ..inference.evidence import Evidence
from ..inference.exchanges import exchanged_fits
from ..inference.nonparametric import CURVE, CURVE_TERM, TermFit, fit_terms
from ..inference.simulated_records import simulate_records
from ..inference.tolerance_curve import CURVE_EFFECTS, SIGNIFICANT_GAIN, is_within_tolerances, tolerances_in
from .marginal_likelihood import log_volume, material_effects

LEAST_SIZE = 0.1
"""Smallest amplitude, over the typical size, that counts as an effect: a tenth of a tolerance's deviation is within
what every drive deviates by."""
N_RECORDS, CHANCE_LEVEL = 48, 0.95
"""Records without effects that are simulated, and the quantile of gains along them that counts as by chance: the usual
level of 5 %."""
N_BEST, N_BEST_BY_SIZE, N_MEAN_DRIVE = 8, 4, 4
"""Fits that are compared with nonparametric terms: the best of all, of every number of effects, and refitted for the
mean drive. Chosen by judgement to bound the time at a tenth of a diagnosis."""


@dataclass(frozen=True)
class Row:
    """One hypothesis.

    effects: that are missing; unnamed: whether something without a name is missing as well; log_evidence: log marginal
    likelihood over that of nothing missing; fit: of the effects; gain: of effects and term, in -2 log likelihood;
    beside: the nonparametric term, of something unnamed or of a curve within tolerances, None where there is none;
    unnamed_share: rms of what is unnamed, over full torque, 0 where nothing is, on the mean drive of all that is left
    and not only of what the term fits; scatter: size of the drive's scatter, 0 of the mean drive.
    """

    effects: frozenset[str]
    unnamed: bool
    log_evidence: float
    fit: Fit
    gain: float = 0.0
    beside: TermFit | None = None
    unnamed_share: float = 0.0
    scatter: float = 0.0


def hypothesis_table(evidence: Evidence, sizes: Mapping[str, float]) -> tuple[Row, ...]:
    """The rows of all fitted sets, and of those that the record hardly tells from the likeliest of them, each
    hypothesis once; nothing is always among them.

    sizes: typical ones, SI, by `effect.parameter`, where they are stated: no other effect is too small.
    """
    problem, base = evidence.problem, evidence.search.base
    fits = [fit for fit in _fits(evidence) if not (fit.names and is_degenerate(problem, fit))]
    best_fits = _best(fits)
    compared = [(fit, fit_terms(problem, fit)) for fit in (*best_fits, *_for_mean_drive(problem, base, best_fits))]
    explanations = [(fit, beside) for fit, terms in compared for beside in (None, terms[0])]
    divided = dispersion(problem, explanations, max(base.cost - fits[0].cost, 0.0) if _scatter(fits[0]) else 0.0)
    chance = ChanceGains(problem, base, simulate_records(problem, N_RECORDS, seed=0))

    def row(fit: Fit, gain: float = 0.0, beside: TermFit | None = None, unnamed: bool = False) -> Row:
        effects = material_effects(problem, fit, sizes, LEAST_SIZE)
        whole = base.cost - fit.cost + gain
        log_evidence = whole / (2 * divided) + log_volume(problem, fit, sizes, divided)
        rms = beside.rms if unnamed and beside else 0.0
        if unnamed and not _scatter(fit):
            rms = max(rms, remainder(problem, fit))
        return Row(effects, unnamed, log_evidence, fit, whole, beside, rms / problem.base.full_torque, _scatter(fit))

    # The scatter changes in steps with the twist of the contacts, which even an effect too small to show moves: it must
    # gain more than the scatter at those contacts does without it.
    moved = [problem.fit_from((), base.parameters, fit.weighting) for fit in best_fits if fit.names and _scatter(fit)]
    rows = [row(fit) for fit in (*fits, *moved)]
    likeliest = max(rows, key=lambda r: r.log_evidence).fit
    exchanged = [(fit, fit_terms(problem, fit)) for fit in exchanged_fits(problem, likeliest)]
    rows += [row(fit) for fit, _ in exchanged]
    # The scatter of an individual holds the tolerances of its curve. On the mean drive several effects that make one
    # curve are doubtful.
    doubtful = [found for found in rows if not found.scatter and len(CURVE_EFFECTS & set(found.fit.names)) > 1]
    rows += [other for found in doubtful for other in _without_tolerances(problem, found)]
    for fit, terms in (*compared, *exchanged):
        curve = next(term for term in terms if term.term.coordinate == CURVE)
        is_tolerance = not _scatter(fit) and is_within_tolerances(problem, fit, curve)
        if is_tolerance:
            rows.append(row(fit, max(0.0, curve.gain), curve))
            if curve.gain > SIGNIFICANT_GAIN:
                # The whole deviation, of which the effects and the curve are parts, may be that of the tolerances.
                rows += _without_tolerances(problem, rows[-1])
        unnamed = next(term for term in terms if not (is_tolerance and term is curve))
        rows.append(row(fit, max(0.0, unnamed.gain) - chance.unnamed(fit.weighting), unnamed, unnamed=True))
    best: dict[tuple[frozenset[str], bool], Row] = {}
    for found in less_chance(rows, chance, divided):
        key = found.effects, found.unnamed
        if key not in best or found.log_evidence > best[key].log_evidence:
            best[key] = found
    return tuple(best.values())


def less_chance(rows: Sequence[Row], chance: ChanceGains, divided: float) -> list[Row]:
    """The rows, with less evidence against them by what the likeliest row gains over them by chance, along records of
    noise and of scatter between cycles.

    Of two sets that differ by little only what the difference gains is by chance, of two alternatives likewise.
    """
    best = max(rows, key=lambda r: r.log_evidence)
    fits = {id(row.fit): row.fit for row in rows}
    gains = dict(zip(fits, chance.of_effects(tuple(fits.values()), best.fit.weighting), strict=True))

    def by_chance(row: Row) -> float:
        gained = float(np.quantile(gains[id(best.fit)] - gains[id(row.fit)], CHANCE_LEVEL))
        return min(max(0.0, gained), max(0.0, best.gain - row.gain))

    return [replace(row, log_evidence=row.log_evidence + by_chance(row) / (2 * divided)) for row in rows]


def _without_tolerances(problem: Problem, found: Row) -> Iterator[Row]:
    """The hypotheses that put effects of a row down to the tolerances, with the curve that is beside them, if any."""
    curve = found.beside or TermFit(CURVE_TERM, 0.0, np.zeros(len(problem.torque)))
    for names in tolerances_in(problem, found.fit, curve.torque):
        yield replace(found, effects=found.effects - names, beside=curve)


def _fits(evidence: Evidence) -> list[Fit]:
    """All fitted sets, the best first."""
    return sorted(evidence.search.all_fits, key=by_cost)


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
