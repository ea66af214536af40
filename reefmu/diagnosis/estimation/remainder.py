"""What is left beside a fit, free of the noise.

Where a test repeats a cycle, the noise of one repeat knows nothing of the other's: the mean product of their residuals
is the mean square of what both share, whatever the noise's size and correlation. Elsewhere the noise's variance is
taken off, and is itself known to some part only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ..preprocessing.noise import matching_cycles
from .least_squares import Fit
from .problem import Problem

SIGNIFICANT_ERRORS = 3.0
"""Standard errors by which cycles must share something."""
SEGMENTS_PER_CYCLE = 8
"""Parts of every pair of cycles over which products are averaged; the spread of these means gives the error."""


@dataclass(frozen=True)
class CycleCovariance:
    """Mean square, (N.m)^2, that repeated cycles share, and its standard error; pairs: of cycles compared."""

    covariance: float
    standard_error: float
    pairs: int


def remainder(problem: Problem, fit: Fit) -> float:
    """Rms, N.m, of what neither the model nor the scatter nor the noise explains."""
    rest = problem.torque - fit.prediction.torque
    rest = rest - predicted_scatter(problem, fit, rest)
    weight = problem.blocks.count / problem.blocks.count.sum()
    excess = float((weight * (rest**2 - problem.block_variance)).sum())
    return float(np.sqrt(max(excess, 0.0)))


def repeated_residual(problem: Problem, fit: Fit) -> CycleCovariance | None:
    """What repeated cycles share beside a fit; None where none repeat."""
    predictor = problem.predictor(fit.names)
    predictor.blocks = None
    rest = problem.trace.torque - predictor(fit.parameters).torque
    whole = problem.torque - fit.prediction.torque
    own = np.repeat(predicted_scatter(problem, fit, whole), problem.blocks.count.astype(int))
    return cycle_covariance(rest - own, matching_cycles(problem.trace))


def is_repeatable(problem: Problem, fit: Fit) -> bool:
    """Whether repeated cycles share something of what is left beside a fit, or none are repeated."""
    both = repeated_residual(problem, fit)
    return both is None or both.covariance > SIGNIFICANT_ERRORS * both.standard_error


def cycle_covariance(rest: Array, pairs: list[tuple[NDArray[np.intp], NDArray[np.intp]]]) -> CycleCovariance | None:
    """From residuals (n,), N.m, and indices of matching samples in pairs of cycles.

    >>> rng = np.random.default_rng(0)
    >>> wave = np.tile(np.sin(np.arange(200) / 5), 20)
    >>> cycles = [np.arange(200) + 200 * k for k in range(20)]
    >>> found = cycle_covariance(wave + 3 * rng.standard_normal(4000), list(zip(cycles[::2], cycles[1::2])))
    >>> abs(found.covariance - 0.5) < 3 * found.standard_error < 1
    True
    """
    means = [
        float(part.mean())
        for first, second in pairs
        for part in np.array_split(rest[first] * rest[second], SEGMENTS_PER_CYCLE)
        if len(part)
    ]
    if len(means) < 2 * SEGMENTS_PER_CYCLE:
        return None
    return CycleCovariance(float(np.mean(means)), float(np.std(means, ddof=1) / np.sqrt(len(means))), len(pairs))


def predicted_scatter(problem: Problem, fit: Fit, rest: Array) -> Array:
    """The likeliest part (n,), N.m, of a residual that is this drive's own scatter."""
    w = fit.weighting
    strength = w.size**2 * w.strength
    along = w.basis.T @ (rest * w.scale)
    return (w.basis @ (along * strength / (1 + strength))) / w.scale
