"""Which sets of effects are significant.

Every effect of a set must be missed when it is left out and the rest refitted: its gain must exceed what a drive
without effects reaches under this excitation and what the laws of the effects beside it may be wrong by, and it must
remove a good part of what is unexplained without it.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import EFFECTS, find_effect
from ..estimation.held_out import held_out_ratio
from ..estimation.least_squares import Fit, by_cost
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion, torque_without
from ..estimation.search import is_degenerate, restrict_fit
from ..estimation.weighting import INDIVIDUAL_SIZE
from .evidence import Evidence, unexplained_excess
from .individual_drive import (
    LAW_ERROR,
    SCATTER_EFFECTS,
    limited_to_tolerances,
    may_be_individual,
    population_deviations,
)
from .thresholds import NOISE_GAIN, Thresholds

EFFECT_SHARE = 0.35
"""Share of the unexplained excess that each effect must remove. Chosen by judgement; without it a further friction is
named in measured records of a printed gear, whose laws are only nearly right."""
SMALL_LAW_ERROR = 0.004
"""In place of `LAW_ERROR` where a further effect of a group leaves no excess: minimum gain of that effect, relative to
the group's gain. Chosen on simulated records; without both 2 of 136 verdicts become worse (ablation)."""
SPECTRUM_EFFECTS = frozenset(e.name for e in EFFECTS.values() if e.identification.relaxation_spectrum)
"""Effects of which materials have a spectrum of relaxation times and the model only one. The fastest times act as a
spring, which then leaves no excess although it is not real, so that `LAW_ERROR` holds for their group throughout."""
MAX_RESIDUAL_RATIO = 1.4
"""Residual of the model without scatter, rms over that without effects, above which scatter explains what the effects
should. Chosen by judgement; without it at most one of 136 verdicts changes (ablation)."""
MIN_POPULATION_DEVIATIONS = 2.5
"""Smallest effect that is named on a possible individual, in standard deviations of the population along its direction.
Chosen on simulated records; without it 5 of 136 verdicts become worse (ablation)."""
MAX_HELD_OUT_RATIO = 0.9
"""Residual in runs that were not fitted, with an effect that acts like scatter over that without it, above which the
effect is not confirmed. Chosen by judgement; without it one of 136 verdicts becomes worse (ablation)."""


@dataclass(frozen=True)
class SignificanceTest:
    """A set under test. is_significant: whether every effect is; shares: of the excess without each effect, the part
    that it removes; reasons: why effects are not significant, by name."""

    fit: Fit
    is_significant: bool
    shares: Mapping[str, float]
    reasons: Mapping[str, str]


@dataclass(frozen=True)
class Omission:
    """An effect left out of a set. name: of the effect; smaller: the rest of the set, refitted; gain: of the effect
    over the rest with a plausible scatter; change: (n,) N.m, of the torque when the effect is switched off."""

    name: str
    smaller: Fit
    gain: float
    change: Array

    def share(self, excess: float) -> float:
        """Part of the excess without the effect that it removes, where it leaves `excess`."""
        return _removed_share(self.gain, excess)


def largest_significant_set(evidence: Evidence) -> tuple[SignificanceTest | None, tuple[SignificanceTest, ...]]:
    """The largest set in which every effect is significant, None if there is none, and all tests that were made."""
    tests: list[SignificanceTest] = []
    best = evidence.search.best
    for size in sorted((size for size in best if size), reverse=True):
        test = assess_set(evidence, _likeliest(evidence.problem, best[size], evidence.thresholds))
        if test.is_significant and not _is_better_than_smaller_sets(evidence, test.fit):
            reasons = {test.fit.names[-1]: "a set with fewer effects is as good"}
            test = replace(test, is_significant=False, reasons=reasons)
        tests.append(test)
        if test.is_significant:
            return test, tuple(tests)
    return None, tuple(tests)


def assess_set(evidence: Evidence, fit: Fit) -> SignificanceTest:
    """Leave out each effect in turn, refit, and test what it brings."""
    problem, base = evidence.problem, evidence.search.base
    excess, dispersion = unexplained_excess(evidence, fit), estimate_overdispersion(problem, fit)
    omissions = [_leave_out(evidence, fit, name) for name in fit.names]
    shares = {omission.name: omission.share(excess) for omission in omissions}
    objections = {omission.name: _objection(evidence, fit, omission, excess, dispersion) for omission in omissions}
    reasons = {name: reason for name, reason in objections.items() if reason}
    if not reasons and fit.weighting.size >= INDIVIDUAL_SIZE:
        reasons = _unconfirmed_effects(problem, fit, omissions)
    is_significant = not reasons and _residual_stays_small(problem, fit, base)
    return SignificanceTest(fit, is_significant, shares, reasons)


def _removed_share(gain: float, excess: float) -> float:
    return gain / (gain + excess) if gain > 0 else 0.0


def _leave_out(evidence: Evidence, fit: Fit, name: str) -> Omission:
    """An effect left out of a set, which is refitted from where it stands and from where the search found it.

    Where it stands the scatter is that at the contacts of the whole set: an effect must bring more than a smaller
    scatter does.
    """
    problem = evidence.problem
    others = frozenset(fit.names) - {name}
    smaller = problem.fit_from(*restrict_fit(problem, fit, others), fit.weighting)
    known = evidence.fits.get(others) if others else evidence.search.base
    if known is not None and known.cost < smaller.cost:
        smaller = known
    gain = limited_to_tolerances(problem, smaller, fit).cost - fit.cost
    return Omission(name, smaller, gain, torque_without(problem, fit, name) - fit.prediction.torque)


def _objection(evidence: Evidence, fit: Fit, omission: Omission, excess: float, dispersion: float) -> str:
    """Why an effect of a set is not significant; empty if it is. excess, dispersion: of the whole set."""
    problem, base, name, gain = evidence.problem, evidence.search.base, omission.name, omission.gain
    least = evidence.thresholds.of(name, fit.weighting.size) * dispersion
    if gain < least:
        return f"gains {gain:.0f}, a drive without effects up to {least:.0f}"
    others = frozenset(fit.names) - {name}
    confounded = [n for n in fit.names if n in others and _are_confounded(n, name)]
    if confounded:
        share = LAW_ERROR if excess or SPECTRUM_EFFECTS & set(confounded) else SMALL_LAW_ERROR
        without_group = evidence.fits.get(others - frozenset(confounded), base)
        if gain < share * (without_group.cost - omission.smaller.cost):
            return f"gains {gain:.0f}, no more than an error in the law of {' and '.join(confounded)} may make"
    if omission.share(excess) < EFFECT_SHARE:
        return f"removes only {100 * omission.share(excess):.0f} % of what is unexplained without it"
    if may_be_individual(problem, fit, base, omission.smaller, name, dispersion):
        deviations = population_deviations(problem, fit, omission.change)
        if deviations < MIN_POPULATION_DEVIATIONS:
            return f"is only {deviations:.1f} standard deviations of what individuals show without it"
    return ""


def _are_confounded(first: str, second: str) -> bool:
    """Whether two effects absorb each other's misfit."""
    group = find_effect(second).identification.confounding_group
    return group is not None and find_effect(first).identification.confounding_group is group


def _unconfirmed_effects(problem: Problem, fit: Fit, omissions: Sequence[Omission]) -> dict[str, str]:
    """Effects that act like scatter and do not reduce the residual of runs that were not fitted, with the reason."""
    tested = [omission for omission in omissions if omission.name in SCATTER_EFFECTS]
    ratios = {omission.name: held_out_ratio(problem, omission.smaller, fit) for omission in tested}
    return {
        name: f"leaves {100 * ratio:.0f} % of the gap in runs that were not fitted"
        for name, ratio in ratios.items()
        if ratio > MAX_HELD_OUT_RATIO
    }


def _residual_stays_small(problem: Problem, fit: Fit, base: Fit) -> bool:
    """Whether the model without the scatter stays about as close to the record as without effects."""
    before, after = (float(np.sum((problem.torque - f.prediction.torque) ** 2)) for f in (base, fit))
    return after < MAX_RESIDUAL_RATIO**2 * before


def _is_better_than_smaller_sets(evidence: Evidence, fit: Fit) -> bool:
    """Whether a set gains more than noise gives over every set, of any names, with one effect less."""
    problem = evidence.problem
    smaller = [f.cost for f in evidence.search.best.get(len(fit.names) - 1, []) if not is_degenerate(problem, f)]
    return not smaller or min(smaller) - fit.cost > NOISE_GAIN * estimate_overdispersion(problem, fit)


def _likeliest(problem: Problem, fits: Sequence[Fit], thresholds: Thresholds) -> Fit:
    """The set whose cost is lowest once the gains are added that each of its effects reaches by chance."""
    resolved = [fit for fit in fits if not is_degenerate(problem, fit)] or list(fits)

    return min(resolved, key=lambda fit: by_cost(replace(fit, cost=fit.cost + thresholds.total(fit))))
