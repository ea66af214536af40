"""The seats of an individual's elements that its record shows: those under which the scatter is likeliest.

The same ball or lobe returns at other times of the record for each seating, so that the torque of a drive with scatter
fits one of them alone. Seats are told by what a fit leaves: a zero of the twist that is only guessed, or an effect that
is not in the fit, can make other seats likelier by hundreds in -2 log likelihood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

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


def with_likeliest_seating(problem: Problem, scatter: Scatter, fits: Sequence[Fit]) -> tuple[Scatter, Fit]:
    """The scatter with the seating that makes the residual of one of some fits likeliest, and that fit; even seats
    where the crank stands, so that only the position of the first element shows.

    Effects that are not in the fit may make any smooth curve over the twist and its direction.
    """
    seatings = possible_seatings(scatter.drive)[: 1 if scatter.crank_stands else None]
    tried = [(*_among(seatings, one := _Beside(problem, scatter, fit)), one) for fit in fits]
    _, best, one = min(tried, key=lambda item: item[0])
    first, second = shifted(best, scatter.drive, N_POSITIONS)[:2]
    step, least = second.start - first.start, one.cost(best, one.every)
    for _ in range(N_HALVINGS):
        for start in (best.start - step, best.start + step):
            if (there := one.cost(moved := replace(best, start=start), one.every)) < least:
                best, least = moved, there
        step /= 2
    return replace(scatter, seating=best), one.found


def _among(seatings: Sequence[Seating], one: _Beside) -> tuple[float, Seating]:
    """The least cost and the likeliest of some seatings beside a fit, to a position of the first element."""
    # The likelihood is smooth over the first element: every second one shows where the best is.
    middle = min(range(0, len(seatings), 2), key=lambda k: one.cost(seatings[k], one.few))
    nearest = min(seatings[max(middle - 1, 0) : middle + 2], key=lambda seating: one.cost(seating, one.few))
    positions = shifted(nearest, one.scatter.drive, N_POSITIONS)
    costs = [one.cost(seating, one.few) for seating in positions]
    return min(costs), positions[int(np.argmin(costs))]


@dataclass(frozen=True)
class _Beside:
    """How likely a seating is beside a fit of the n blocks of a problem."""

    problem: Problem
    scatter: Scatter
    found: Fit

    @cached_property
    def every(self) -> NDArray[np.intp]:
        """(n,), numbers of all blocks."""
        return np.arange(len(self.problem.torque))

    @property
    def few(self) -> NDArray[np.intp]:
        """Numbers of at most `MAX_BLOCKS` blocks."""
        return self.every[:: 1 + len(self.every) // MAX_BLOCKS]

    @cached_property
    def beside(self) -> Array:
        """(samples,) rad, twist of the contacts less that of the sensors."""
        return self.problem.predictor(self.found.names).twist_beside_sensors(self.found.parameters)

    @cached_property
    def smooth(self) -> Array:
        """(k, n) N.m, curves that effects may make which are not in the fit."""
        direction = np.sign(self.problem.blocks.mean(self.problem.trace.twist_rate))
        return self.problem.base.full_torque * _smooth_curves(self.found.prediction.contact, direction)

    def cost(self, seating: Seating, some: NDArray[np.intp]) -> float:
        """-2 log likelihood of what the fit leaves of the torque in some blocks."""
        scatter, prediction = self.scatter, self.found.prediction
        motion, twist = at_blocks(scatter.motion, some), scatter.twist[some]
        there = replace(scatter, motion=motion, twist=twist, seating=seating)
        clearance = np.broadcast_to(prediction.clearance, self.every.shape)
        columns, rest = there.columns_at(prediction.contact[some], clearance[some], self.beside)
        # Other roughnesses favour the same seating, or a neighbouring start.
        scale = 1 / np.sqrt(self.problem.variance[some] + rest[len(rest) // 2])
        rows = np.concatenate([columns, self.smooth[:, some]]) * scale
        residual = (self.problem.torque - prediction.torque)[some]
        return least_cost(rows, residual * scale) - 2 * float(np.log(scale).sum())


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
