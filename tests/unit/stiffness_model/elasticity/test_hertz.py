"""Contact stiffness and pressure against tables, limits and the elliptic integrals that define them."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.optimize import brentq

from stiffness_model.drawing.material_library import PLA, STEEL_100CR6
from stiffness_model.elasticity import hertz

STEEL = 2 * STEEL_100CR6.compliance
BALL = 7e-3
TABLE = {0.0: 1.0, 0.9: 0.6799, 0.99: 0.3839, 0.999: 0.2059, 0.9999: 0.10735}


def integrals(k: float) -> tuple[float, float]:
    """Complete elliptic integrals K and E of m = 1 - 1/k^2, by quadrature of their definitions."""

    def root(x: float) -> float:
        return math.sqrt(math.cos(x) ** 2 + (math.sin(x) / k) ** 2)

    # The integrand of K peaks at the end; the interval is split rather than substituted, to keep the definition.
    parts = [0.0, *(math.pi / 2 - 10.0**-e for e in range(6)), math.pi / 2]
    pairs = list(itertools.pairwise(parts))
    return (
        sum(quad(lambda x: 1 / root(x), a, b, epsabs=0, epsrel=1e-12)[0] for a, b in pairs),
        sum(quad(root, a, b, epsabs=0, epsrel=1e-12)[0] for a, b in pairs),
    )


def cos_tau_of(k: float) -> float:
    big_k, big_e = integrals(k)
    return ((k**2 + 1) * big_e - 2 * big_k) / ((k**2 - 1) * big_e)


def curvatures(cos_tau: float, total: float = 2 / BALL) -> tuple[float, float]:
    """Two curvature sums with this cos(tau)."""
    return total * (1 + cos_tau) / 2, total * (1 - cos_tau) / 2


@pytest.mark.parametrize(("cos_tau", "value"), TABLE.items())
def test_published_hertz_coefficients(cos_tau, value):
    assert hertz.hertz_coefficient_exact(cos_tau) == pytest.approx(value, abs=6e-5)
    assert float(hertz.hertz_coefficient(cos_tau)) == pytest.approx(value, abs=6e-5)


@pytest.mark.parametrize("cos_tau", [0.02, 0.3, 0.7, 0.95, 0.9996])
def test_axis_ratio_and_coefficient_by_quadrature(cos_tau):
    k = float(brentq(lambda x: cos_tau_of(x) - cos_tau, 1.001, 400.0, xtol=1e-13))
    assert hertz.ellipse_axis_ratio(cos_tau) == pytest.approx(k, rel=1e-8)
    big_k, big_e = integrals(k)
    expected = 2 * big_k / math.pi * (math.pi / (2 * k**2 * big_e)) ** (1 / 3)
    assert hertz.hertz_coefficient_exact(cos_tau) == pytest.approx(expected, rel=1e-8)


@settings(max_examples=60)
@given(st.floats(0.0, hertz.CONFORMITY_LIMIT))
def test_spline_agrees_with_the_integrals(cos_tau):
    assert float(hertz.hertz_coefficient(cos_tau)) == pytest.approx(hertz.hertz_coefficient_exact(cos_tau), rel=1e-8)


def test_sphere_on_plane():
    expected = 4 / 3 / STEEL * math.sqrt(BALL)
    assert float(hertz.point_stiffness(STEEL, 1 / BALL, 1 / BALL)) == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("cos_tau", [0.0, 0.4, 0.9, 0.999])
def test_stiffness_is_the_approach_under_the_pressure_ellipse(cos_tau):
    # Johnson, Contact Mechanics, eq. 4.26c: the approach is 3 F c K/(2 pi a).
    force = 250.0
    r1, r2 = curvatures(cos_tau)
    a, b, _ = (float(v) for v in hertz.point_contact_ellipse(force, STEEL, r1, r2))
    approach = 3 * force * STEEL * integrals(a / b)[0] / (2 * math.pi * a)
    assert float(hertz.point_stiffness(STEEL, r1, r2)) * approach**1.5 == pytest.approx(force, rel=1e-7)


@pytest.mark.parametrize("cos_tau", [0.0, 0.4, 0.9, 0.999])
def test_pressure_ellipse_flattens_both_curvatures(cos_tau):
    # Johnson, eqs 4.26a, b, for the pressure p0 sqrt(1 - (x/a)^2 - (y/b)^2).
    force = 250.0
    r1, r2 = curvatures(cos_tau)
    a, b, p0 = (float(v) for v in hertz.point_contact_ellipse(force, STEEL, r1, r2))
    big_k, big_e = integrals(a / b)
    m = 1 - (b / a) ** 2
    sharp = p0 * STEEL * b / a**2 * (a**2 / b**2 * big_e - big_k) / m if m > 1e-9 else math.pi * p0 * STEEL / 4 / a
    flat = p0 * STEEL * b / a**2 * (big_k - big_e) / m if m > 1e-9 else math.pi * p0 * STEEL / 4 / a
    assert 2 * sharp == pytest.approx(r1, rel=1e-6)
    assert 2 * flat == pytest.approx(r2, rel=1e-6)


@pytest.mark.parametrize("cos_tau", [0.0, 0.9, 0.9999])
def test_point_pressure_integrates_to_the_force(cos_tau):
    force = np.array([0.1, 250.0, 3e3])
    a, b, p0 = hertz.point_contact_ellipse(force, STEEL, *curvatures(cos_tau))
    half_circle, _ = quad(lambda r: 2 * math.pi * r * math.sqrt(1 - r**2), 0, 1)
    np.testing.assert_allclose(p0 * a * b * half_circle, force, rtol=1e-8)


def test_line_pressure_integrates_to_the_force():
    force, length = 1000.0, 10e-3
    b, p0 = hertz.line_contact_pressure(force, STEEL, 1 / BALL, length)
    half_ellipse, _ = quad(lambda x: math.sqrt(1 - x**2), -1, 1)
    assert float(p0 * b * length) * half_ellipse == pytest.approx(force, rel=1e-8)
    # The pressure flattens the curvature r: p0 = b r/(2 c).
    assert float(p0) == pytest.approx(float(b) / BALL / (2 * STEEL), rel=1e-12)


def test_zero_force_gives_zero_pressure():
    assert float(hertz.point_contact_ellipse(0.0, STEEL, 1 / BALL, 1 / BALL)[2]) == 0.0
    assert float(hertz.line_contact_pressure(0.0, STEEL, 1 / BALL, 0.01)[1]) == 0.0


@pytest.mark.parametrize("length_mm", [2.0, 10.0, 40.0])
def test_line_contact_of_steel_agrees_with_iso_16281(length_mm):
    k_mm = float(hertz.line_stiffness(STEEL, length_mm * 1e-3)) * 1e-3 ** (10 / 9)
    one, two_in_series = 77651 * length_mm ** (8 / 9), 35948 * length_mm ** (8 / 9)
    assert k_mm == pytest.approx(one, rel=0.05)
    assert k_mm * 2 ** (-10 / 9) == pytest.approx(two_in_series, rel=0.05)


def test_line_contact_follows_palmgren_for_other_materials():
    compliance, length, force = STEEL_100CR6.compliance + PLA.compliance, 12e-3, 300.0
    # d = 3.81 (c/pi)^0.9 F^0.9/L^0.8, in SI.
    indentation = 3.81 * (compliance / math.pi) ** 0.9 * force**0.9 / length**0.8
    stiffness = float(hertz.line_stiffness(compliance, length))
    assert stiffness * indentation**hertz.LINE_EXPONENT == pytest.approx(force, rel=1e-12)


def test_conformity_of_a_ball_in_its_bore():
    bore = np.array([7.1e-3, 7.00035e-3, 7e-3, 6.99e-3])
    cos_tau = hertz.conformity(1 / BALL - 1 / bore, 1 / BALL)
    assert cos_tau[0] < hertz.CONFORMITY_LIMIT
    assert cos_tau[1] == pytest.approx(hertz.CONFORMITY_LIMIT, abs=1e-6)
    assert cos_tau[2] == 1.0
    assert cos_tau[3] > 1.0


def test_stiffness_is_constant_beyond_the_conformity_limit():
    bore = BALL + np.array([1e-6, 0.35e-6, 0.1e-6, 0.0, -0.1e-6, -5e-6])
    stiffness = hertz.point_stiffness(STEEL, 1 / BALL - 1 / bore, 1 / BALL)
    assert np.all(np.isfinite(stiffness))
    assert np.all(np.diff(stiffness[:2]) > 0)
    np.testing.assert_allclose(stiffness[2:], stiffness[2], rtol=1e-12)
    # The stiffness is continuous at the limit.
    edge = BALL / (1 - 2 * (1 - hertz.CONFORMITY_LIMIT) / (2 - hertz.CONFORMITY_LIMIT) * np.array([1.001, 0.999]))
    around = hertz.point_stiffness(STEEL, 1 / BALL - 1 / edge, 1 / BALL)
    assert around[1] == pytest.approx(around[0], rel=1e-2)


@given(st.floats(0.0, 0.9999), st.floats(0.1, 10.0), st.floats(0.1, 10.0))
def test_point_stiffness_scales_with_compliance_and_size(cos_tau, softer, larger):
    r1, r2 = curvatures(cos_tau)
    base = float(hertz.point_stiffness(STEEL, r1, r2))
    assert float(hertz.point_stiffness(softer * STEEL, r1, r2)) == pytest.approx(base / softer, rel=1e-12)
    assert float(hertz.point_stiffness(STEEL, r1 / larger, r2 / larger)) == pytest.approx(
        base * math.sqrt(larger), rel=1e-9
    )
