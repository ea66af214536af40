"""A torque that is linear between the points of a table: exact, or with rounded corners, so that it has a derivative.

A data sheet states a twist-torque curve as straight lines. An interpolating spline bends them (for a strain wave gear
by 5 % between two corners), and what has corners has no derivative there. So the lines themselves are kept, and a
rounded form replaces each corner, within a short range to either side, by the parabola that continues both lines with
their slopes. The distance from the lines is greatest at the corner itself: a quarter of the range times the change of
slope.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from .arrays import Array, ArrayValue

ROUNDING = 1e-4
"""Range of the rounding to either side of a corner, over the distance to the next one. Chosen by judgement: it changes
the torque by at most 2.5e-5 of the change of slope times that distance, far less than the digits of a data sheet."""


@dataclass(frozen=True, eq=False)
class QuadraticSpline(ArrayValue):
    """A quadratic spline with a continuous slope, straight beyond its ends.

    knots: (n,), increasing, the first and the last three times, as B-splines need them; coefficients: (n - 3,).
    """

    knots: Array
    coefficients: Array

    @cached_property
    def _pieces(self) -> tuple[Array, Array, Array, Array]:
        """Start of each piece, with value, slope and half of the curvature there, (m,) each."""
        from scipy.interpolate import BSpline

        spline = BSpline(self.knots, self.coefficients, 2)
        starts = self.knots[2:-2]
        slope, curvature = spline.derivative(1), spline.derivative(2)
        half = curvature((starts[:-1] + starts[1:]) / 2) / 2
        return starts, spline(starts), slope(starts), np.append(half, 0.0)

    def evaluate(self, x: ArrayLike) -> tuple[Array, Array]:
        """Value and slope at x, of the shape of x (any)."""
        at = np.asarray(x, float)
        starts, value, slope, half = self._pieces
        piece = np.clip(np.searchsorted(starts, at, side="right") - 1, 0, len(starts) - 1)
        step = at - starts[piece]
        # The first piece is straight, and so is what continues it below.
        return (half[piece] * step + slope[piece]) * step + value[piece], 2 * half[piece] * step + slope[piece]


@dataclass(frozen=True, eq=False)
class PiecewiseLine(ArrayValue):
    """Torque (n,), N.m, over twist (n,), rad, increasing through zero; beyond its ends the last lines continue."""

    twist: Array
    torque: Array

    @staticmethod
    def through(twist: ArrayLike, torque: ArrayLike) -> PiecewiseLine:
        """The lines through points (n,) of increasing twist; an odd function if all twists are on one side of zero.

        >>> PiecewiseLine.through([1.0, 3.0], [2.0, 10.0]).at([-2.0, 0.5, 4.0]).tolist()
        [-6.0, 1.0, 14.0]
        """
        x, y = np.asarray(twist, float), np.asarray(torque, float)
        if x[0] >= 0 or x[-1] <= 0:
            x, y = (x[x > 0], y[x > 0]) if x[0] >= 0 else (-x[x < 0][::-1], -y[x < 0][::-1])
            x, y = np.concatenate([-x[::-1], [0.0], x]), np.concatenate([-y[::-1], [0.0], y])
        elif 0.0 not in x:
            zero = np.interp(0.0, x, y)
            k = int(np.searchsorted(x, 0.0))
            x, y = np.insert(x, k, 0.0), np.insert(y, k, zero)
        return PiecewiseLine(x, y)

    @property
    def slopes(self) -> Array:
        """Stiffness of each line, (n - 1,) N.m/rad."""
        return np.diff(self.torque) / np.diff(self.twist)

    def at(self, twist: ArrayLike) -> Array:
        """Torque, N.m, at twists, rad, of any shape."""
        x = np.asarray(twist, float)
        slopes = self.slopes
        inside = np.interp(x, self.twist, self.torque)
        above, below = np.maximum(x - self.twist[-1], 0.0), np.minimum(x - self.twist[0], 0.0)
        return inside + slopes[-1] * above + slopes[0] * below

    def slope_at(self, twist: ArrayLike) -> Array:
        """Stiffness, N.m/rad, at twists of any shape; at a corner that of the line towards greater |twist|."""
        x = np.asarray(twist, float)
        line = np.where(
            x >= 0, np.searchsorted(self.twist, x, side="right"), np.searchsorted(self.twist, x, side="left")
        )
        return self.slopes[np.clip(line - 1, 0, len(self.twist) - 2)]

    def flank(self, side: int, rounding: float = ROUNDING) -> QuadraticSpline:
        """The torque of one flank, +1 or -1: what the curve adds to its torque at zero twist on that side, else zero.

        Its corners are rounded over `rounding` times the distance to the next corner. At zero twist both flanks have
        the same range, so that their sum is as straight there as the curve.
        """
        x, y = self.twist, self.torque
        zero = float(np.interp(0.0, x, y))
        right = (x[x > 0], y[x > 0] - zero)
        left = (-x[x < 0][::-1], zero - y[x < 0][::-1])
        own_x, own_y = right if side > 0 else left
        middle = min([own_x[0], *(v[0] for v, _ in (right, left) if len(v))])
        spline = _rounded(np.append(0.0, own_x), np.append(0.0, own_y), float(middle), rounding)
        return spline if side > 0 else QuadraticSpline(-spline.knots[::-1], -spline.coefficients[::-1])


def rounding_error(line: PiecewiseLine, rounding: float = ROUNDING) -> float:
    """Greatest distance, N.m, between the lines and their rounded form, at the corners.

    >>> line = PiecewiseLine.through([5.4e-4, 1.55e-3, 2.6e-3], [54.0, 196.0, 388.0])
    >>> round(rounding_error(line), 5)
    0.00107
    """
    gaps = np.diff(line.twist)
    corner = np.abs(np.diff(line.slopes))
    return float((corner * rounding * np.minimum(gaps[:-1], gaps[1:]) / 4).max(initial=0.0))


def _rounded(x: Array, y: Array, middle: float, rounding: float) -> QuadraticSpline:
    """Zero below x[0], which is 0, then the lines through (x, y); the corner at 0 has the range `rounding` middle."""
    slopes = np.append(0.0, np.diff(y) / np.diff(x))
    gaps = np.diff(x)
    width = rounding * np.append(middle, np.minimum(gaps[:-1], gaps[1:]))
    corner = x[:-1]
    # The coefficient of the parabola over a corner is the value at that corner, that of a line the value at its middle.
    inner = np.stack([corner - width, corner + width], axis=1).ravel()
    ends = inner[0] - middle, max(x[-1], inner[-1] + middle)
    breaks = np.concatenate([[ends[0]], inner, [ends[1]]])
    middles = (breaks[:-1:2] + breaks[1::2]) / 2
    values = np.zeros(2 * len(corner) + 1)
    values[1::2] = y[:-1]
    values[::2] = y[:1].repeat(len(middles))
    values[2::2] = y[:-1] + slopes[1:] * (middles[1:] - corner)
    first, last = 0.0, y[-2] + slopes[-1] * (ends[1] - corner[-1])
    knots = np.concatenate([[ends[0]] * 2, breaks, [ends[1]] * 2])
    return QuadraticSpline(knots, np.concatenate([[first], values, [last]]))
