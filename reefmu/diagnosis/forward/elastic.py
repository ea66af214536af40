"""The elastic torque of a base curve over whole records, with exact derivatives, in NumPy.

CasADi's virtual machine takes 7 us for one value of the lookup; these array operations take 0.1 us. A test compares
the values with those of `Lookup.torque`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.lookup.curve_lookup import CurveLookup
from stiffness_model.numerics.arrays import Array
from stiffness_model.numerics.bspline import Axis, locate, slope_weights, weights

from .vectorised import Number


class ElasticTorque(Protocol):
    """Torque over twist and clearance; `shape` holds parameters that are fitted together with the effects."""

    def evaluate(
        self, twist: Array, clearance: Number, shape: Array, *, by_clearance: bool = True
    ) -> tuple[Array, Array, Number, list[Array]]:
        """Torque (n,), N.m, and its derivatives (n,) by twist, by clearance and by each of the shape parameters.

        twist: (n,) rad; clearance: m, a number or (n,); shape: (k,); by_clearance: whether that derivative is needed,
        which may else be 0.
        """
        ...


def slope_by_clearance(curve: ElasticTorque, twist: Array, clearance: Array) -> Array:
    """(k,) N.m/m, derivative by the clearance of a curve without shape parameters, at twists (k,), rad, and clearances
    (k,), m."""
    return np.asarray(curve.evaluate(twist, clearance, np.zeros(0))[2])


@dataclass(frozen=True)
class SplineTable:
    """Uniform cubic B-splines over two axes, extrapolated as `stiffness_model.numerics.bspline` does.

    coefficients: (axes[0].size, axes[1].size).
    """

    axes: tuple[Axis, Axis]
    coefficients: Array

    def evaluate(self, x: Array, y: Number, *, by_second: bool = True) -> tuple[Array, Array, Number]:
        """Value and derivatives by x and y, (n,) each, at x (n,) and y, a number or (n,).

        Unless `by_second`, the derivative by a single y is left out and 0.
        """
        first, second = self.axes
        i, f = locate(first, x)
        if not isinstance(y, np.ndarray):
            # A single y: one spline along x, and one for the derivative by y.
            j, along_y, slope_y = across_one(second, float(y))
            strip = self.coefficients[:, j : j + 4]
            value, by_x = _along(strip @ along_y, i, f)
            by_y = _along(strip @ slope_y, i, f)[0] if by_second else 0.0
            return value, by_x / first.step, by_y
        j, g = locate(second, y)
        held = np.clip(g, 0.0, 1.0)
        # All indices are valid; mode "clip" skips the check.
        cells = np.take(self._powers, i * second.cells + j, axis=0, mode="clip")
        by_powers = np.ascontiguousarray(cells.T).reshape(4, 4, -1)
        row, row_slope = _horner(by_powers, held)
        value, by_x = _beyond(row, f)
        by_y = _beyond(row_slope, f)[0] * ((g >= 0) & (g <= 1)) / second.step
        return value, by_x / first.step, by_y

    @cached_property
    def _powers(self) -> Array:
        """(cells, 16) coefficients of each cell's polynomial: of every power of its second coordinate those of the
        powers of the first."""
        windows = np.ascontiguousarray(sliding_window_view(self.coefficients, (4, 4)))
        by_first = _POWERS @ windows @ _POWERS.T
        return by_first.swapaxes(-1, -2).reshape(-1, 16)


_THIRDS = np.arange(4) / 3
_POWERS = np.linalg.solve(np.vander(_THIRDS, increasing=True), np.stack(weights(_THIRDS, _THIRDS), axis=1))
"""Matrix (4, 4) from the four coefficients of a cell to those of the powers of its coordinate."""


def _along(curve: Array, i: NDArray[np.intp], f: Array) -> tuple[Array, Array]:
    """Value and derivative by f of a spline (size,) at coordinate f (n,) of cell i (n,)."""
    cells = len(curve) - 3
    return _beyond(np.take(_POWERS @ np.stack([curve[k : k + cells] for k in range(4)]), i, axis=1, mode="clip"), f)


def _beyond(powers: Array, f: Array) -> tuple[Array, Array]:
    """Value and derivative by f of polynomials with coefficients (4, n) at f (n,), straight lines beyond 0 to 1."""
    inside = np.clip(f, 0.0, 1.0)
    value, slope = _horner(powers, inside)
    return value + (f - inside) * slope, slope


def _horner(powers: Array, f: Array) -> tuple[Array, Array]:
    """Value and derivative by f of polynomials with coefficients (4, ..., n) at f (n,), by Horner's rule."""
    a, b, c, d = powers
    return ((d * f + c) * f + b) * f + a, (3 * d * f + 2 * c) * f + b


def across(axis: Axis, y: Array) -> tuple[NDArray[np.intp], Array, Array]:
    """Cells, weights (4, m) and weights of the derivative (4, m) along the second axis, held beyond its ends."""
    j, g = locate(axis, y)
    held = np.clip(g, 0.0, 1.0)
    return j, np.stack(weights(held, held)), np.stack(slope_weights(held)) * ((g >= 0) & (g <= 1)) / axis.step


def across_one(axis: Axis, y: float) -> tuple[int, Array, Array]:
    """The same for one number, without the overhead of arrays."""
    u = (y - axis.start) / axis.step
    j = int(min(max(u, 0.0), axis.cells - 1.0))
    held = min(max(u - j, 0.0), 1.0)
    return j, np.array(weights(held, held)), np.array(slope_weights(held)) * (0 <= u - j <= 1) / axis.step


@dataclass(frozen=True)
class LookupTorque:
    """Mean torque of a lookup, without shape parameters."""

    table: SplineTable

    @staticmethod
    def of(lookup: Lookup) -> LookupTorque:
        """The mean torque of a lookup."""
        return LookupTorque(SplineTable(lookup.axes, np.ascontiguousarray(lookup.coefficients[0])))

    def evaluate(
        self, twist: Array, clearance: Number, shape: Array, *, by_clearance: bool = True
    ) -> tuple[Array, Array, Number, list[Array]]:
        """See `ElasticTorque`; shape is empty."""
        return (*self.table.evaluate(twist, clearance, by_second=by_clearance), [])


@dataclass(frozen=True)
class CurveTorque:
    """The torque of a curve without a drawing, without shape parameters."""

    lookup: CurveLookup

    def evaluate(
        self, twist: Array, clearance: Number, shape: Array, *, by_clearance: bool = True
    ) -> tuple[Array, Array, Number, list[Array]]:
        """See `ElasticTorque`; shape is empty."""
        return (*self.lookup.evaluate(twist, clearance), [])


@dataclass(frozen=True)
class ScaledTorque:
    """Another elastic torque times 1 + shape[0], the uncertain scale of a curve file."""

    inner: ElasticTorque

    def evaluate(
        self, twist: Array, clearance: Number, shape: Array, *, by_clearance: bool = True
    ) -> tuple[Array, Array, Number, list[Array]]:
        """See `ElasticTorque`; shape is (relative error of the scale,)."""
        value, by_twist, slope, _ = self.inner.evaluate(twist, clearance, np.zeros(0), by_clearance=by_clearance)
        factor = 1 + float(shape[0])
        return factor * value, factor * by_twist, factor * slope, [value]


@dataclass(frozen=True)
class PowerLawTorque:
    """A free power law for gears without a drawing: scale (s/max_twist)^exponent at each of two flanks.

    s is the twist beyond the play, clearance/lever, on either side; with negative clearance both flanks carry load
    about zero. max_twist: rad, a twist within the record, so that `scale` is its torque; lever: m/rad; corner: rad,
    range over which contact sets in smoothly.
    """

    max_twist: float
    lever: float
    corner: float

    def evaluate(
        self, twist: Array, clearance: Number, shape: Array, *, by_clearance: bool = True
    ) -> tuple[Array, Array, Number, list[Array]]:
        """See `ElasticTorque`; shape is (log of the scale in N.m, exponent)."""
        play = clearance / self.lever
        right, right_slope, right_log = self._flank(twist - play, shape)
        left, left_slope, left_log = self._flank(-twist - play, shape)
        value = right - left
        return (
            value,
            right_slope + left_slope,
            (left_slope - right_slope) / self.lever,
            [value, right * right_log - left * left_log],
        )

    def _flank(self, gap: Array, shape: Array) -> tuple[Array, Array, Array]:
        root = np.sqrt(gap**2 + self.corner**2)
        beyond = np.maximum((gap + root) / 2 / self.max_twist, 1e-12)
        # The logarithm is needed anyway, and an exponential is cheaper than a power.
        log = np.log(beyond)
        value = np.exp(shape[0] + shape[1] * log)
        return value, shape[1] * value / beyond * (1 + gap / root) / 2 / self.max_twist, log
