"""Uniform cubic B-splines in one and two dimensions, with linear continuation.

On a uniform grid every cell has the same four weights, polynomials in the cell's coordinate f: the same few
lines serve NumPy arrays here and symbolic expressions in `reefmu`. The ends are natural (no curvature); beyond
the grid the weights continue in a straight line, so the spline does.
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
    """A uniform axis: `cells` cells of width `step` from `start`; the grid has cells + 1 nodes."""

    start: float
    step: float
    cells: int

    @property
    def nodes(self) -> Array:
        """The grid's nodes, (cells + 1,)."""
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
    """Weights of the four coefficients of a cell at its coordinate f; they sum to 1.

    clipped: f held to 0 ... 1; beyond, the weights continue in a straight line. Works on NumPy arrays and on
    symbolic expressions. Inside, f - clipped is exactly zero and changes nothing.

    >>> [round(w, 4) for w in weights(0.0, 0.0)]
    [0.1667, 0.6667, 0.1667, 0.0]
    """
    c, beyond = clipped, f - clipped
    g = 1 - c
    inside = (g * g * g / 6, (4 - 6 * c * c + 3 * c * c * c) / 6, (4 - 6 * g * g + 3 * g * g * g) / 6, c * c * c / 6)
    w0, w1, w2, w3 = (w + beyond * s for w, s in zip(inside, slope_weights(c), strict=True))
    return w0, w1, w2, w3


def slope_weights(clipped: Any) -> tuple[Any, Any, Any, Any]:
    """Derivatives of `weights` by f; they sum to 0."""
    c = clipped
    g = 1 - c
    return -g * g / 2, (-4 * c + 3 * c * c) / 2, (4 * g - 3 * g * g) / 2, c * c / 2


def fit(axis: Axis, values: ArrayLike, along: int) -> Array:
    """Coefficients, size axis.size along the dimension `along`, of the natural spline through `values`."""
    knots = axis.start + axis.step * np.arange(-3, axis.cells + 4)
    spline = make_interp_spline(
        axis.nodes, np.moveaxis(np.asarray(values, float), along, 0), k=3, t=knots, bc_type="natural"
    )
    return np.moveaxis(spline.c, 0, along)


def locate(axis: Axis, x: Array) -> tuple[NDArray[np.intp], Array]:
    """First coefficient's index and cell coordinate f of every x; beyond the grid the outermost cell's."""
    u = (x - axis.start) / axis.step
    cell = np.clip(np.floor(u), 0, axis.cells - 1)
    return cell.astype(np.intp), u - cell


def evaluate(axes: tuple[Axis, Axis], coefficients: Array, x: ArrayLike, y: ArrayLike, slope: bool = False) -> Array:
    """Values (or slopes along x) of two-dimensional splines at points (x, y), which broadcast.

    Along x the spline goes on in a straight line beyond the grid, along y it holds its last value.
    coefficients: (..., axes[0].size, axes[1].size). Returns shape (..., *points).
    """
    px, py = np.broadcast_arrays(np.asarray(x, float), np.asarray(y, float))
    i, f = locate(axes[0], px)
    j, g = locate(axes[1], py)
    inside = np.clip(f, 0.0, 1.0)
    along_x = [w / axes[0].step for w in slope_weights(inside)] if slope else weights(f, inside)
    held = np.clip(g, 0.0, 1.0)
    along_y = weights(held, held)
    rows = [sum(along_y[b] * coefficients[..., i + a, j + b] for b in range(4)) for a in range(4)]
    return np.asarray(sum(along_x[a] * rows[a] for a in range(4)))
