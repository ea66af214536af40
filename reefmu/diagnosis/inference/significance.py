"""What may be called found: significant against individuals of the population, large, and worth its place.

Every effect of a set must be missed when it is left out: by more than a null drive would gain from it under this
very excitation, by a good part of what is still unexplained, and by a visible amount of torque.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import EFFECTS, find_effect
from ..estimation.held_out import held_out_ratio
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion, is_repeatable, torque_without
from ..estimation.search import Search, is_degenerate, restrict_fit
from ..estimation.weighting import INDIVIDUAL_SIZE, MEAN_DRIVE_SIZE
from .individual_drive import SCATTER_LIKE, limited_to_tolerances, may_be_individual
from .model_comparison import FORM_ERROR
from .population_spread import population_deviations
from .thresholds import NOISE_GAIN, Thresholds

FIRST_SHARE, FURTHER_SHARE = 0.5, 0.35
"""Share of the excess left without it that an effect must remove: a set's as a whole, and each effect's."""
MATERIAL_FIRST, MATERIAL = 0.0006, 0.002
"""Change of some run, rms, that is worth a name, as a share of full torque: alone, and beside other effects."""
FORM_ERROR_ALL = 0.004
"""Share of the gain of its kin that a further effect of a family must reach where it explains all that was left."""
SEVERAL_TIMES = frozenset(e.name for e in EFFECTS.values() if e.identification.relaxation_spectrum)
"""Effects that materials have with several times and the model with one: the fastest of them look like a spring, which
then explains all that was left."""
GENERAL = frozenset(e.name for e in EFFECTS.values() if e.identification.contains_limit)
"""Effects with a parameter that may run to the limit where another effect takes over; they must be better by
`BETTER`."""
BETTER = 8.0
"""Gain that a further parameter which may run to a limit must bring."""
FARTHER = 1.4
"""Gap of the model alone, over that before, beyond which scatter does what the names should."""
OVER_SCATTER = 2.5
"""Least size of an effect on an individual, in standard deviations of the population along its trace."""
IDLE = 0.9
"""Share of the gap of runs that were not fitted that a name which does what parts do may leave."""


@dataclass(frozen=True)
class SignificanceTest:
    """Whether every effect of a set earns its place; shares: of what is unexplained without it; reasons: why not."""

    fit: Fit
    holds: bool
    shares: Mapping[str, float]
    reasons: Mapping[str, str]


def chance_excess(problem: Problem) -> float:
    """Excess within which noise alone may lie."""
    ratio = problem.block_variance / problem.variance
    return 3.0 * float(np.sqrt(2 * (ratio**2).sum()))


def unexplained_excess(problem: Problem, fit: Fit) -> float:
    """Excess of a fit beyond what chance and a single drive of the population could make.

    What is everywhere and does not come again with the cycles is a noise that is louder than estimated.
    """
    share = float(np.clip((fit.weighting.size - MEAN_DRIVE_SIZE) / 0.35, 0.0, 1.0))
    excess = problem.excess_cost(fit) - chance_excess(problem) - share * problem.null_excess
    if excess > 0 and not is_repeatable(problem, fit):
        excess -= (estimate_overdispersion(problem, fit) - 1) * problem.expected_chi_square(fit.weighting)
    return max(0.0, excess)


def assess_set(
    problem: Problem, fit: Fit, base: Fit, thresholds: Thresholds, known: Mapping[frozenset[str], Fit]
) -> SignificanceTest:
    """Leave out each effect in turn, refit, and see whether it is missed."""
    rest, size, overdispersion = (
        unexplained_excess(problem, fit),
        fit.weighting.size,
        estimate_overdispersion(problem, fit),
    )
    shares, reasons, left_out = {}, {}, {}
    for name in fit.names:
        others = tuple(n for n in fit.names if n != name)
        smaller = left_out[name] = _smaller(problem, fit, name, others, known) if others else base
        gain = limited_to_tolerances(problem, smaller, fit).cost - fit.cost
        group = find_effect(name).identification.confounding_group
        kin = [other for other in others if group and find_effect(other).identification.confounding_group is group]
        form = FORM_ERROR if rest or SEVERAL_TIMES & set(kin) else FORM_ERROR_ALL
        shares[name] = gain / (gain + rest) if gain > 0 else 0.0
        change = torque_without(problem, fit, name) - fit.prediction.torque
        least = thresholds.of(name, size) * overdispersion
        if gain < least:
            reasons[name] = f"gains {gain:.0f}, an individual drive up to {least:.0f}"
        elif kin and gain < form * (_plain(others, kin, base, known).cost - smaller.cost):
            reasons[name] = f"gains {gain:.0f}: so much may the form of {' and '.join(kin)} be wrong"
        elif shares[name] < FURTHER_SHARE:
            reasons[name] = f"removes {100 * shares[name]:.0f} % of what is left without it"
        elif largest_run_rms(problem, change) < (MATERIAL if others else MATERIAL_FIRST) * problem.base.full_torque:
            reasons[name] = "changes no run visibly"
        elif (
            may_be_individual(problem, fit, base, smaller, name, overdispersion)
            and (over := population_deviations(problem, fit, change)) < OVER_SCATTER
        ):
            reasons[name] = f"is {over:.1f} times what single drives of the population make of the kind by themselves"
    if not reasons and size >= INDIVIDUAL_SIZE:
        reasons = _idle(problem, fit, {name: left_out[name] for name in fit.names if name in SCATTER_LIKE})
    gain = limited_to_tolerances(problem, base, fit).cost - fit.cost
    whole = gain / (gain + rest) if gain > 0 else 0.0
    return SignificanceTest(fit, not reasons and whole >= FIRST_SHARE and _closer(problem, fit, base), shares, reasons)


def _plain(names: Sequence[str], kin: Sequence[str], base: Fit, known: Mapping[frozenset[str], Fit]) -> Fit:
    """The fit of a set without the kin of the effect in question, as far as it was made."""
    return known.get(frozenset(names) - frozenset(kin), base)


def _closer(problem: Problem, fit: Fit, base: Fit) -> bool:
    """Whether the model itself, without what scatter may add to it, stays about as close to the record."""
    before, after = (float(np.sum((problem.torque - f.prediction.torque) ** 2)) for f in (base, fit))
    return after < FARTHER**2 * before


def _smaller(
    problem: Problem, fit: Fit, name: str, others: tuple[str, ...], known: Mapping[frozenset[str], Fit]
) -> Fit:
    """The best fit of a set without one of its effects, from where the set stands and from where it was found."""
    weights = fit.weighting if problem.weights_at(fit) is not problem.weights else None
    fits = [problem.fit_from(*restrict_fit(problem, fit, frozenset(others)), weights)]
    if (found := known.get(frozenset(others))) is not None:
        fits.append(found)
    return min(fits, key=lambda f: f.cost)


def largest_run_rms(problem: Problem, change: Array) -> float:
    """Greatest rms of a change (n,) over a run, N.m."""
    runs = problem.trace.run[problem.blocks.first]
    return max(float(np.sqrt(np.mean(change[runs == r] ** 2))) for r in np.unique(runs))


def largest_significant_set(
    problem: Problem, found: Search, thresholds: Thresholds
) -> tuple[SignificanceTest | None, list[SignificanceTest]]:
    """The largest set in which every effect is justified, and what was examined."""
    known = {frozenset(f.names): f for fits in found.best.values() for f in fits}
    examined: list[SignificanceTest] = []
    for size in sorted((k for k in found.best if k), reverse=True):
        for fit in _likeliest(problem, found.best[size], thresholds):
            verdict = assess_set(problem, fit, found.base, thresholds, known)
            if verdict.holds and not _worth_its_size(problem, fit, found):
                verdict = replace(verdict, holds=False, reasons={fit.names[-1]: "a smaller set does as well"})
            examined.append(verdict)
            if verdict.holds:
                return verdict, examined
    return None, examined


def _idle(problem: Problem, fit: Fit, left_out: Mapping[str, Fit]) -> dict[str, str]:
    """Names that do what parts do, but not in runs that were not fitted; left_out: the fits without each name."""
    shares = {name: held_out_ratio(problem, smaller, fit) for name, smaller in left_out.items()}
    return {
        name: f"leaves {100 * share:.0f} % of the gap in runs that were not fitted"
        for name, share in shares.items()
        if share > IDLE
    }


def _worth_its_size(problem: Problem, fit: Fit, found: Search) -> bool:
    """Whether a set is better than all smaller ones, of whatever names, by more than noise gives."""
    smaller = [f.cost for f in found.best.get(len(fit.names) - 1, []) if not is_degenerate(problem, f)]
    return not smaller or min(smaller) - fit.cost > NOISE_GAIN * estimate_overdispersion(problem, fit)


def _likeliest(problem: Problem, fits: Sequence[Fit], thresholds: Thresholds) -> list[Fit]:
    """The set that stands out most over what each of its effects would gain on a null drive by chance."""
    fits = [f for f in fits if not is_degenerate(problem, f)] or list(fits)
    return [min(fits, key=lambda f: f.cost + thresholds.total(f) + BETTER * len(GENERAL & set(f.names)))]
