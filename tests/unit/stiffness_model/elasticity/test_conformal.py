"""The conforming bore against a numerical solution of the contact, Hertz's limit, and its own inverse."""

from __future__ import annotations

import math

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.drawing import sampling
from stiffness_model.elasticity import hertz
from stiffness_model.elasticity.conformal import Lamina

RADIUS = 7e-3
STEEL = 2 * 4.375e-12


def numerical_force(approach: float, clearance: float, n_arc: int = 41, n_width: int = 13) -> float:
    """Force between a ball and its bore, N, by half-space influence along the unrolled arc.

    Uniform pressure on rectangles (arc, width); displacement along the local normal by Love's formula for a rectangle
    (Johnson, eq. 3.25), with distances along the surface; no negative pressure.
    """
    arc = 2 * math.asin(math.sqrt(approach / (2 * (approach + clearance))))
    q = Lamina(np.array([RADIUS]), np.array([clearance]), STEEL).peak_line_load([approach])[0]
    half_width = 1.6 * math.sqrt(4 * q * RADIUS * STEEL / math.pi)
    # Finer towards the ends, where the pressure vanishes.
    edges_s = RADIUS * 1.02 * arc * np.sin(np.linspace(-math.pi / 2, math.pi / 2, n_arc + 1))
    edges_y = half_width * np.linspace(-1, 1, n_width + 1)
    s, y = (edges_s[1:] + edges_s[:-1]) / 2, (edges_y[1:] + edges_y[:-1]) / 2
    a, b = np.diff(edges_s) / 2, np.diff(edges_y)[0] / 2
    s, y, a = np.repeat(s, n_width), np.tile(y, n_arc), np.repeat(a, n_width)
    angle = s / RADIUS
    overlap = approach * np.cos(angle) - 2 * clearance * np.sin(angle / 2) ** 2 - y**2 / (2 * RADIUS)

    def corner(u: np.ndarray, v: np.ndarray) -> np.ndarray:
        return v * np.arcsinh(u / np.abs(v)) + u * np.arcsinh(v / np.abs(u))

    ds, dy = s[:, None] - s, y[:, None] - y
    influence = (
        STEEL
        / math.pi
        * (corner(ds + a, dy + b) - corner(ds - a, dy + b) - corner(ds + a, dy - b) + corner(ds - a, dy - b))
    )
    active = overlap > 0
    for _ in range(60):
        pressure = np.zeros(len(s))
        index = np.flatnonzero(active)
        pressure[index] = np.linalg.solve(influence[np.ix_(index, index)], overlap[index])
        wrong = active & (pressure <= 0)
        if not wrong.any():
            gap = influence @ pressure - overlap
            penetrating = ~active & (gap < 0)
            if not penetrating.any():
                break
            active |= penetrating
        active &= ~wrong
    return float((pressure * np.cos(angle) * 4 * a * b).sum())


@pytest.mark.parametrize("clearance", [0.3e-6, 1.25e-6, 5e-6, 30e-6])
@pytest.mark.parametrize("approach", [0.3e-6, 2e-6, 10e-6])
def test_force_agrees_with_a_numerical_solution(clearance: float, approach: float) -> None:
    law = Lamina(np.array([RADIUS]), np.array([clearance]), STEEL)
    assert law.force([approach])[0][0] == pytest.approx(numerical_force(approach, clearance), rel=0.15)


def test_numerical_solution_agrees_with_hertz_for_a_small_contact() -> None:
    clearance, approach = 300e-6, 1e-6
    k = hertz.point_stiffness(STEEL, 1 / RADIUS - 1 / (RADIUS + clearance), 1 / RADIUS)
    assert numerical_force(approach, clearance, 61, 25) == pytest.approx(float(k) * approach**1.5, rel=0.04)


@pytest.mark.parametrize("clearance", [2e-6, 5e-6, 30e-6, 70e-6])
def test_law_agrees_with_hertz_for_small_arcs(clearance: float) -> None:
    k = hertz.point_stiffness(STEEL, 1 / RADIUS - 1 / (RADIUS + clearance), 1 / RADIUS)
    law = Lamina(np.array([RADIUS]), np.array([clearance]), STEEL)
    approach = 0.03 * clearance
    assert math.degrees(law.half_angle(approach)[0]) < 15
    assert law.force([approach])[0][0] == pytest.approx(float(k) * approach**1.5, rel=0.17)


def test_hertz_overestimates_the_force_of_a_large_arc() -> None:
    """At drive 1's clearance and full load Hertz's ellipse is longer than the ball; the arc ends at 90 degrees."""
    k = hertz.point_stiffness(STEEL, 1 / RADIUS - 1 / (RADIUS + 1.25e-6), 1 / RADIUS)
    law = Lamina(np.array([RADIUS]), np.array([1.25e-6]), STEEL)
    force = law.force([3e-6])[0][0]
    assert float(k) * 3e-6**1.5 > 1.5 * force
    major, _, _ = hertz.point_contact_ellipse(force, STEEL, 1 / RADIUS - 1 / (RADIUS + 1.25e-6), 1 / RADIUS)
    assert major > RADIUS
    assert law.half_angle([1.0])[0] < math.pi / 2


def test_force_approach_and_energy_are_consistent() -> None:
    law = Lamina(np.full(7, RADIUS), np.array([-1e-6, 0.0, 1e-9, 1e-7, 1e-6, 1e-5, 1e-3]), STEEL)
    approach = np.geomspace(1e-9, 3e-5, 40)[:, None] * np.ones(7)
    force, rate, energy = law.force(approach)
    back, slope = law.approach(force)
    np.testing.assert_allclose(back, approach, rtol=1e-8)
    np.testing.assert_allclose(slope * rate, 1, rtol=1e-6)
    h = 1e-4 * approach
    np.testing.assert_allclose((law.force(approach + h)[2] - law.force(approach - h)[2]) / (2 * h), force, rtol=1e-6)
    np.testing.assert_allclose((law.force(approach + h)[0] - law.force(approach - h)[0]) / (2 * h), rate, rtol=1e-6)
    assert (np.diff(force, axis=0) > 0).all()
    assert (energy > 0).all()
    for separated in (0.0, -1e-6):
        assert not np.any(law.force(np.full(7, separated)))
        assert not np.any(law.approach(np.full(7, separated)))


def test_drive_with_conforming_bores_reports_the_arc() -> None:
    drive = sm.load_drive("drive_1", cage_contact="lamina")
    found = sm.contact_pressures(drive, [drive.max_twist], n_drives=20)
    plain = sm.contact_pressures(sm.load_drive("drive_1"), [drive.max_twist], n_drives=20)
    assert (found.major[..., 2] < RADIUS * math.pi / 2).all()
    assert plain.major[..., 2].mean() > RADIUS
    assert found.pressure[..., 2].mean() > 1.1 * plain.pressure[..., 2].mean()
    np.testing.assert_allclose(found.pressure[..., :2], plain.pressure[..., :2], rtol=0.03)


def test_pressure_of_the_arc_integrates_to_the_force() -> None:
    """Across the arc the ball touches a straight wall: p0 = b/(2 C r) (Johnson, eqs 4.43 to 4.45). Along the arc q
    follows the overlap, and the integral of its component along the load is the force."""
    drive = sm.load_drive("drive_1", cage_contact="lamina", elements=1, eccentrics=1)
    twist = [drive.max_twist]
    found = sm.contact_pressures(drive, twist, n_drives=30)
    force = sm.simulate(drive, twist, 30).contact_force[:, 0, 2:].max(axis=1)
    loaded = np.flatnonzero(force > 0)
    assert len(loaded) > 3
    for k in loaded:
        radius = sampling.draw(drive, k // 16, k % 16 + 1, 0).element[-1, 0]
        pressure, half_arc, width = (float(x[k, 0, 2]) for x in (found.pressure, found.major, found.minor))
        assert pressure == pytest.approx(width / (2 * STEEL * radius), rel=1e-9)
        a0 = half_arc / radius
        a = np.linspace(-a0, a0, 4001)
        # Overlap relative to the middle: d cos a - c (1 - cos a) with c/(c + d) = cos a0.
        overlap = np.maximum((np.cos(a) - math.cos(a0)) / (1 - math.cos(a0)), 0.0)
        middle = math.pi / 2 * pressure * width
        assert np.trapezoid(middle * overlap ** (10 / 9) * np.cos(a), a) * radius == pytest.approx(force[k], rel=1e-4)


def test_conforming_bores_are_refused_for_rollers() -> None:
    with pytest.raises(sm.InputError, match="'hertz' for rollers"):
        sm.load_drive("drive_1", element="roller", element_length="10 mm", cage_contact="lamina")
