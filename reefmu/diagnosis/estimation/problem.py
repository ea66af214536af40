"""The estimation problem of one record: its signals, noise and scatter, and fits of sets of effects to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import IndependentVariable
from ..forward.base_curve import BaseCurve
from ..forward.parameter_layout import N_RIG, ParameterLayout
from ..forward.predictor import Contacts, Predictor
from ..preprocessing.cycle_scatter import CycleScatter
from ..preprocessing.cycles import Cycles
from ..preprocessing.noise import Noise
from ..preprocessing.thinning import thin_trace
from ..preprocessing.trace import Blocks, Trace, make_blocks
from ..random_effects.tolerance_scatter import Spread, ToleranceScatter, in_turn
from .least_squares import Fit, FitOptions, ParameterBounds, fit, make_bounds
from .weighting import (
    INDIVIDUAL_SIZE,
    Weighting,
    are_gains_alike,
    has_no_blocks,
    make_weighting,
    weighting_of_covariance,
    without_blocks,
)

SEARCH_BLOCKS = 2000
"""Approximate number of blocks on which sets of effects are searched. Chosen by judgement to bound the time: more show
a missing ball better, and ripples of shorter periods (`tests/benchmarks/diagnosis/bench_blocks.py`)."""
SAME_TWIST, SAME_CLEARANCE = 0.02, 0.3
"""Changes of the contacts' twist, over the base curve's greatest twist, and of their clearance, in standard deviations
of the population, within which the scatter is not computed anew. Chosen by judgement."""
ZERO_SIGN = 0.05
"""Torque of either sign, over full torque, from which the twist's zero lies among the twists of the record; chosen by
judgement, above the usual friction and offset of a sensor."""
ZERO_MARGIN = 0.05
"""Share of the twist's range by which its zero may then lie outside, for an offset of the torque; by judgement."""
DELAY_DEVIATION, MAX_DELAY = 0.005, 2.0
"""s, standard deviation of the torque's delay, and its greatest value in such deviations. A low-pass filter of fourth
order (Butterworth) delays by 0.42 over its cut-off frequency: the deviation is that of 80 Hz, the limit that of 40 Hz.
Both are at most half a sampling interval and a whole one: the rows of a record belong together."""
ZERO_SCALE = 0.01
"""Scale of the twist's zero in a fit, over the base curve's greatest twist; by judgement, for conditioning alone."""


@dataclass(frozen=True)
class Problem:
    """One record and what is known of it before any effect is named. Stages replace it; none changes it.

    trace: all samples; blocks: n of them, over which residuals are averaged; variance: (n,) (N.m)^2, weight of each
    block, noise and scatter between cycles with their whole autocorrelation; block_variance: (n,) (N.m)^2, variance of
    both in each block mean; candidates: effects that may be named; excluded: the others, with the reason; scatter: of
    the population, None without a drawing; weights_cache: memo of `weights_at`; individuals: (m, n) N.m, torque of
    simulated individual drives less the mean drive's, (0, n) without a drawing; cycle_scatter: between cycles that
    repeat in torque, None where none do or they repeat in time; cycles: those that repeat in torque, if any;
    cost_of_start: of `Trace.friction` to sets with such friction, in -2 log likelihood, by its angle.
    """

    base: BaseCurve
    trace: Trace
    blocks: Blocks
    noise: Noise
    weights: Weighting
    variance: Array
    block_variance: Array
    candidates: tuple[str, ...]
    excluded: dict[str, str]
    scatter: ToleranceScatter | None
    weights_cache: list[tuple[Contacts, Weighting]] = field(default_factory=list)
    individuals: Array = field(default_factory=lambda: np.zeros((0, 0)))
    cycle_scatter: CycleScatter | None = None
    cycles: Cycles | None = None
    cost_of_start: Mapping[IndependentVariable, float] = field(default_factory=dict)

    @cached_property
    def torque(self) -> Array:
        """(n,) N.m, measured torque averaged over the blocks."""
        return self.blocks.mean(self.trace.torque)

    def layout(self, names: Sequence[str]) -> ParameterLayout:
        """Positions of the parameters of a set of effects in the vector of a fit."""
        return ParameterLayout(self.base.shape.size, tuple(names))

    @cached_property
    def for_ranking(self) -> Problem:
        """The problem on which sets are ranked: with fewer samples where the record is long, else this one."""
        trace, blocks = thin_trace(self.trace, self.blocks)
        return self if trace is self.trace else replace(self, trace=trace, blocks=blocks)

    def predictor(self, names: Sequence[str]) -> Predictor:
        """The predictor of a set of effects, averaged over the blocks."""
        key = tuple(names)
        if key not in self._last_predictor:
            self._last_predictor.clear()
            self._last_predictor[key] = Predictor(self.trace, self.base, names, self.blocks)
        return self._last_predictor[key]

    @cached_property
    def _last_predictor(self) -> dict[tuple[str, ...], Predictor]:
        """The predictor that was asked for last: a fit often continues where another ended."""
        return {}

    def bounds(self, names: Sequence[str]) -> ParameterBounds:
        """Bounds of the rig's parameters, the base shape and a set of effects."""
        shape, delay = self.base.shape, min(DELAY_DEVIATION, 0.5 * self.sampling_interval or DELAY_DEVIATION)
        latest = min(MAX_DELAY * delay, self.sampling_interval)
        base = ParameterBounds(
            np.concatenate([[self.zero_range[0], -latest], shape.low]),
            np.concatenate([[self.zero_range[1], latest], shape.high]),
            np.concatenate([[ZERO_SCALE * self.base.max_twist, delay], np.ones(shape.size)]),
            np.zeros(N_RIG + shape.size, bool),
            np.concatenate([[np.inf, delay], shape.prior_deviation]),
            np.concatenate([[0.0, 0.0], shape.start]),
        )
        return make_bounds(tuple(names), base)

    def start(self, zero: float) -> Array:
        """Parameters of a fit without effects that start from a zero of the twist, rad."""
        return np.concatenate([[zero, 0.0], self.base.shape.start])

    @cached_property
    def sampling_interval(self) -> float:
        """s, usual time between samples; 0 where there is none."""
        trace = self.trace
        step = trace.step[~trace.start & (trace.step > 0)]
        return float(np.median(step)) if step.size else 0.0

    @cached_property
    def zero_range(self) -> tuple[float, float]:
        """Bounds of the twist's zero, rad: it lies within the twists of the record where the torque has both signs.

        Elsewhere it may lie beyond them, as far as the base curve reaches.
        """
        low, high = float(self.trace.twist.min()), float(self.trace.twist.max())
        least = ZERO_SIGN * self.base.full_torque
        has_both_signs = self.trace.torque.min() < -least and self.trace.torque.max() > least
        margin = ZERO_MARGIN * (high - low) if has_both_signs else self.base.max_twist
        return low - margin, high + margin

    def weights_at(self, found: Fit) -> Weighting | None:
        """Weights with the scatter that the contacts have under a fit's effects; None where it is not known yet
        (`weights_of_contacts`, `remember`).

        A drive with backlash scatters where its contacts carry load; a preloaded one scatters at zero torque too.
        Friction in proportion to the load scatters with it.
        """
        if self.scatter is None or found.weighting.size < INDIVIDUAL_SIZE:
            return self.weights
        at = found.prediction.contacts
        near = ((c, w) for c, w in self._known_weights if self.are_alike(at, c) and are_gains_alike(at.gain, c.gain))
        return next((weights.with_gain(at.gain / known.gain) for known, weights in near), None)

    def are_new(self, contacts: Contacts, others: Sequence[Contacts]) -> bool:
        """Whether contacts scatter like no known ones and no others, even with another gain."""
        known = (of_known for of_known, _ in self._known_weights)
        return not any(self.are_alike(contacts, other) for other in (*known, *others))

    def are_alike(self, some: Contacts, others: Contacts) -> bool:
        """Whether contacts scatter alike but for their gain."""
        assert self.scatter is not None
        near, alike = SAME_TWIST * self.base.max_twist, SAME_CLEARANCE * self.scatter.clearance_deviation
        clearance = np.abs(some.clearance - others.clearance).max()
        return bool(np.abs(some.twist - others.twist).max() < near and clearance < alike)

    @property
    def _known_weights(self) -> list[tuple[Contacts, Weighting]]:
        assert self.scatter is not None
        n = len(self.scatter.twist)
        return [(Contacts(self.scatter.twist, np.zeros(n), np.ones(n)), self.weights), *self.weights_cache]

    def weights_of_contacts(self, found: Fit, spread: Spread = in_turn) -> Weighting:
        """Weights with the scatter at the contacts of a fit: that of alike contacts with another gain, which costs a
        decomposition, or computed anew; spread: as in `ToleranceScatter`."""
        assert self.scatter is not None
        at = found.prediction.contacts
        for known, weights in self._known_weights:
            if self.are_alike(at, known):
                return weights.with_gain(at.gain / known.gain)
        beside = self.predictor(found.names).twist_beside_sensors(found.parameters)
        covariance = self.scatter.covariance_at(at.twist, at.clearance, beside, spread) * at.gain * at.gain[:, None]
        return weighting_of_covariance(self.variance, covariance).with_unknown_forms(self.base.full_torque)

    def remember(self, found: Fit, weights: Weighting) -> None:
        """Keep the weights at the contacts of a fit for `weights_at`."""
        self.weights_cache.append((found.prediction.contacts, weights))

    def fit_from(
        self, names: Sequence[str], start: Array, weights: Weighting | None = None, options: FitOptions | None = None
    ) -> Fit:
        """Fit a set of effects from `start` (k,), under the problem's weights unless others are given."""
        weights = self.weights if weights is None else weights
        return fit(self.predictor(names), self.torque, weights, self.bounds(names), start, options)

    def without_weights(self, found: Fit) -> Fit:
        """A fit to send to another process, whose problem has the same weights; others are sent along."""
        return replace(found, weighting=without_blocks(found.weighting)) if self.has(found.weighting) else found

    def has(self, weights: Weighting) -> bool:
        """Whether weights are those of the problem, but for the size of the scatter."""
        return weights.basis is self.weights.basis and np.array_equal(weights.scale, self.weights.scale)

    def with_weights(self, found: Fit) -> Fit:
        """A fit as `without_weights` sent it, complete again."""
        if not has_no_blocks(found.weighting):
            return found
        return replace(found, weighting=self.weights.with_size(found.weighting.size))

    def start_cost(self, found: Fit) -> float:
        """What friction at the start of runs costs a fit, in -2 log likelihood."""
        return sum(self.cost_of_start.get(path, 0.0) for path in found.friction_paths)

    @property
    def noise_of_blocks(self) -> Array:
        """(n,) variance of each block alone, over that of its weight."""
        return self.block_variance / self.variance

    def expected_squares(self, weights: Weighting) -> Array:
        """(n,) expected squares of whitened noise and scatter, by block."""
        return weights.expected_squares(self.noise_of_blocks)

    def expected_chi_square(self, weights: Weighting) -> float:
        """Their sum over all blocks."""
        return float(self.expected_squares(weights).sum())

    def excess_cost(self, found: Fit) -> float:
        """The cost of a fit beyond its expectation under noise and scatter alone."""
        return found.cost - self.expected_chi_square(found.weighting) - found.weighting.log_determinant


def search_blocks(trace: Trace, count: int = SEARCH_BLOCKS) -> Blocks:
    """About `count` blocks, on which sets of effects are searched."""
    return make_blocks(trace, max(1, round(len(trace) / count)))


def make_weights(
    variance: Array, scatter: ToleranceScatter | None, full_torque: float, spread: Spread = in_turn
) -> Weighting:
    """Weights of blocks with a noise `variance` (n,), (N.m)^2; without a drawing `scatter` is None and there are no
    random effects. full_torque: N.m, of the base curve; spread: as in `ToleranceScatter`."""
    if scatter is None:
        return make_weighting(variance, np.zeros((0, len(variance))))
    covariance = scatter.covariance_at(scatter.twist, spread=spread)
    return weighting_of_covariance(variance, covariance).with_unknown_forms(full_torque)
