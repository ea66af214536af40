"""Functions of what a record varies: speeds over several decades, waves over an angle, smooth curves."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import BSpline

from stiffness_model.numerics.arrays import Array


def speed_functions(speed: Array) -> Array:
    """Functions (n, 3) of a speed (n,) over several decades, odd and even."""
    slow = max(float(np.quantile(np.abs(speed), 0.5)), 1e-12)
    compressed = np.arcsinh(speed / slow)
    compressed = compressed / max(float(np.abs(compressed).max()), 1e-12)
    return np.stack([compressed, np.abs(compressed), compressed**3], axis=1)


def wave(phase: Array) -> Array:
    """Cosine and sine (n, 2) of a phase (n,)."""
    return np.stack([np.cos(phase), np.sin(phase)], axis=1)


def over_range(x: Array) -> Array:
    """Values (n,) from -1 to 1, in proportion to where they are in their range; zero where they do not vary.

    >>> over_range(np.array([3.0, 4.0, 5.0])).tolist(), over_range(np.ones(2)).tolist()
    ([-1.0, 0.0, 1.0], [0.0, 0.0])
    """
    span = float(np.ptp(x))
    return 2 * (x - x.min()) / span - 1 if span > 0 else np.zeros_like(x)


def splines(x: Array, knots: Array) -> Array:
    """Cubic B-splines (n, k) over [-1, 1]."""
    padded = np.concatenate([[-1] * 3, knots, [1] * 3])
    return BSpline.design_matrix(np.clip(x, -1, 1), padded, 3).toarray()
