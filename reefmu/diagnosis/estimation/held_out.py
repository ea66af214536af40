"""Cross-validation: fits without a part of the record, and what that part says of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .least_squares import HELD_SIZE, Fit, fit
from .problem import Problem, make_weights

HELD_OUT_PERIOD = 3
"""Every third run is held out, of one or two runs the last third of the record. Chosen by judgement: two thirds still
determine the parameters."""
NO_WEIGHT = 1e12
"""Factor on the variance of blocks that are held out: large enough to leave them without influence."""
REFUTING_RATIO = 1.2
"""Rms residual of the held-out blocks with the named effects, over that without, from which they refute the names.
Chosen by judgement: wrong names do more harm than noise does."""
MIN_FITTED_SHARE = 0.3
"""Share of the whole gain that the blocks which are not held out must show by themselves for the others to refute the
names. Chosen by judgement: with less, the parameters were hardly determined."""


def held_out_blocks(problem: Problem) -> NDArray[np.bool_]:
    """(n,), whether a block is held out."""
    runs = problem.trace.run[problem.blocks.first]
    numbers = np.unique(runs)
    if len(numbers) >= HELD_OUT_PERIOD:
        return np.isin(runs, numbers[1::HELD_OUT_PERIOD])
    return np.arange(len(runs)) >= len(runs) * 2 // HELD_OUT_PERIOD


def fits_without_held_out(problem: Problem, fits: Sequence[Fit]) -> list[Fit]:
    """The same sets fitted without the held-out blocks, from the parameters of the fits."""
    variance = np.where(held_out_blocks(problem), NO_WEIGHT * problem.variance, problem.variance)
    twist = variance if problem.scatter is None else problem.scatter.twist
    weights = make_weights(variance, problem.scatter, twist)
    return [
        fit(
            problem.predictor(f.names),
            problem.torque,
            weights.like(f.weighting),
            f.bounds,
            f.parameters,
            HELD_SIZE,
        )
        for f in fits
    ]


def held_out_ratio(problem: Problem, smaller: Fit, larger: Fit) -> float:
    """Rms residual of the held-out blocks that the larger of two sets leaves, over that of the smaller."""
    held = held_out_blocks(problem)
    before, after = (
        float(np.mean((problem.torque - f.prediction.torque)[held] ** 2))
        for f in fits_without_held_out(problem, (smaller, larger))
    )
    return float(np.sqrt(after / max(before, 1e-300)))


def is_refuted(problem: Problem, base: Fit, chosen: Fit, held: Sequence[Fit]) -> bool:
    """Whether the held-out blocks refute the named effects: the other blocks show them, and there they do harm.

    held: `fits_without_held_out` of base and chosen. Gains are differences of -2 log likelihood in both places, so that
    what scatter explains as well as the effects counts in neither.
    """
    out = held_out_blocks(problem)
    before, after = (float(np.mean((problem.torque - f.prediction.torque)[out] ** 2)) for f in held)
    is_shown = held[0].cost - held[1].cost > MIN_FITTED_SHARE * (base.cost - chosen.cost)
    return is_shown and after > REFUTING_RATIO**2 * before
