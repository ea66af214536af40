"""The filter that all channels of a record have passed: its likeliest time constant, by how elements pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import costs_by_size
from ..estimation.score_test import is_of_one_element, linearise
from ..estimation.weighting import INDIVIDUAL_SIZE, SCATTER_SIZES, weighting_of_covariance
from ..preprocessing.trace import Blocks, Trace
from ..random_effects.element_motion import element_motion
from ..random_effects.scatter import N_JOBS, Scatter
from ..random_effects.tolerance_scatter import Spread, in_turn

TIME_CONSTANTS = tuple(2e-4 * k for k in range(6))
"""s, that are tried first for the filter of all channels: bandwidths from 160 Hz on. Where elements pass faster, a fast
run hardly shows them. Of records that are sampled every millisecond the likelihood has a maximum about 0.2 ms wide at
the true one, and may have lower ones."""
FEW_STARTS = 2
"""Positions of the first element by which they are compared. With 12, by every second block, the costs of six simulated
individuals differ by up to 100, and the likeliest by at most 0.01 ms but for one from which a ball is missing (0.1)."""
LEAST_TURN = 1.0
"""rad, of the crank, from which a run shows elements that pass; chosen by judgement, the width of a profile."""


def channel_time_constant(
    problem: Problem, scatter: Scatter, without_effects: Fit, spread: Spread, tried: Sequence[float] = TIME_CONSTANTS
) -> float:
    """s, the likeliest time constant of the filter that all channels have passed, beside a fit without effects.

    Where elements pass at several speeds, it shows in the runs that turn, each of which may have friction of its own.
    Where an effect is missing, the covariance of a filter that is not the true one would explain more of it. It is 0
    where a mean drive is likelier than an individual: no single element shows there.
    tried: s, from 0 on, at even steps.
    """
    drive, trace, blocks = scatter.drive, problem.trace, problem.blocks
    run = trace.run[blocks.first]
    speed = blocks.mean(np.abs(trace.crank_speed))
    turns = np.isin(run, [r for r in np.unique(run) if np.ptp(trace.crank[trace.run == r]) > LEAST_TURN]) & (speed > 0)
    if not turns.any() or speed[turns].max() * tried[-1] < 2 * np.pi / drive.elements / 10:
        return 0.0
    of_runs = (run[turns, None] == np.unique(run[turns])).astype(float)
    free = np.concatenate([of_runs, _missing(problem, without_effects)[turns]], axis=1)
    residual = problem.torque[turns] - without_effects.prediction.torque[turns]
    few = replace(scatter, starts=FEW_STARTS)
    turning = _Turning(few, trace, blocks, turns, problem.variance[turns], residual, free, problem.base.full_torque)
    unfiltered = turning.costs(0.0, spread)
    if SCATTER_SIZES[int(np.argmin(unfiltered))] < INDIVIDUAL_SIZE:
        return 0.0

    def least_costs(some: Sequence[float]) -> dict[float, float]:
        shares = [some[k::N_JOBS] for k in range(N_JOBS)]
        found = spread(_least_costs, [(turning, share) for share in shares])
        return {
            t: cost for share, costs in zip(shares, found, strict=True) for t, cost in zip(share, costs, strict=True)
        }

    coarse = {0.0: min(unfiltered)} | least_costs(tried[1:])
    about, half = min(sorted(coarse), key=lambda time_constant: coarse[time_constant]), (tried[1] - tried[0]) / 2
    fine = coarse | least_costs([t for t in (about - half, about + half) if tried[0] < t < tried[-1]])
    times = sorted(fine)
    at = min(range(len(times)), key=lambda k: fine[times[k]])
    if at in (0, len(times) - 1):
        return times[at]
    return _vertex(times[at], half, [fine[t] for t in times[at - 1 : at + 2]])


def _missing(problem: Problem, without_effects: Fit) -> Array:
    """(n, k) N.m, what a fit without effects may lack, to first order: its own parameters, since what is missing has
    moved them, and all candidates but those that belong to single elements, as their scatter does."""
    of_curve = [name for name in problem.candidates if not is_of_one_element(find_effect(name))]
    directions = [direction for name in of_curve for direction in linearise(problem, name, without_effects)]
    columns = [without_effects.prediction.sensitivities, *(direction.columns for direction in directions)]
    return np.concatenate(columns, axis=1)


@dataclass(frozen=True)
class _Turning:
    """The n blocks `turns` of a record in which the crank turns; scatter: of all blocks, for a few starts; variance,
    residual: (n,), of the torque; free: (n, k) columns beside which the residual is explained; full_torque: N.m."""

    scatter: Scatter
    trace: Trace
    blocks: Blocks
    turns: NDArray[np.bool_]
    variance: Array
    residual: Array
    free: Array
    full_torque: float

    def costs(self, time_constant: float, spread: Spread = in_turn) -> list[float]:
        """-2 log likelihood behind a filter, s, for each size of the scatter."""
        motion = element_motion(self.scatter.drive, self.trace, self.blocks, time_constant).of_blocks(self.turns)
        some = replace(self.scatter, motion=motion, twist=self.scatter.twist[self.turns])
        weights = weighting_of_covariance(self.variance, some.covariance_at(some.twist, spread=spread))
        weights = weights.with_unknown_forms(self.full_torque)
        values = np.concatenate([self.residual[:, None], self.free], axis=1)
        return costs_by_size(weights, values, SCATTER_SIZES)


def _least_costs(job: tuple[_Turning, Sequence[float]]) -> list[float]:
    turning, time_constants = job
    return [min(turning.costs(time_constant)) for time_constant in time_constants]


def _vertex(middle: float, step: float, costs: Sequence[float]) -> float:
    """Where a parabola through three costs has its least value, at most a step from the middle."""
    before, least, after = costs
    bend = before - 2 * least + after
    return middle + step * float(np.clip(0.5 * (before - after) / bend, -1, 1)) if bend > 0 else middle
