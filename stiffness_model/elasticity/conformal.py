"""Conforming contact of a ball in its bore: contact along the bore's wall, in slices.

Hertz's theory assumes a contact that is small compared with the bodies. A ball of 7 mm in a bore 1 um wider touches it
along an arc instead: long round the bore, narrow along the bore's axis. `Lamina` divides that arc into slices, each a
narrow line contact across the arc:

* geometry as in the laws for pins in holes (Persson 1964; Liu, Zhang & Yang, Mech. Mach. Theory 42 (2007) 183): at the
  angle a from the load the bodies overlap by  h = d cos a - c (1 - cos a),  c the clearance of the radii, over
  |a| <= a0 with cos a0 = c/(c + d);
* each slice follows Palmgren's line contact, as ISO/TS 16281 divides rollers into laminae:
  q = h^(10/9)/(L^(1/9) 3.81^(10/9) C/pi), C the sum of (1 - nu^2)/E and L = 2 a0 r the arc's length;
* F = integral of q cos a r da.

Range of validity: an arc much longer than wide. Compared with a numerical solution of the contact (half-space influence
along the unrolled arc, in the tests), F at a given d is right to 12 % for clearances of 0.3 to 30 um at 7 mm and d from
0.3 to 10 um, where the capped theory of Hertz gives up to 4.8 times the force. Where Hertz's theory holds (small arcs,
cos tau from 0.99 to 0.9999) the two agree to 17 %. A ball larger than its bore is treated as one that fits exactly,
with both walls loaded by their overlaps.

The laws of Persson and Liu themselves hold for long pins: plane strain, a contact much longer along the hole's axis
than round it. The ball's contact is the opposite case, so they are not offered for it.
"""

from __future__ import annotations

import functools
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline

from ..numerics.arrays import Array
from .hertz import LINE_EXPONENT, line_stiffness

MIN_RELATIVE_CLEARANCE = 1e-9
"""Least clearance relative to the ball's radius, which closer bores and balls larger than their bores get; it keeps the
law's scale positive and is far below any tolerance."""
_RANGE = (1e-8, 1e10)
"""Approach over clearance that the tabulated curves cover; beyond, their power laws continue."""
_POINTS = 1801
"""Nodes of the curves, 100 per decade."""


@dataclass(frozen=True, eq=False)
class Lamina:
    """The law for n balls. radius, clearance of the radii: (n,) m; compliance: sum of (1 - nu^2)/E, 1/Pa."""

    radius: Array
    clearance: Array
    compliance: float

    @property
    def _scales(self) -> tuple[Array, Array]:
        """Length, m, and force, N, by which the law of every ball becomes the same curve."""
        c = np.maximum(self.clearance, MIN_RELATIVE_CLEARANCE * self.radius)
        # Of a line contact as long as the radius; the curve accounts for the arc's length.
        return c, line_stiffness(self.compliance, self.radius) * c**LINE_EXPONENT

    def approach(self, force: ArrayLike) -> tuple[Array, Array]:
        """Approach d, m, and its derivative, m/N, under forces (..., n), N; zero without force.

        >>> law = Lamina(np.array([7e-3]), np.array([1.25e-6]), 2 * 4.375e-12)
        >>> f"{1e6 * law.approach([500.0])[0][0]:.2f} um"
        '1.87 um'
        """
        f = np.asarray(force, float)
        length, unit = self._scales
        loaded = f > 0
        log_f = np.log(np.where(loaded, f / unit, 1.0))
        log_d, slope = _evaluate(_curves().inverse, log_f)
        d = np.where(loaded, length * np.exp(log_d), 0.0)
        return d, np.where(loaded, slope * d / np.where(loaded, f, 1.0), 0.0)

    def force(self, approach: ArrayLike) -> tuple[Array, Array, Array]:
        """Force, N, its derivative, N/m, and the energy stored, J, at approaches (..., n), m; zero without contact."""
        d = np.asarray(approach, float)
        length, unit = self._scales
        touching = d > 0
        log_d = np.log(np.where(touching, d / length, 1.0))
        log_f, slope = _evaluate(_curves().forward, log_d)
        f = np.where(touching, unit * np.exp(log_f), 0.0)
        energy = np.where(touching, unit * length * np.exp(_evaluate(_curves().energy, log_d)[0]), 0.0)
        return f, np.where(touching, slope * f / np.where(touching, d, 1.0), 0.0), energy

    def half_angle(self, approach: ArrayLike) -> Array:
        """Half the angle over which ball and bore touch, a0, rad, at approaches (..., n), m.

        >>> law = Lamina(np.array([7e-3]), np.array([1.25e-6]), 2 * 4.375e-12)
        >>> f"{math.degrees(law.half_angle(1.87e-6)[0]):.0f} deg"
        '66 deg'
        """
        x = np.maximum(np.asarray(approach, float), 0.0) / self._scales[0]
        return _arc(x)

    def peak_line_load(self, approach: ArrayLike) -> Array:
        """Line load q in the middle of the arc, N/m, at approaches (..., n), m."""
        d = np.maximum(np.asarray(approach, float), 0.0)
        arc = 2 * self.half_angle(d) * self.radius
        with np.errstate(invalid="ignore", divide="ignore"):
            q = line_stiffness(self.compliance, arc) * d**LINE_EXPONENT / arc
        return np.where(d > 0, q, 0.0)


def _arc(x: Array) -> Array:
    return 2 * np.arcsin(np.sqrt(x / (2 * (1 + x))))


@dataclass(frozen=True)
class _Curves:
    """Force over approach, its inverse, and energy over approach: logarithms, in the scales of the law."""

    forward: CubicSpline
    inverse: CubicSpline
    energy: CubicSpline


@functools.cache
def _curves() -> _Curves:
    log_x = np.linspace(math.log(_RANGE[0]), math.log(_RANGE[1]), _POINTS)
    x = np.exp(log_x)
    # With a = a0 sin(theta) the integrand vanishes smoothly at both ends.
    nodes, weights = np.polynomial.legendre.leggauss(80)
    theta = math.pi / 2 * nodes
    arc = _arc(x)[:, None]
    a = arc * np.sin(theta)
    overlap = np.maximum(x[:, None] * np.cos(a) - 2 * np.sin(a / 2) ** 2, 0.0)
    slices = overlap**LINE_EXPONENT * np.cos(a) * arc * np.cos(theta)
    force = (slices @ (math.pi / 2 * weights)) / (2 * arc[:, 0]) ** (1 / 9)
    log_f = np.log(force)
    forward = CubicSpline(log_x, log_f)
    work = CubicSpline(log_x, force * x).antiderivative()
    start = force[0] * x[0] / (1 + float(forward(log_x[0], 1)))
    return _Curves(forward, CubicSpline(log_f, log_x), CubicSpline(log_x, np.log(start + work(log_x))))


def _evaluate(curve: CubicSpline, log_x: Array) -> tuple[Array, Array]:
    """Value and slope; beyond the ends the curve continues in a straight line, a power law."""
    inside = np.clip(log_x, curve.x[0], curve.x[-1])
    slope = curve(inside, 1)
    return curve(inside) + slope * (log_x - inside), slope
