"""What the effects do along one record: columns of all their variants, in units of the effects' typical sizes.

The columns are linearised about the fit without effects.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from ..calibrated_odds import PRIOR_WIDTH
from ..estimation.least_squares import PRIORS, Fit
from ..estimation.problem import Problem
from ..estimation.score_test import Direction, linearise

SHAPE_STEP = 0.7
"""Change of the logarithm of a time, length or speed that its column stands for. Chosen by judgement: the values from
which the diagnosis starts are about 2 apart, so that no true one is farther than 1 from one of them."""
AMPLITUDE_DEVIATION = math.sqrt(math.pi / 2) * PRIOR_WIDTH
"""Standard deviation, in typical sizes, of the Gaussian prior of an amplitude that has the density at zero of the
diagnosis' Cauchy prior, 1 / (pi `PRIOR_WIDTH`), which hardly falls within the sizes that occur."""
WAVE_DEVIATION = math.sqrt(math.pi * PRIOR_WIDTH)
"""The same of a cosine and of a sine, in typical sizes over sqrt(2): an amplitude a of any phase has the density
1 / (pi^2 `PRIOR_WIDTH` a) in their plane, here at one typical size."""
ACCUMULATING = {"torque_sensor_drift": "torque_sensor_offset", "wear": "backlash"}
"""Effects that accumulate over the whole record, with the effect that an earlier start adds: an offset, a clearance."""


@dataclass(frozen=True)
class Variant:
    """One variant of an effect, linearised in its amplitudes and in the logarithms of its times, lengths and speeds.

    columns: indices of its columns; n_amplitudes: those of the first of them, the others vary a shape parameter by
    `SHAPE_STEP`; one_sided: whether amplitudes cannot be negative; paired: whether the columns are sines and cosines,
    which span all traces of the effect; size: of an amplitude, SI, signed.
    """

    effect: str
    columns: tuple[int, ...]
    n_amplitudes: int
    one_sided: bool
    paired: bool
    size: float

    def prior(self, column: int) -> tuple[float, float]:
        """Mean and standard deviation of the prior of a column, in its unit: of amplitudes those of the diagnosis, of
        changes of shape 0 and 1."""
        if column >= self.n_amplitudes:
            return 0.0, 1.0
        keys = [key for key in PRIORS if key.startswith(self.effect + ".")]
        return PRIORS[keys[0]] if keys else (0.0, WAVE_DEVIATION if self.paired else AMPLITUDE_DEVIATION)

    def is_one_sided(self, column: int) -> bool:
        """Whether the prior of a column is cut at zero; one about another mean hardly reaches zero."""
        return self.one_sided and column < self.n_amplitudes and self.prior(column)[0] == 0


@dataclass(frozen=True)
class Sensitivities:
    """The effects' columns along one record of n blocks, N.m for one typical size.

    variants: of all candidates, linearised; truths: traces of single effects of typical size that are not linearised,
    with random shape parameters, one column each; columns: (n, k) of both; base: (n, b), columns of the base model's
    free parameters, such as the zero of the twist; held: (n, h), of those with a prior, such as the delay of the
    torque, for one standard deviation of it; run: (n,) index of the run of each block, from 0; problem, fit: of the
    diagnosis; sizes: typical sizes, SI, by `effect.parameter`.
    """

    variants: tuple[Variant, ...]
    truths: tuple[Variant, ...]
    columns: Array
    base: Array
    held: Array
    run: NDArray[np.int64]
    problem: Problem
    fit: Fit
    sizes: Mapping[str, float]

    @property
    def candidates(self) -> tuple[str, ...]:
        """Effects that the record's columns allow."""
        return self.problem.candidates

    @property
    def excluded(self) -> Mapping[str, str]:
        """Effects that they do not allow, with the reason."""
        return self.problem.excluded


def sensitivities(
    problem: Problem, fit: Fit, sizes: Mapping[str, float], names: Sequence[str] | None = None, n_truths: int = 4
) -> Sensitivities:
    """The columns of all variants of the candidates, or of those among `names`, and `n_truths` traces of each.

    Traces of effects that accumulate over the record are linear in time or travel: a drift has no settling time.
    """
    chosen = [name for name in problem.candidates if names is None or name in names]
    directions = {name: linearise(problem, name, fit) for name in chosen}
    variants: list[Variant] = []
    truths: list[Variant] = []
    columns: list[Array] = []
    count = 0
    for name, of_effect in directions.items():
        for direction in of_effect:
            scales = _scales(direction, sizes)
            found = [direction.columns * scales, *_shape_columns(problem, fit, direction, float(scales[0]))]
            columns += found
            width = sum(part.shape[1] for part in found)
            inside = tuple(range(count, count + width))
            variants.append(Variant(name, inside, len(scales), direction.one_sided, direction.paired, float(scales[0])))
            count += width
    for name, of_effect in directions.items():
        for draw in range(n_truths):
            parameters, size = draw_parameters(of_effect[-1:] if name in ACCUMULATING else of_effect, sizes, draw)
            if name in ACCUMULATING:
                # The last variant of a drift has the longest settling time.
                columns.append(of_effect[-1].columns * size)
            else:
                trace = problem.predictor((name,))(np.concatenate([fit.parameters, parameters])).torque
                columns.append((trace - fit.prediction.torque)[:, None])
            truths.append(Variant(name, (count,), 1, of_effect[0].one_sided, False, size))
            count += 1
    run = np.cumsum(np.diff(problem.trace.run[problem.blocks.first], prepend=problem.trace.run[0]) != 0)
    of_base, deviation = fit.prediction.sensitivities, fit.bounds.prior_deviation
    free = np.isinf(deviation)
    return Sensitivities(
        tuple(variants),
        tuple(truths),
        np.concatenate(columns, axis=1),
        of_base[:, free],
        of_base[:, ~free] * deviation[~free],
        run.astype(np.int64),
        problem,
        fit,
        sizes,
    )


def linear_in_time(s: Sensitivities) -> Sensitivities:
    """The same without the variants of accumulating effects that settle: the columns of the others along other records
    with the same runs follow from these."""
    last = {v.effect: v for v in s.variants if v.effect in ACCUMULATING}
    return replace(s, variants=tuple(v for v in s.variants if last.get(v.effect, v) is v))


def _scales(direction: Direction, sizes: Mapping[str, float]) -> Array:
    """Typical size of each column; sine and cosine of one amplitude share its variance."""
    effect = find_effect(direction.name)
    scales = [sizes[f"{direction.name}.{effect.parameters[k].name}"] for k in direction.sizes]
    return np.array(scales * 2) / np.sqrt(2) if direction.paired else np.array(scales)


def _shape_columns(problem: Problem, fit: Fit, direction: Direction, size: float) -> list[Array]:
    """(n, 1) N.m each, half the change of the torque between both sides of every time, length and speed of a variant.

    A diagnosis fits them, so that a rival's trace follows a true one between the values of its variants.
    """
    if direction.name in ACCUMULATING:
        return []
    predict = problem.predictor((direction.name,))
    found: list[Array] = []
    for k, p in enumerate(find_effect(direction.name).parameters):
        if p.minimum <= 0 or k in direction.sizes:
            continue
        torques: list[Array] = []
        for factor in (np.exp(SHAPE_STEP), np.exp(-SHAPE_STEP)):
            parameters = direction.start.copy()
            parameters[list(direction.sizes)] = size
            parameters[k] = np.clip(parameters[k] * factor, p.minimum, p.maximum)
            torques.append(predict(np.concatenate([fit.parameters, parameters])).torque)
        found.append(((torques[0] - torques[1]) / 2)[:, None])
    return found


def draw_parameters(variants: Sequence[Direction], sizes: Mapping[str, float], draw: int) -> tuple[Array, float]:
    """Parameters (q,) of an effect of its typical size with random shape parameters, and the signed size.

    draw: number of the draw; amplitudes that may have either sign alternate. Lengths, times and speeds are log-uniform
    between the values at which the variants were linearised, phases uniform. Parameters of one unit have the same
    quantile in all effects: where two effects are one for some motion, their traces then coincide too, as those of fits
    would. Of several amplitudes (orders of the crank) one is drawn.
    """
    name = variants[0].name
    effect, starts = find_effect(name), np.array([d.start for d in variants])
    rng = np.random.default_rng(np.random.SeedSequence(draw))
    quantile = {unit: float(rng.uniform()) for unit in ("rad", "s", "rad/s")}
    phase, windup, order = (float(rng.uniform()) for _ in range(3))
    values = np.zeros(len(effect.parameters))
    amplitudes = variants[0].sizes
    for k, p in enumerate(effect.parameters):
        low, high = float(starts[:, k].min()), float(starts[:, k].max())
        if k in amplitudes:
            continue
        if p.name.startswith("phase"):
            values[k] = np.pi * (2 * phase - 1)
        elif low > 0:
            values[k] = np.exp(np.log(low) + quantile.get(p.unit, 0.5) * (np.log(high) - np.log(low)))
        else:
            values[k] = low + windup * (high - low)
    chosen = amplitudes[int(order * len(amplitudes))]
    p = effect.parameters[chosen]
    sign = 1.0 - 2.0 * (draw % 2) if p.minimum < p.neutral else 1.0
    values[chosen] = np.clip(sign * sizes[f"{name}.{p.name}"], p.minimum, p.maximum)
    return values, float(values[chosen])
