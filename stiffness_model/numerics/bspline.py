"""Uniform cubic B-splines in one and two dimensions, extrapolated linearly.

On a uniform grid every cell has the same four basis polynomials in the cell's coordinate f, so that the same
functions serve NumPy arrays here and symbolic expressions in `reefmu`. The spline is natural (its second derivative is
zero at the ends); beyond the grid the basis functions, and with them the spline, continue in a straight line.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import make_interp_spline

from .arrays import Array


@dataclass(frozen=True)
class Axis:
    """A uniform axis: `cells` cells of width `step`, from `start`; it has cells + 1 nodes."""

    start: float
    step: float
    cells: int

    @property
    def nodes(self) -> Array:
        """The nodes, (cells + 1,)."""
        return self.start + self.step * np.arange(self.cells + 1, dtype=float)

    @property
    def stop(self) -> float:
        """The last node."""
        return self.start + self.step * self.cells

    @property
    def size(self) -> int:
        """Number of coefficients along this axis."""
        return self.cells + 3


def weights(f: Any, clipped: Any) -> tuple[Any, Any, Any, Any]:
    """Weights of a cell's four coefficients, its basis functions, at the coordinate f; they sum to 1.

    clipped: f clipped to 0 ... 1; beyond, the weights continue in a straight line. Takes NumPy arrays and symbolic
    expressions. Within the cell f - clipped is exactly zero and has no effect on the result.

    >>> [round(w, 4) for w in weights(0.0, 0.0)]
    [0.1667, 0.6667, 0.1667, 0.0]
    """
    c, outside = clipped, f - clipped
    g = 1 - c
    inside = (g * g * g / 6, (4 - 6 * c * c + 3 * c * c * c) / 6, (4 - 6 * g * g + 3 * g * g * g) / 6, c * c * c / 6)
    w0, w1, w2, w3 = (w + outside * s for w, s in zip(inside, slope_weights(c), strict=True))
    return w0, w1, w2, w3


def slope_weights(clipped: Any) -> tuple[Any, Any, Any, Any]:
    """Derivatives of `weights` with respect to f; they sum to 0."""
    c = clipped
    g = 1 - c
    return -g * g / 2, (-4 * c + 3 * c * c) / 2, (4 * g - 3 * g * g) / 2, c * c / 2


def fit(axis: Axis, values: ArrayLike, along: int) -> Array:
    """Coefficients of the natural spline through `values` at the nodes along the dimension `along`.

    The result has axis.size entries along that dimension.
    """
    knots = axis.start + axis.step * np.arange(-3, axis.cells + 4)
    spline = make_interp_spline(
        axis.nodes, np.moveaxis(np.asarray(values, float), along, 0), k=3, t=knots, bc_type="natural"
    )
    return np.moveaxis(spline.c, 0, along)


def locate(axis: Axis, x: Array) -> tuple[NDArray[np.intp], Array]:
    """Index of the first coefficient and coordinate f in the cell of every x; the outermost cell beyond the grid."""
    u = (x - axis.start) / axis.step
    cell = np.clip(np.floor(u), 0, axis.cells - 1)
    return cell.astype(np.intp), u - cell


def evaluate(axes: tuple[Axis, Axis], coefficients: Array, x: ArrayLike, y: ArrayLike, slope: bool = False) -> Array:
    """Values of two-dimensional splines, or their slopes along x, at points (x, y), which broadcast.

    Beyond the grid the spline continues in a straight line along x and with its last value along y.
    coefficients: (..., axes[0].size, axes[1].size). Returns shape (..., *points).
    """
    px, py = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    i, f = locate(axes[0], px)
    j, g = locate(axes[1], py)
    inside = np.clip(f, 0.0, 1.0)
    along_x = [w / axes[0].step for w in slope_weights(inside)] if slope else weights(f, inside)
    clipped = np.clip(g, 0.0, 1.0)
    along_y = weights(clipped, clipped)
    rows = [sum(along_y[b] * coefficients[..., i + a, j + b] for b in range(4)) for a in range(4)]
    return np.asarray(sum(along_x[a] * rows[a] for a in range(4)))
