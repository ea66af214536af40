"""The seats of an individual's elements that its record shows: those under which the scatter is likeliest.

The same ball or lobe returns at other times of the record for each seating, so that the torque of a drive with scatter
fits one of them alone. What effects do is not known yet; most of them are smooth over the twist and its direction, and
such curves may have any size here.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..preprocessing.trace import Blocks, Trace
from ..random_effects.element_motion import at_blocks
from ..random_effects.scatter import Scatter
from ..random_effects.seating import Seating, possible_seatings, shifted
from .weighting import INDIVIDUAL_SIZE, make_weighting

MAX_BLOCKS = 800
"""Blocks that are compared at most, chosen by judgement to bound the time."""
N_POSITIONS = 12
"""Positions of the first element that are compared for one seating. Chosen by judgement: by less than a twelfth of
their distance elements change the scatter little."""
SMOOTH_DEGREE = 7
"""Degree of the polynomials in the twist that effects may make; chosen by judgement."""
SMOOTH_SIZE = 0.1
"""Standard deviation of each polynomial, over full torque; chosen by judgement, far above most effects."""


def with_likeliest_seating(
    scatter: Scatter, trace: Trace, blocks: Blocks, variance: Array, residual: Array, full_torque: float
) -> Scatter:
    """The scatter with the likeliest seating: with even seats where the crank stands, so that only the position of the
    first element shows.

    variance: (n,) (N.m)^2, of the noise; residual: (n,) N.m, torque less the base curve's; full_torque: N.m.
    """
    few = np.arange(0, len(residual), 1 + len(residual) // MAX_BLOCKS)
    smooth = full_torque * _smooth_curves(scatter.twist, np.sign(blocks.mean(trace.twist_rate)))[:, few]
    there = replace(scatter, motion=at_blocks(scatter.motion, few), twist=scatter.twist[few])

    def cost(seating: Seating) -> float:
        columns, rest = replace(there, seating=seating).columns_at(there.twist)
        middle = rest[len(rest) // 2 :][:1]  # other roughnesses favour the same seating, or a neighbouring start
        weights = make_weighting(variance[few], np.concatenate([columns, smooth]), middle)
        return weights.with_likeliest_scatter(residual[few], INDIVIDUAL_SIZE).cost(residual[few])

    # The likelihood is smooth over the first element: every second one shows where the best is.
    found = possible_seatings(scatter.drive)[: 1 if scatter.crank_stands else None]
    best = min(range(0, len(found), 2), key=lambda k: cost(found[k]))
    nearest = min(found[max(best - 1, 0) : best + 2], key=cost)
    return replace(scatter, seating=min(shifted(nearest, scatter.drive, N_POSITIONS), key=cost))


def _smooth_curves(twist: Array, direction: Array) -> Array:
    """(k, n) polynomials in a twist (n,), rad, for both directions (n,) of its motion."""
    powers = SMOOTH_SIZE * np.polynomial.legendre.legvander(twist / np.abs(twist).max(), SMOOTH_DEGREE).T
    return np.concatenate([powers, powers * direction])
