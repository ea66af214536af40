"""Hertzian contacts: stiffness F = K d^p, pressure and contact ellipse.

Point contact: p = 3/2 (balls, eqs 22, 23); line contact: p = 10/9 (rollers). Compliances are the sums of
(1 - nu^2)/E of the two bodies, 1/Pa. Curvatures are in 1/m, negative for concave surfaces.

The point contact assumes half-spaces: a contact that is small compared with the bodies. A ball in a bore of nearly its
own radius violates this; see `CONFORMITY_LIMIT`.
"""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.interpolate import CubicSpline
from scipy.special import ellipe, ellipkm1

from ..numerics.arrays import Array
from ..numerics.roots import bracketed_root

POINT_EXPONENT = 3 / 2
LINE_EXPONENT = 10 / 9

CONFORMITY_LIMIT = 0.9999
"""Upper bound of cos(tau) for conforming contacts.

A ball of 7 mm reaches it in a bore 0.35 um wider than itself. In closer bores, or with interference (cos(tau) > 1), the
half-space theory would give a contact ellipse longer than the ball; K then keeps its value at the bound, axis ratio
354, and the case is counted (`Population.capped_count`). The cage is the stiffest of the three contacts in series
there, so that the bound changes the drive's torque by less than 0.1 %.
"""


def ellipse_axis_ratio(cos_tau: float) -> float:
    """Axis ratio k = a/b >= 1 of the contact ellipse for 0 <= cos(tau) < 1.

    Solves cos(tau) = ((k^2+1) E - 2 K)/((k^2-1) E), K and E the elliptic integrals of m = 1 - 1/k^2, for ln k
    (Johnson, Contact Mechanics, section 4.2; Harris, Rolling Bearing Analysis).

    >>> round(ellipse_axis_ratio(0.0), 6)
    1.0
    """
    if cos_tau < 1e-9:
        return 1.0
    return math.exp(bracketed_root(lambda x: _cos_tau(x) - cos_tau, 1e-10, 60.0))


def _cos_tau(log_k: float) -> float:
    if log_k < 1e-4:
        # Series for small ln k, where the difference of the integrals cancels.
        return 0.75 * log_k
    k2 = math.exp(2 * log_k)
    big_k, big_e = float(ellipkm1(1 / k2)), float(ellipe(1 - 1 / k2))
    return ((k2 + 1) * big_e - 2 * big_k) / ((k2 - 1) * big_e)


def hertz_coefficient_exact(cos_tau: float) -> float:
    """psi/xi = (2K/pi) (pi/(2 k^2 E))^(1/3), which is 1 for a circle, from elliptic integrals.

    >>> [round(hertz_coefficient_exact(c), 4) for c in (0.0, 0.9, 0.99, 0.999, 0.9999)]
    [1.0, 0.6799, 0.3839, 0.2059, 0.1073]
    """
    k = ellipse_axis_ratio(cos_tau)
    big_k, big_e = float(ellipkm1(1 / k**2)), float(ellipe(1 - 1 / k**2))
    return (2 * big_k / math.pi) * (math.pi / (2 * k**2 * big_e)) ** (1 / 3)


@functools.cache
def _splines() -> tuple[CubicSpline, CubicSpline]:
    """ln(psi/xi) and ln(k) over atanh(cos tau), in which both are smooth; the error is below 1e-9."""
    x = np.linspace(0.0, math.atanh(CONFORMITY_LIMIT), 801)
    k = [ellipse_axis_ratio(math.tanh(v)) for v in x]
    psi_xi = [hertz_coefficient_exact(math.tanh(v)) for v in x]
    # psi/xi is even in cos tau, so that its slope vanishes for a circle.
    flat_start: Any = ((1, 0.0), "not-a-knot")
    return CubicSpline(x, np.log(psi_xi), bc_type=flat_start), CubicSpline(x, np.log(k))


def conformity(curvature_sum_1: ArrayLike, curvature_sum_2: ArrayLike) -> Array:
    """cos(tau) = |r1 - r2|/(r1 + r2) from the curvature sums of the two principal planes, 1/m.

    It is 1 or more for a ball in a bore of its own size or smaller.
    """
    r1, r2 = np.asarray(curvature_sum_1, float), np.asarray(curvature_sum_2, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        cos_tau = np.abs(r1 - r2) / (r1 + r2)
    return np.where(r1 + r2 > 0, cos_tau, np.inf)


def hertz_coefficient(cos_tau: ArrayLike) -> Array:
    """psi/xi for arrays, with cos(tau) capped at `CONFORMITY_LIMIT`; agrees with `hertz_coefficient_exact` to 1e-9.

    >>> hertz_coefficient([0.0, 0.9, 1.3]).round(4)
    array([1.    , 0.6799, 0.1073])
    """
    return np.exp(_splines()[0](np.arctanh(np.minimum(cos_tau, CONFORMITY_LIMIT))))


def point_stiffness(compliance: ArrayLike, curvature_sum_1: ArrayLike, curvature_sum_2: ArrayLike) -> Array:
    """K of F = K d^(3/2), N/m^(3/2) (eq. 23), from compliance, 1/Pa, and the curvature sums, 1/m.

    For a sphere of radius R on a plane it is (4/3) E* sqrt(R):

    >>> k = point_stiffness(1e-11, 1 / 0.01, 1 / 0.01)
    >>> bool(np.isclose(k, 4 / 3 * 1e11 * 0.1))
    True
    """
    r1, r2 = np.asarray(curvature_sum_1, float), np.asarray(curvature_sum_2, float)
    cos_tau = conformity(r1, r2)
    # With interference the sum of curvatures may vanish; the capped pair keeps the larger of the two.
    high = np.maximum(r1, r2)
    low = np.maximum(np.minimum(r1, r2), high * (1 - CONFORMITY_LIMIT) / (1 + CONFORMITY_LIMIT))
    coefficient = hertz_coefficient(cos_tau)
    return 1 / (3 / (4 * math.sqrt(2)) * np.asarray(compliance) * np.sqrt((high + low) * coefficient**3))


def point_contact_ellipse(
    force: ArrayLike, compliance: ArrayLike, curvature_sum_1: ArrayLike, curvature_sum_2: ArrayLike
) -> tuple[Array, Array, Array]:
    """Semi-axes a >= b, m, and greatest pressure, Pa, of a point contact under `force`, N.

    a = (3 k^2 E F c/(pi r))^(1/3) with the compliance c and the curvature sum r; b = a/k;
    p0 = 3 F/(2 pi a b) (Johnson, eqs 4.26-4.28). cos(tau) is capped as for the stiffness.

    >>> a, b, p0 = point_contact_ellipse(100.0, 2 * 4.375e-12, 1 / 7e-3, 1 / 7e-3)
    >>> f"{1e3 * a:.4f} mm {1e3 * b:.4f} mm {1e-9 * p0:.3f} GPa"
    '0.1662 mm 0.1662 mm 1.728 GPa'
    """
    r1, r2 = np.asarray(curvature_sum_1, float), np.asarray(curvature_sum_2, float)
    k = np.exp(_splines()[1](np.arctanh(np.minimum(conformity(r1, r2), CONFORMITY_LIMIT))))
    big_e = ellipe(1 - 1 / k**2)
    f, c = np.asarray(force, float), np.asarray(compliance, float)
    a = (3 * k**2 * big_e * f * c / (math.pi * (r1 + r2))) ** (1 / 3)
    b = a / k
    with np.errstate(invalid="ignore", divide="ignore"):
        pressure = np.where(f > 0, 1.5 * f / (math.pi * a * b), 0.0)
    return a, b, pressure


def line_stiffness(compliance: ArrayLike, length: ArrayLike) -> Array:
    """K of F = K d^(10/9), N/m^(10/9), of one line contact of `length` m.

    d = 3.81 [sum (1 - nu^2)/(pi E)]^0.9 F^0.9/L^0.8 (Palmgren; Harris, Rolling Bearing Analysis). For steel
    ISO/TS 16281 gives 77651 L^(8/9) in N and mm for one contact (its 35948 is two in series), 4 % softer:

    >>> k_mm = float(line_stiffness(2 * 4.375e-12, 10e-3)) * 1e-3 ** (10 / 9)
    >>> f"{k_mm / (77651 * 10 ** (8 / 9)):.3f}"
    '1.046'
    """
    return np.asarray(length, float) ** (8 / 9) / (3.81 ** (10 / 9) * np.asarray(compliance, float) / math.pi)


def line_contact_pressure(
    force: ArrayLike, compliance: ArrayLike, curvature_sum: ArrayLike, length: float
) -> tuple[Array, Array]:
    """Half width b, m, and greatest pressure p0, Pa, of a line contact of `length` m under `force`, N.

    b = sqrt(4 F c/(pi L r)), p0 = 2 F/(pi b L) (Johnson, eqs 4.43, 4.45).

    >>> b, p0 = line_contact_pressure(1000.0, 2 * 4.375e-12, 1 / 7e-3, 10e-3)
    >>> f"{1e3 * b:.4f} mm {1e-9 * p0:.3f} GPa"
    '0.0883 mm 0.721 GPa'
    """
    f = np.asarray(force, float)
    b = np.sqrt(4 * f * np.asarray(compliance, float) / (math.pi * length * np.asarray(curvature_sum, float)))
    with np.errstate(invalid="ignore", divide="ignore"):
        pressure = np.where(f > 0, 2 * f / (math.pi * b * length), 0.0)
    return b, pressure
