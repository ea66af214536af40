"""The filter that all channels of a record have passed: its likeliest time constant, by how elements pass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ..estimation.problem import Problem
from ..estimation.weighting import INDIVIDUAL_SIZE, SCATTER_SIZES, Weighting, weighting_of_covariance
from ..preprocessing.trace import Blocks, Trace
from ..random_effects.element_motion import element_motion
from ..random_effects.scatter import N_JOBS, Scatter
from ..random_effects.tolerance_scatter import Spread, in_turn

TIME_CONSTANTS = tuple(1e-4 * k for k in range(11))
"""s, that are tried for the filter of all channels: bandwidths from 160 Hz on. Where elements pass faster, a fast run
hardly shows them. The likelihood has several maxima, of which one is 0.1 ms wide."""
FEW_STARTS = 2
"""Positions of the first element by which they are compared; with 12 the costs of two simulated individuals differ by
up to 100, where that of the likeliest is 350 to 960 below the unfiltered one, and the likeliest is the same."""
EVERY = 2
"""One of so many blocks in which the crank turns, by which they are compared. Chosen among 1, 2, 3 and 4: of 20
individuals with a filter that shows, it moves the likeliest time constant by less than 0.05 ms in 16 and by 0.1 to 0.5
ms in the others, where it is hardly known; 3 moves it by less than 0.05 ms in 11."""
LEAST_TURN = 1.0
"""rad, of the crank, from which a run shows elements that pass; chosen by judgement, the width of a profile."""


def channel_time_constant(
    problem: Problem, scatter: Scatter, residual: Array, spread: Spread, tried: Sequence[float] = TIME_CONSTANTS
) -> float:
    """s, the likeliest time constant of the filter that all channels have passed, beside a residual (n,), N.m.

    Where elements pass at several speeds, it shows in the runs that turn, each of which may have friction of its own,
    and all damping. It is 0 where a mean drive is likelier than an individual: no single element shows there.
    tried: s, from 0 on, at even steps.
    """
    drive, trace, blocks = scatter.drive, problem.trace, problem.blocks
    run = trace.run[blocks.first]
    turns = np.isin(run, [r for r in np.unique(run) if np.ptp(trace.crank[trace.run == r]) > LEAST_TURN])
    turns[np.flatnonzero(turns)[1::EVERY]] = False
    speed = blocks.mean(np.abs(trace.crank_speed))[turns]
    if not turns.any() or speed.max() * tried[-1] < 2 * np.pi / drive.elements / 10:
        return 0.0
    of_runs = (run[turns, None] == np.unique(run[turns])).astype(float)
    free = np.concatenate([of_runs, blocks.mean(trace.twist_rate)[turns, None]], axis=1)
    few = replace(scatter, starts=FEW_STARTS)
    turning = _Turning(
        few, trace, blocks, turns, problem.variance[turns], residual[turns], free, problem.base.full_torque
    )
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
    likeliest = min(sorted(coarse), key=lambda time_constant: coarse[time_constant])
    if likeliest in (tried[0], tried[-1]):
        return likeliest
    half = (tried[1] - tried[0]) / 2
    before, after = least_costs([likeliest - half, likeliest + half]).values()
    return _vertex(likeliest, half, [before, coarse[likeliest], after])


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
        return [_cost_beside(weights.with_size(size), self.residual, self.free) for size in SCATTER_SIZES]


def _least_costs(job: tuple[_Turning, Sequence[float]]) -> list[float]:
    turning, time_constants = job
    return [min(turning.costs(time_constant)) for time_constant in time_constants]


def _vertex(middle: float, step: float, costs: Sequence[float]) -> float:
    """Where a parabola through three costs has its least value, at most a step from the middle."""
    before, least, after = costs
    bend = before - 2 * least + after
    return middle + step * float(np.clip(0.5 * (before - after) / bend, -1, 1)) if bend > 0 else middle


def _cost_beside(weights: Weighting, residual: Array, columns: Array) -> float:
    """-2 log likelihood of a residual (n,), N.m, beside free columns (n, k)."""
    white = weights.whiten(columns)
    amplitudes = np.linalg.lstsq(white, weights.whiten(residual), rcond=None)[0]
    return weights.cost(residual - columns @ amplitudes)
