"""Fits without a regime of the record, and what that regime says of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from .least_squares import Fit, fit
from .problem import Problem, make_weights

REFUTING_RATIO = 1.2
"""What is left of runs that were not fitted, over that before, rms, from which they speak against the names."""
MIN_FITTED_SHARE = 0.3
"""Share of what the names gain that the fitted runs alone must show."""
HELD_OUT_PERIOD = 3
"""Every third run is held out; of a single run the last third."""


def held_out_blocks(problem: Problem) -> NDArray[np.bool_]:
    """Blocks (n,) that a second fit leaves out."""
    runs = problem.trace.run[problem.blocks.first]
    numbers = np.unique(runs)
    if len(numbers) >= HELD_OUT_PERIOD:
        return np.isin(runs, numbers[1::HELD_OUT_PERIOD])
    return np.arange(len(runs)) >= len(runs) * 2 // HELD_OUT_PERIOD


def fits_without_held_out(problem: Problem, fits: Sequence[Fit]) -> list[Fit]:
    """The same sets fitted without the blocks held out."""
    variance = np.where(held_out_blocks(problem), 1e12 * problem.variance, problem.variance)
    twist = variance if problem.scatter is None else problem.scatter.twist
    weights = make_weights(variance, problem.scatter, twist)
    return [
        fit(
            problem.predictor(f.names),
            problem.torque,
            weights.with_size(f.weighting.size),
            f.bounds,
            f.parameters,
            refit_size=False,
        )
        for f in fits
    ]


def held_out_ratio(problem: Problem, smaller: Fit, larger: Fit) -> float:
    """What the larger of two sets leaves of the blocks held out, over what the smaller leaves, rms."""
    held = held_out_blocks(problem)
    before, after = (
        float(np.mean((problem.torque - f.prediction.torque)[held] ** 2))
        for f in fits_without_held_out(problem, (smaller, larger))
    )
    return float(np.sqrt(after / max(before, 1e-300)))


def is_refuted(problem: Problem, base: Fit, chosen: Fit, held: Sequence[Fit]) -> bool:
    """Whether runs that were not fitted speak against the names: the others show them well, and there they do harm.

    held: `fits_without_held_out` of base and chosen.
    """
    rests = [(problem.torque - f.prediction.torque) ** 2 for f in held]
    out = held_out_blocks(problem)
    before, after = (float(np.mean(rest[out])) for rest in rests)
    without, with_names = (float(np.sum((rest / problem.variance)[~out])) for rest in rests)
    shown = without - with_names > MIN_FITTED_SHARE * (base.chi_square - chosen.chi_square)
    return shown and after > REFUTING_RATIO**2 * before
