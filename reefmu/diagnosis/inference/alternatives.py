"""Other sets of effects: those that explain the record as well, and those that the scatter of tolerances may mask."""

from __future__ import annotations

from collections.abc import Sequence

from ...effects import find_effect
from ..estimation.exchanges import exchanges
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion
from ..estimation.search import is_degenerate
from ..estimation.weighting import INDIVIDUAL_SIZE, MEAN_DRIVE_SIZE
from .evidence import Evidence
from .individual_drive import IMPLAUSIBLE_SIZE, SCATTER_EFFECTS

EQUIVALENT_SHARE, EQUIVALENT_COST = 0.004, 9.0
"""Cost by which another set may be worse and still be an alternative: this share of the gain in which the two differ,
and at least three standard deviations of a normal variable, squared. The share is chosen by judgement; without it at
most one of 136 verdicts changes (ablation)."""
GENERAL_COST = 2.0
"""The same for a set with more parameters, which can imitate the chosen one; chosen by judgement."""
MAX_EQUIVALENT, MAX_MASKED = 5, 3
"""Sets that are reported at most, the best of them, for a reader's sake."""


def equivalent_sets(evidence: Evidence, chosen: Fit) -> tuple[tuple[str, ...], ...]:
    """Sets of no more effects that explain the record as well as the chosen one, the best first.

    The search fits only some sets of each size; those that the record cannot tell from the chosen one by its
    information are added, whether the search fitted them or not.
    """
    fitted, exchanged = _fitted_sets(evidence, chosen), indistinguishable_sets(evidence.problem, chosen)
    return tuple(dict.fromkeys((*fitted, *exchanged)))[:MAX_EQUIVALENT]


def indistinguishable_sets(problem: Problem, chosen: Fit) -> tuple[tuple[str, ...], ...]:
    """Sets with one effect of the chosen set exchanged that the record cannot tell from it, and, where several effects
    can be exchanged, with all of them exchanged, the best first."""
    found = sorted((e for e in exchanges(problem, chosen) if e.is_indistinguishable), key=lambda e: e.fit.cost)
    sets = [tuple(sorted(e.fit.names)) for e in found]
    pairs = [(set(chosen.names) - set(names), set(names) - set(chosen.names)) for names in sets]
    for first, (lost, gained) in enumerate(pairs):
        for other_lost, other_gained in pairs[first + 1 :]:
            if not lost & other_lost and not gained & other_gained:
                both = (set(chosen.names) - lost - other_lost) | gained | other_gained
                sets.append(tuple(sorted(both)))
    return tuple(sets)


def _fitted_sets(evidence: Evidence, chosen: Fit) -> tuple[tuple[str, ...], ...]:
    """Sets that the search fitted and that explain the record as well as the chosen one, the best first."""
    problem, thresholds = evidence.problem, evidence.thresholds
    best = evidence.search.best
    fits: Sequence[Fit] = [fit for size, fits in best.items() if 0 < size <= len(chosen.names) for fit in fits]
    found: list[tuple[str, ...]] = []
    for fit in sorted(fits, key=lambda f: f.cost):
        if set(fit.names) == set(chosen.names):
            continue
        # A gain that a drive without effects reaches by chance does not count.
        worse = fit.cost - chosen.cost + max(0.0, thresholds.total(fit) - thresholds.total(chosen))
        common = frozenset(fit.names) & frozenset(chosen.names)
        without = evidence.fits[common].cost if common in evidence.fits else evidence.search.base.cost
        allowance = max(EQUIVALENT_COST, EQUIVALENT_SHARE * (without - chosen.cost))
        if fit.n_effect_parameters > chosen.n_effect_parameters:
            allowance = GENERAL_COST
        if worse < allowance and not is_degenerate(problem, fit) and not _is_resolved_limit(evidence, fit, chosen):
            found.append(tuple(sorted(fit.names)))
    return tuple(found)


def _is_resolved_limit(evidence: Evidence, other: Fit, chosen: Fit) -> bool:
    """Whether a set differs only by a general effect of which the chosen effect is the limit, and the record can tell
    the two apart."""
    mine, theirs = set(chosen.names) - set(other.names), set(other.names) - set(chosen.names)
    if len(mine) != 1 or len(theirs) != 1:
        return False
    (limit,), (general,) = mine, theirs
    pairs = map(set, evidence.indistinguishable)
    return find_effect(limit).identification.limit_of == general and {limit, general} not in pairs


def masked_sets(evidence: Evidence, chosen: Fit) -> tuple[tuple[str, ...], ...]:
    """Sets with one more effect, which the scatter of the tolerances may mask, the best first.

    They gain more than noise does, but not enough to be significant on an individual. A set that makes the scatter
    plausible, or makes the drive the mean drive, need not gain anything.
    """
    problem = evidence.problem
    if problem.is_mean_drive:
        return ()
    dispersion, size = estimate_overdispersion(problem, chosen), chosen.weighting.size
    found: list[tuple[str, ...]] = []
    for fit in sorted(evidence.search.best.get(len(chosen.names) + 1, []), key=lambda f: f.cost):
        more = set(fit.names) - set(chosen.names)
        if len(more) != 1 or (name := more.pop()) not in SCATTER_EFFECTS or is_degenerate(problem, fit):
            continue
        becomes_mean_drive = size >= INDIVIDUAL_SIZE and fit.weighting.size <= MEAN_DRIVE_SIZE
        becomes_narrower = size >= IMPLAUSIBLE_SIZE and fit.weighting.size < size
        noise_gain = dispersion * evidence.thresholds.noise[name]
        if chosen.cost - fit.cost > (0.0 if becomes_mean_drive or becomes_narrower else noise_gain):
            found.append(tuple(sorted(fit.names)))
    return tuple(found[:MAX_MASKED])
