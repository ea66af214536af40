"""The table of hypotheses: every fitted set of effects, with and without something unnamed beside it.

What is unnamed shows in the record, as a term that is fitted beside the effects, or it is too small to show: then the
record says as much of it as without.

Each row has the logarithm of its marginal likelihood over that of nothing. Fits of several kinds serve one row: that of
an individual and that of the mean drive, and sets that differ by effects too small to matter. The best of them counts.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain

from ...effects import find_effect
from ..calibrated_odds import log_odds
from ..estimation.intervals import is_degenerate
from ..estimation.least_squares import COST_DIGITS, HELD_SIZE, Fit, by_cost
from ..estimation.problem import Problem
from ..estimation.shared_covariances import least_costs
from ..estimation.weighting import MEAN_DRIVE_SIZE, without_blocks
from ..estimation.worker_pool import WorkerPool
from ..hypotheses import Hypothesis
from ..inference.dispersion import dispersion
from ..inference.evidence import Evidence
from ..inference.exchanges import exchanged_fits
from ..inference.nonparametric import TermFit
from ..inference.simulated_records import N_WITH_TERMS, gain_by_chance, simulate_records
from ..inference.tolerance_curve import weights_of_curve_within_tolerance
from ..inference.unnamed import UnnamedFit, fit_beside, gain_by_level, strongest_beside
from .marginal_likelihood import log_evidence_of_faint, log_volume, material_effects

LEAST_SIZE = 0.1
"""Smallest amplitude, over the typical size, that counts as an effect where the tolerances of every drive change the
same: a tenth of a tolerance's deviation is within what every drive deviates by."""
N_BEST, N_BEST_BY_SIZE, N_MEAN_DRIVE, N_BESIDE = 8, 4, 4, 4
"""Fits that are compared with something unnamed: the best of all, of every number of effects, refitted for the mean
drive, and refitted beside what is unnamed. Chosen by judgement to bound the time."""


Key = tuple[frozenset[str], bool]
"""Effects of a hypothesis, and whether something unnamed is missing as well."""


@dataclass(frozen=True)
class Row:
    """One hypothesis.

    effects: that are missing; unnamed: whether something without a name is missing as well; log_evidence: log marginal
    likelihood over that of nothing missing; fit: of the effects; beside: the term of something unnamed, None where
    there is none or where it is too small to show; faint: those of the effects that the record does not show.
    """

    effects: frozenset[str]
    unnamed: bool
    log_evidence: float
    fit: Fit
    beside: TermFit | None = None
    faint: frozenset[str] = frozenset()

    @property
    def is_hidden(self) -> bool:
        """Whether something unnamed is missing that is too small to show."""
        return self.unnamed and self.beside is None

    def shown_as(self, probability: float) -> Hypothesis:
        """What the record shows of the hypothesis, with a probability."""
        return Hypothesis(tuple(sorted(self.effects - self.faint)), self.unnamed and not self.is_hidden, probability)


def hypothesis_table(evidence: Evidence, sizes: Mapping[str, float], pool: WorkerPool | None = None) -> tuple[Row, ...]:
    """The rows of all fitted sets, and of those that the record hardly tells from the likeliest of them; nothing is
    always among them. Each is there once without anything unnamed, once with something that is too small to show and,
    where that was tried and gains, once with something that shows.

    sizes: typical ones, SI, by `effect.parameter`, where they are stated: no other effect is too small. pool: of
    processes that have the problem, this one if None.
    """
    problem, base, pool = evidence.problem, evidence.search.base, pool or WorkerPool(evidence.problem)
    fits = [fit for fit in _fits(evidence) if not (fit.names and is_degenerate(problem, fit))]
    best_fits = _best(fits)
    # Other processes, if there are any, go on with these meanwhile.
    unnamed = _strongest_terms(pool, best_fits)
    mean_drive = [*_for_mean_drive(problem, base, best_fits)]
    off_curve = [*_with_curve_within_tolerance(problem, base, best_fits)]
    plain = (*best_fits, *mean_drive, *off_curve)
    unnamed = chain(unnamed, _strongest_terms(pool, plain[len(best_fits) :]))
    nothing, *least = least_costs(problem, [base, *best_fits])
    compared = _refitted(pool, plain, unnamed)
    explanations = [*((fit, None) for fit in plain), *compared]
    divided = dispersion(problem, explanations)
    closest = min(plain, key=by_cost)
    by_level = gain_by_level(problem, closest, problem.torque - closest.prediction.torque)

    records, chance = simulate_records(problem, N_WITH_TERMS, seed=0), dict[float, float]()

    def by_chance(fit: Fit) -> float:
        # A fit without what is missing has a wider scatter than the drive, which is taken to be as it is drawn.
        size = 1.0 if fit.weighting.is_individual else fit.weighting.size
        if size not in chance:
            chance[size] = gain_by_chance(pool, base, records, size)
        return chance[size]

    def row(fit: Fit, cost: float, beside: TermFit | None = None) -> Row:
        effects = material_effects(problem, fit, sizes, LEAST_SIZE)
        gain = nothing - cost - problem.start_cost(fit)
        gain += beside.gain - by_level - by_chance(fit) if beside else 0.0
        log_evidence = gain / (2 * divided) + log_volume(problem, fit, sizes, divided)
        return Row(effects, beside is not None, log_evidence, fit, beside)

    rows = [row(fit, fit.cost) for fit in (*fits, *off_curve)]
    rows += [row(*both) for both in zip(best_fits, least, strict=True)]
    likeliest = max(rows, key=lambda r: round(r.log_evidence, COST_DIGITS)).fit
    exchanged = [*exchanged_fits(problem, likeliest)]
    rows += [row(*both) for both in zip(exchanged, least_costs(problem, exchanged, [base, *best_fits]), strict=True)]
    compared += _refitted(pool, exchanged, _strongest_terms(pool, exchanged))
    rows += [row(fit, fit.cost, beside) for fit, beside in compared if beside.gain > 0]
    best: dict[Key, Row] = {}
    for found in rows:
        key = found.effects, found.unnamed
        if key not in best or found.log_evidence > best[key].log_evidence:
            best[key] = found
    best |= {(r.effects, False): r for r in _with_faint_effects(problem, best, sizes, divided)}
    table = [replace(r, faint=_faint(best, r)) for r in best.values()]
    return (*table, *(replace(r, unnamed=True) for r in table if not r.unnamed))


def _with_faint_effects(
    problem: Problem, rows: Mapping[Key, Row], sizes: Mapping[str, float], divided: float
) -> Iterator[Row]:
    """The likeliest set with one more effect, of all that were not fitted because the record does not show them; of
    sets that are as likely the first, whatever the last digits are on this machine."""
    known = [row for row in rows.values() if not row.unnamed]
    greatest = max(row.log_evidence for row in known)
    row = max(known, key=lambda r: round(float(log_odds(greatest - r.log_evidence, len(r.effects))), COST_DIGITS))
    for name in problem.candidates:
        effects = row.effects | {name}
        if (effects, False) not in rows and find_effect(name).identification.sign_pair not in effects:
            log = log_evidence_of_faint(problem, row.fit, name, sizes, LEAST_SIZE, divided)
            # What gains was fitted.
            yield Row(effects, False, row.log_evidence + min(log, 0.0), row.fit)


def _faint(rows: Mapping[Key, Row], row: Row) -> frozenset[str]:
    """The effects of a row without which there is as much evidence."""
    shown = row.effects
    while shown:
        without = {shown - {name} for name in shown} & {effects for effects, unnamed in rows if unnamed == row.unnamed}
        ordered = sorted(without, key=sorted)
        best = max(ordered, key=lambda e: round(rows[e, row.unnamed].log_evidence, COST_DIGITS), default=None)
        if best is None or rows[best, row.unnamed].log_evidence < rows[shown, row.unnamed].log_evidence:
            break
        shown = best
    return row.effects - shown


def _strongest_terms(pool: WorkerPool, fits: Sequence[Fit]) -> Iterator[UnnamedFit]:
    """What gains most as something unnamed beside every fit."""
    return pool.map(_strongest, [pool.problem.without_weights(fit) for fit in fits])


def _refitted(pool: WorkerPool, fits: Sequence[Fit], unnamed: Iterable[UnnamedFit]) -> list[tuple[Fit, UnnamedFit]]:
    """Every fit with what is unnamed beside it; the likeliest of them, and those without effects, fitted anew."""
    found = [*zip(fits, unnamed, strict=True)]
    order = sorted(range(len(fits)), key=lambda k: fits[k].cost - found[k][1].gain)
    likeliest = sorted({*order[:N_BESIDE], *(k for k, fit in enumerate(fits) if not fit.names)})
    anew = pool.map(_fit_beside, [(pool.problem.without_weights(fits[k]), found[k][1]) for k in likeliest])
    for k, (fit, beside) in zip(likeliest, anew, strict=True):
        found[k] = replace(fit, weighting=fits[k].weighting.with_size(fit.weighting.size)), beside
    return found


def _strongest(problem: Problem, fit: Fit) -> UnnamedFit:
    return strongest_beside(problem, problem.with_weights(fit))


def _fit_beside(problem: Problem, job: tuple[Fit, UnnamedFit]) -> tuple[Fit, UnnamedFit]:
    fit, beside = fit_beside(problem, problem.with_weights(job[0]), job[1])
    return replace(fit, weighting=without_blocks(fit.weighting)), beside


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
    for fit in (*_scattering(fits), base):
        yield problem.fit_from(fit.names, fit.parameters, weights, HELD_SIZE)


def _with_curve_within_tolerance(problem: Problem, base: Fit, fits: Sequence[Fit]) -> Iterator[Fit]:
    """The best sets for a mean drive whose curve is off within its tolerances, and the fit without effects."""
    weights = weights_of_curve_within_tolerance(problem, base.prediction.torque)
    own = [fit for fit in fits if fit.names and not _scatters(fit)]
    for fit in (*own, *_scattering(fits), base) if weights is not None else ():
        yield problem.fit_from(fit.names, fit.parameters, weights, HELD_SIZE)


def _scattering(fits: Sequence[Fit]) -> list[Fit]:
    """The best sets that scatter more than a mean drive."""
    return [fit for fit in fits if fit.names and _scatters(fit)][:N_MEAN_DRIVE]


def _scatters(fit: Fit) -> bool:
    """Whether a fit scatters more than a mean drive."""
    return len(fit.weighting.eigenvalues) > 0 and fit.weighting.size >= MEAN_DRIVE_SIZE
