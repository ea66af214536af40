"""Trajectories of states with linear equations dx/ds = a x + b, integrated exactly for constant a and b in a step.

All samples together are one bidiagonal system of equations.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from stiffness_model.numerics.arrays import Array

from .effect_functions import Tangent


def increments(path: Array, begin: NDArray[np.bool_]) -> Array:
    """Changes (n,) of a path (n,) since the sample before, zero where `begin` (n,)."""
    change = np.diff(path, prepend=path[0])
    change[begin] = 0.0
    return change


def exponentials(z: Array) -> tuple[Array, Array, Array]:
    """exp(z), its mean (exp(z) - 1)/z over a step, and the derivative of that mean by z, (n,) each; z: (n,)."""
    small = np.abs(z) < 1e-4
    safe = np.where(small, 1.0, z)
    change = np.expm1(z)
    mean = np.where(small, 1 + z / 2 + z * z / 6, change / safe)
    slope = np.where(small, 0.5 + z / 3, (1 + change - mean) / safe)
    return 1 + change, mean, slope


def recurrence(
    decay: Array, gains: Sequence[Array], begin: NDArray[np.bool_], initial: float | Array = 0.0
) -> list[Array]:
    """Solutions (n,) of x[k] = decay[k] x[k-1] + gain[k] for several gains (n,); `initial`, () or (runs, 1), where
    `begin` (n,)."""
    n = len(begin)
    right = np.zeros((n, len(gains)), order="F")
    for k, gain in enumerate(gains):
        right[:, k] = gain
    right[begin] = initial
    band = np.ones((2, n), order="F")
    band[1, :-1] = np.where(begin, 0.0, -decay)[1:]
    x, info = lapack.dtbtrs(  # type: ignore[attr-defined]
        band, right, uplo="L", diag="U", overwrite_b=True
    )
    assert info == 0
    return [np.ascontiguousarray(x[:, k]) for k in range(len(gains))]


def propagate_tangent(decay: Array, tangent: Tangent, begin: NDArray[np.bool_]) -> Tangent:
    """Tangent of a state's trajectory from the tangent of its gains; decay: (n,)."""
    if not tangent:
        return {}
    return dict(zip(tangent, recurrence(decay, list(tangent.values()), begin), strict=True))
