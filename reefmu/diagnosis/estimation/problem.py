"""One record under examination: its traces, its noise, its scatter, and fits of sets of effects to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import EFFECTS, Effect, Requirement
from ..forward.base_curve import BaseCurve
from ..forward.parameter_layout import ParameterLayout
from ..forward.predictor import Predictor
from ..preprocessing.noise import Noise
from ..preprocessing.trace import Blocks, Trace, make_blocks
from ..random_effects.scatter import Scatter
from .least_squares import Fit, ParameterBounds, fit, is_logarithmic, make_bounds, may_be_infinite
from .weighting import Weighting, is_size_only, size_only, weighting

N_PHASES = 12
"""Phases at which a missing ball is looked for."""
LARGE_CRANK_TWIST = 0.15
"""Twist, rad at the crank, beyond which it matters from the start where a missing ball stands."""
SEARCH_BLOCKS = 2400
"""Blocks on which sets of effects are searched."""


@dataclass(frozen=True)
class Problem:
    """One record and what is known of it before any effect is named; a value that no stage changes.

    trace: all samples; blocks: over which residuals are averaged, n of them; variance: (n,) that weighs each, with the
    noise's correlation in it; block_variance: (n,) what the noise alone leaves in each; candidates: names; excluded:
    others, with the reason; scatter: of the population, None without a drawing; null_excess: what single drives of the
    population leave beyond the components, as a cost; weights_cache: a memo of `weights_at`, the weights by
    the twist and the clearance that the contacts feel; is_mean_drive: whether this is the mean drive, so that the
    scatter keeps small; individuals: (m, n) N.m, single drives of the population less their mean.
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
    scatter: Scatter | None
    null_excess: float = 0.0
    weights_cache: list[tuple[Array, Array, Weighting]] = field(default_factory=list)
    is_mean_drive: bool = False
    individuals: Array = field(default_factory=lambda: np.zeros((0, 0)))

    @cached_property
    def torque(self) -> Array:
        """Measured torque, N.m, of the blocks."""
        return self.blocks.mean(self.trace.torque)

    def layout(self, names: Sequence[str]) -> ParameterLayout:
        """Where the parameters of a set of effects stand in the vector of a fit."""
        return ParameterLayout(self.base.n_shape, tuple(names))

    def predictor(self, names: Sequence[str]) -> Predictor:
        """Of a set of effects, on the blocks."""
        return Predictor(self.trace, self.base, names, self.blocks)

    def bounds(self, names: Sequence[str]) -> ParameterBounds:
        """Bounds of base and effects."""
        b, max_twist = self.base, self.base.max_twist
        return make_bounds(
            tuple(names),
            np.concatenate([[-np.inf], b.shape_low]),
            np.concatenate([[np.inf], b.shape_high]),
            np.concatenate([[0.01 * max_twist], np.ones(b.n_shape)]),
            np.concatenate([[np.inf], b.shape_prior]),
            np.concatenate([[0.0], b.shape_start]),
        )

    def weights_at(self, found: Fit) -> Weighting:
        """Weights whose scatter is that at the twist and clearance which the contacts feel under a fit's effects.

        A drive with play scatters where its contacts carry, one with preload also where it carries nothing.
        """
        if self.scatter is None or self.is_mean_drive:
            return self.weights
        twist, clearance = found.prediction.contact, found.prediction.clearance
        near, alike = 0.02 * self.base.max_twist, 0.3 * self.scatter.responses.deviation
        for other, play, weights in ((self.scatter.twist, 0.0, self.weights), *self.weights_cache):
            if np.abs(twist - other).max() < near and np.abs(clearance - play).max() < alike:
                return weights.with_size(found.weighting.size)
        weights = weighting(self.variance, *self.scatter.columns_at(twist, clearance))
        self.weights_cache.append((twist, clearance, weights))
        return weights.with_size(found.weighting.size)

    def fit_from(
        self,
        names: Sequence[str],
        start: Array,
        weights: Weighting | None = None,
        steps: int = 25,
        tolerance: float = 1e-3,
        refit_size: bool = True,
    ) -> Fit:
        """Fit a set from one start; refit_size: let the size of the scatter follow."""
        return fit(
            self.predictor(names),
            self.torque,
            self.weights if weights is None else weights,
            self.bounds(names),
            start,
            steps,
            tolerance,
            refit_size,
        )

    def without_weights(self, found: Fit) -> Fit:
        """A fit to send to another process, without the weights that a problem there has as well."""
        own = found.weighting.mean is self.weights.mean and found.weighting.individual is self.weights.individual
        return replace(found, weighting=size_only(found.weighting.size)) if own else found

    def with_weights(self, found: Fit) -> Fit:
        """A fit that was sent by another process."""
        return (
            replace(found, weighting=self.weights.with_size(found.weighting.size))
            if is_size_only(found.weighting)
            else found
        )

    def expected_cost(self, found: Fit) -> float:
        """The cost that noise and scatter alone would leave, in the mean."""
        return self.expected_chi_square(found.weighting) + found.weighting.log_determinant

    def expected_chi_square(self, weights: Weighting) -> float:
        """The chi-square that noise and roughness leave in the mean."""
        return float(self.expected_chi_square_by_block(weights).sum())

    def expected_chi_square_by_block(self, weights: Weighting) -> Array:
        """The same of every block, (n,)."""
        share = weights.noise_ratio
        return share * self.block_variance / self.variance + 1 - share

    def excess_cost(self, found: Fit) -> float:
        """The cost of a fit beyond what noise and scatter explain."""
        return found.cost - self.expected_cost(found)


def search_blocks(trace: Trace) -> Blocks:
    """The blocks on which sets are searched."""
    return make_blocks(trace, max(1, round(len(trace) / SEARCH_BLOCKS)))


def block_variances(noise: Noise, slope: Array, count: Array) -> tuple[Array, Array]:
    """Variances of block means: (that weighs a block among others, that a block has), (N.m)^2, (n,) each."""
    single = noise.variance(slope)
    weighing = single * noise.correlation_time / count
    # Within a block the correlation falls off as that of a first-order autoregression of the same integral.
    rho = (noise.correlation_time - 1) / (noise.correlation_time + 1)
    lags = np.arange(1, int(count.max()) + 1)
    inside = 1 + 2 * ((1 - lags[None, :] / count[:, None]).clip(0) * rho ** lags[None, :]).sum(axis=1)
    return weighing, single * inside / count


# -- what kinds of parameter an effect has ------------------------------------------------------------------------


def amplitudes(effect: Effect) -> list[int]:
    """Indices of the parameters that switch the effect on: at their neutral value it changes nothing."""
    return [
        k
        for k, p in enumerate(effect.parameters)
        if not is_logarithmic(p) and not p.name.startswith("phase") and p.name != "windup"
    ]


def start_variants(effect: Effect, trace: Trace, max_twist: float) -> list[Array]:
    """Parameter vectors of one effect with its sizes neutral and its lengths, times, speeds and phases varied."""
    speeds = np.abs(trace.output_speed)
    moving = speeds[speeds > 0.02 * speeds.max()] if speeds.max() > 0 else np.array([0.05])
    whole = float(trace.time[-1] - trace.time[0])
    longest = max(float(trace.time[b - 1] - trace.time[a]) for a, b in trace.run_ranges)
    variants: list[dict[str, float]] = [{}]
    if any(p.name == "phase" for p in effect.parameters):
        variants = [{"phase": float(phase)} for phase in 2 * np.pi * np.arange(N_PHASES) / N_PHASES - np.pi]
    if any(p.name == "windup" for p in effect.parameters):
        # Where the crank hardly turns against the output, a fit finds its way from either end.
        ends = (0.0, 1.0) if max_twist * abs(trace.ratio) > LARGE_CRANK_TWIST else (0.0,)
        variants = [{**v, "windup": share} for v in variants for share in ends]
    for p in effect.parameters:
        if not is_logarithmic(p):
            continue
        values = {
            "rad": [0.012 * max_twist, 0.08 * max_twist],
            "s": [0.03 * longest, 0.15 * longest],
            "rad/s": np.quantile(moving, [0.1, 0.5, 0.9]).tolist(),
        }.get(p.unit, [p.nominal])
        if may_be_infinite(p):
            values = [0.7 * whole, 10 * whole]
        variants = [{**v, p.name: float(np.clip(x, p.minimum, p.maximum))} for v in variants for x in values]
    return [np.array([v.get(p.name, p.neutral) for p in effect.parameters]) for v in variants]


def select_candidates(missing: Sequence[str], base: BaseCurve) -> tuple[tuple[str, ...], dict[str, str]]:
    """Effects that a record with these columns missing can show, and why the others are left out."""
    lacks = {
        Requirement.TEMPERATURE: "temperature" in missing,
        Requirement.CRANK_ANGLE: "crank_angle" in missing,
        Requirement.DRAWING: base.kind != "drawing",
    }
    left_out = {
        name: need.value
        for need in Requirement
        if lacks[need]
        for name, effect in EFFECTS.items()
        if need in effect.identification.requirements
    }
    return tuple(name for name in EFFECTS if name not in left_out), left_out


def make_weights(variance: Array, scatter: Scatter | None, twist: Array) -> Weighting:
    """Weights of a problem where the contacts feel a twist (n,); without a drawing nothing scatters."""
    if scatter is None:
        return weighting(variance, np.zeros((0, len(variance))))
    return weighting(variance, *scatter.columns_at(twist))
