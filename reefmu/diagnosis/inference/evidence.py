"""What a verdict is drawn from, and how much of the record a fit leaves unexplained.

Costs are -2 log likelihood, gains are differences of costs. The excess of a fit is its cost less the cost that noise
and scatter leave on average. "Ablation", here and in the modules beside, means that the rule was switched off and 136
simulated records were decided again.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion, is_repeatable, remainder
from ..estimation.search import Search
from ..estimation.weighting import MEAN_DRIVE_SIZE, SCATTER_SIZES
from .individual_drive import residual_outside_population
from .thresholds import Thresholds, individual_share

CHANCE_DEVIATIONS = 3.0
"""Standard deviations of the chi-square within which an excess counts as chance: the usual three-sigma limit."""
VISIBLE_SHARE, VISIBLE_SHARE_INDIVIDUAL = 0.0025, 0.0045
"""Smallest remainder, rms over full torque, that is reported for the mean drive and for an individual, whose scatter is
not entirely within the components; chosen by judgement on simulated records."""
NOISE_VARIANCE_ERROR = 0.4
"""Smallest relative error that the estimated noise variance is assumed to have; chosen by judgement."""
NOISE_DEVIATIONS = 3.0
"""Standard errors of the estimated noise variance that a remainder must exceed: the usual three-sigma limit."""
UNREPEATED_FACTOR = 2.0
"""Factor on the error of the noise variance that the mean square of a remainder must exceed where repeated cycles do
not confirm it; chosen by judgement."""


@dataclass(frozen=True)
class Evidence:
    """What a verdict is drawn from.

    problem: the record, its noise and scatter; search: the sets of effects that were fitted; thresholds: gains that
    drives without effects reach; indistinguishable: pairs of effects that this record cannot tell apart.
    """

    problem: Problem
    search: Search
    thresholds: Thresholds
    indistinguishable: tuple[tuple[str, str], ...] = ()

    @cached_property
    def fits(self) -> Mapping[frozenset[str], Fit]:
        """The fitted sets by their names."""
        return {frozenset(fit.names): fit for fits in self.search.best.values() for fit in fits}

    def for_mean_drive(self, base: Fit) -> Evidence:
        """The same evidence under the hypothesis that the record is of the mean drive; base: the fit without effects
        under that hypothesis."""
        return replace(self, problem=replace(self.problem, is_mean_drive=True), search=replace(self.search, base=base))


def unexplained_excess(evidence: Evidence, fit: Fit) -> float:
    """Excess of a fit beyond what chance and an individual of the population leave; never negative.

    An excess that is spread over the whole record and does not repeat with the cycles is taken for noise of a larger
    variance than estimated.
    """
    problem = evidence.problem
    null_excess = individual_share(fit.weighting.size) * evidence.thresholds.null_excess
    excess = problem.excess_cost(fit) - _chance_excess(problem) - null_excess
    if excess > 0 and not is_repeatable(problem, fit):
        excess -= (estimate_overdispersion(problem, fit) - 1) * problem.expected_chi_square(fit.weighting)
    return max(0.0, excess)


def _chance_excess(problem: Problem) -> float:
    """Excess that noise alone stays below."""
    ratio = problem.block_variance / problem.variance
    return CHANCE_DEVIATIONS * float(np.sqrt(2 * (ratio**2).sum()))


def is_significant_remainder(evidence: Evidence, fit: Fit) -> bool:
    """Whether a fit leaves a systematic remainder that is significant, visible and no mere noise."""
    problem = evidence.problem
    return (
        unexplained_excess(evidence, fit) > 0
        and remainder(problem, fit) > visible_remainder(problem, fit)
        and _is_systematic(problem, fit)
    )


def visible_remainder(problem: Problem, fit: Fit) -> float:
    """Smallest remainder, N.m rms, that is reported."""
    is_individual = len(fit.weighting.eigenvalues) > 0 and fit.weighting.size > MEAN_DRIVE_SIZE
    share = VISIBLE_SHARE_INDIVIDUAL if is_individual else VISIBLE_SHARE
    return max(share * problem.base.full_torque, float(np.sqrt(_noise_error(problem))))


def _is_systematic(problem: Problem, fit: Fit) -> bool:
    """Whether a remainder is more than noise of another variance or correlation than estimated.

    Noise does not repeat with the cycles. A remainder where no cycle repeats (rotation, holds) does not show there; it
    is accepted if it clearly exceeds the error of the noise variance.
    """
    return is_repeatable(problem, fit) or remainder(problem, fit) ** 2 > UNREPEATED_FACTOR * _noise_error(problem)


def _noise_error(problem: Problem) -> float:
    """Error, (N.m)^2, of the variance of what does not repeat in the blocks: noise, and scatter between cycles.

    Correlated noise has few independent samples, and the differences of two cycles half as many. The variance between
    cycles has the standard error of a chi-square distribution.
    """
    standard_error = float(np.sqrt(4 * problem.noise.correlation_time / len(problem.trace)))
    share = max(NOISE_VARIANCE_ERROR, NOISE_DEVIATIONS * standard_error)
    if problem.cycle_scatter is not None:
        share = max(share, NOISE_DEVIATIONS * float(np.sqrt(2 / problem.cycle_scatter.freedom)))
    return share * float(np.mean(problem.block_variance))


def residual_of_other_origin(problem: Problem, fit: Fit) -> float:
    """Rms, N.m, of a residual that only the widest scatter explains but no individual of the population shows; else
    0."""
    return residual_outside_population(problem, fit) if fit.weighting.size >= SCATTER_SIZES[-1] else 0.0
