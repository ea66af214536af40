"""Cross-validation: fits without a part of the record, and what that part says of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .least_squares import HELD_SIZE, Fit, fit
from .problem import Problem
from .weighting import Weighting

HELD_OUT_PERIOD = 3
"""Every third run is held out, of one or two runs the last third of the record. Chosen by judgement: two thirds still
determine the parameters."""
NO_WEIGHT = 1e12
"""Factor on the variance of blocks that are held out: large enough to leave them without influence."""


def held_out_blocks(problem: Problem) -> NDArray[np.bool_]:
    """(n,), whether a block is held out."""
    runs = problem.trace.run[problem.blocks.first]
    numbers = np.unique(runs)
    if len(numbers) >= HELD_OUT_PERIOD:
        return np.isin(runs, numbers[1::HELD_OUT_PERIOD])
    return np.arange(len(runs)) >= len(runs) * 2 // HELD_OUT_PERIOD


def fits_without_held_out(problem: Problem, fits: Sequence[Fit]) -> list[Fit]:
    """The same sets fitted without the held-out blocks, from the parameters of the fits."""
    out = held_out_blocks(problem)
    return [
        fit(
            problem.predictor(f.names),
            problem.torque,
            weights_without(problem, out, f.weighting),
            f.bounds,
            f.parameters,
            HELD_SIZE,
        )
        for f in fits
    ]


def weights_without(problem: Problem, left_out: NDArray[np.bool_], like: Weighting) -> Weighting:
    """Weights without some blocks (n,), with the size of others."""
    variance = np.where(left_out, NO_WEIGHT * problem.variance, problem.variance)
    return problem.weights.with_variance(variance).with_size(like.size)
