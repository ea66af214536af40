"""The seats of an individual's elements that its record shows: those under which the scatter is likeliest.

The same ball or lobe returns at other times of the record for each seating, so that the torque of a drive with scatter
fits one of them alone. Seats are told by what a fit leaves: a zero of the twist that is only guessed, or an effect that
is not in the fit, can make other seats likelier by hundreds in -2 log likelihood.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from stiffness_model.numerics.arrays import Array

from ..random_effects.element_motion import at_blocks
from ..random_effects.scatter import Scatter
from ..random_effects.seating import Seating, possible_seatings, shifted
from .least_squares import Fit
from .problem import Problem

MAX_BLOCKS = 800
"""Blocks that are compared at most, chosen by judgement to bound the time."""
N_POSITIONS, N_HALVINGS = 12, 3
"""Positions of the first element that are compared for one seating, and how often their distance is then halved about
the likeliest, with all blocks. Chosen by judgement: the last distance, a hundredth of that of the elements, changes the
-2 log likelihood by some tens on records with little noise, the first by hundreds."""
SIZES = (0.5, 1.0, 2.0)
"""Sizes of the scatter under which seatings are compared; chosen by judgement, about that of the population."""
SMOOTH_DEGREE = 7
"""Degree of the polynomials in the twist that effects may make; chosen by judgement."""
SMOOTH_SIZE = 0.1
"""Standard deviation of each polynomial, over full torque; chosen by judgement, far above most effects."""


def with_likeliest_seating(problem: Problem, scatter: Scatter, found: Fit) -> Scatter:
    """The scatter with the seating that makes the residual of a fit likeliest; even seats where the crank stands, so
    that only the position of the first element shows.

    Effects that are not in the fit may make any smooth curve over the twist and its direction.
    """
    residual, variance = problem.torque - found.prediction.torque, problem.variance
    twist, clearance = found.prediction.contact, np.broadcast_to(found.prediction.clearance, residual.shape)
    direction = np.sign(problem.blocks.mean(problem.trace.twist_rate))
    smooth = problem.base.full_torque * _smooth_curves(twist, direction)

    def cost(seating: Seating, some: NDArray[np.intp]) -> float:
        there = replace(scatter, motion=at_blocks(scatter.motion, some), twist=scatter.twist[some], seating=seating)
        columns, rest = there.columns_at(twist[some], clearance[some])
        # Other roughnesses favour the same seating, or a neighbouring start.
        scale = 1 / np.sqrt(variance[some] + rest[len(rest) // 2])
        rows = np.concatenate([columns, smooth[:, some]]) * scale
        return least_cost(rows, residual[some] * scale) - 2 * float(np.log(scale).sum())

    every = np.arange(len(residual))
    few = every[:: 1 + len(every) // MAX_BLOCKS]
    # The likelihood is smooth over the first element: every second one shows where the best is.
    seatings = possible_seatings(scatter.drive)[: 1 if scatter.crank_stands else None]
    middle = min(range(0, len(seatings), 2), key=lambda k: cost(seatings[k], few))
    nearest = min(seatings[max(middle - 1, 0) : middle + 2], key=lambda seating: cost(seating, few))
    positions = shifted(nearest, scatter.drive, N_POSITIONS)
    best, step = min(positions, key=lambda seating: cost(seating, few)), positions[1].start - positions[0].start
    least = cost(best, every)
    for _ in range(N_HALVINGS):
        for start in (best.start - step, best.start + step):
            if (there := cost(moved := replace(best, start=start), every)) < least:
                best, least = moved, there
        step /= 2
    return replace(scatter, seating=best)


def least_cost(rows: Array, residual: Array) -> float:
    """-2 log likelihood of a whitened residual (n,) beside random effects (m, n), under the likeliest of `SIZES`."""
    # The smaller of two matrices is factored: the identity and the inner products of the effects, or of the blocks.
    by_effects = len(rows) < len(residual)
    inner, along = (rows @ rows.T, rows @ residual) if by_effects else (rows.T @ rows, residual)
    costs: list[float] = []
    for size in SIZES:
        factor = cho_factor(np.eye(len(inner)) + size**2 * inner)
        form = float(along @ cho_solve(factor, along))
        explained = size**2 * form if by_effects else float(residual @ residual) - form
        costs.append(2 * float(np.log(np.diag(factor[0])).sum()) - explained)
    return float(residual @ residual) + min(costs)


def _smooth_curves(twist: Array, direction: Array) -> Array:
    """(k, n) polynomials in a twist (n,), rad, for both directions (n,) of its motion."""
    powers = SMOOTH_SIZE * np.polynomial.legendre.legvander(twist / np.abs(twist).max(), SMOOTH_DEGREE).T
    return np.concatenate([powers, powers * direction])
