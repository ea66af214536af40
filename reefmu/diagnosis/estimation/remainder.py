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

from ..preprocessing.noise import matching
from .least_squares import Fit
from .problem import Study

CERTAIN = 3.0
"""Standard errors by which cycles must share something."""
STRETCHES = 8
"""Parts of every pair of cycles over which products are averaged; the spread of these means gives the error."""


@dataclass(frozen=True)
class Shared:
    """Mean square, (N.m)^2, that repeated cycles share, and its standard error; pairs: of cycles compared."""

    mean_square: float
    error: float
    pairs: int


def remainder(study: Study, fit: Fit) -> float:
    """Rms, N.m, of what neither the model nor the scatter nor the noise explains."""
    rest = study.torque - fit.prediction.torque
    rest = rest - scattered(study, fit, rest)
    weight = study.blocks.count / study.blocks.count.sum()
    excess = float((weight * (rest**2 - study.block_variance)).sum())
    return float(np.sqrt(max(excess, 0.0)))


def repeated(study: Study, fit: Fit) -> Shared | None:
    """What repeated cycles share beside a fit; None where none repeat."""
    predictor = study.predictor(fit.names)
    predictor.blocks = None
    rest = study.trace.torque - predictor(fit.parameters).torque
    whole = study.torque - fit.prediction.torque
    own = np.repeat(scattered(study, fit, whole), study.blocks.count.astype(int))
    return shared(rest - own, matching(study.trace))


def comes_again(study: Study, fit: Fit) -> bool:
    """Whether repeated cycles share something of what is left beside a fit, or none are repeated."""
    both = repeated(study, fit)
    return both is None or both.mean_square > CERTAIN * both.error


def shared(rest: Array, pairs: list[tuple[NDArray[np.intp], NDArray[np.intp]]]) -> Shared | None:
    """From residuals (n,), N.m, and indices of matching samples in pairs of cycles.

    >>> rng = np.random.default_rng(0)
    >>> wave = np.tile(np.sin(np.arange(200) / 5), 20)
    >>> cycles = [np.arange(200) + 200 * k for k in range(20)]
    >>> found = shared(wave + 3 * rng.standard_normal(4000), list(zip(cycles[::2], cycles[1::2])))
    >>> abs(found.mean_square - 0.5) < 3 * found.error < 1
    True
    """
    means = [
        float(part.mean())
        for first, second in pairs
        for part in np.array_split(rest[first] * rest[second], STRETCHES)
        if len(part)
    ]
    if len(means) < 2 * STRETCHES:
        return None
    return Shared(float(np.mean(means)), float(np.std(means, ddof=1) / np.sqrt(len(means))), len(pairs))


def scattered(study: Study, fit: Fit, rest: Array) -> Array:
    """The likeliest part (n,), N.m, of a residual that is this drive's own scatter."""
    w = fit.weighting
    strength = w.size**2 * w.strength
    along = w.basis.T @ (rest * w.scale)
    return (w.basis @ (along * strength / (1 + strength))) / w.scale
