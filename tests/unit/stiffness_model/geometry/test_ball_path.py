"""The ball path, the gear profile and its usable part."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stiffness_model.geometry.ball_path import (
    BallPath,
    curvature_limit,
    max_elements_on_circle,
    profile_curvature,
    usable_limit,
    wrap,
)

CENTRE_DISTANCE, ECCENTRICITY, BALL = 48e-3, 0.7e-3, 7e-3
BETA = np.linspace(-math.pi, math.pi, 1441)


def path(lobes: int) -> BallPath:
    return BallPath(CENTRE_DISTANCE, ECCENTRICITY, lobes)


def difference(function, x, h=1e-6):
    return (function(x + h) - function(x - h)) / (2 * h)


def cartesian(lobes: int, beta):
    """Points of the path as complex numbers, from radius and polar angle alone."""
    return path(lobes).radius(beta) * np.exp(1j * np.asarray(beta) / lobes)


@pytest.mark.parametrize(("lobes", "degrees"), [(28, 103.888), (30, 91.426)])
def test_usable_limit_of_the_paper_s_profiles(lobes, degrees):
    assert math.degrees(usable_limit(path(lobes), BALL)) == pytest.approx(degrees, abs=5e-4)


@pytest.mark.parametrize("lobes", [28, 30])
def test_profile_intersects_itself_on_the_line_between_two_lobes(lobes):
    limit = usable_limit(path(lobes), BALL)
    x, y = path(lobes).point(limit, BALL)
    assert math.atan2(y, x) == pytest.approx(math.pi / lobes, abs=1e-12)
    # Up to there no other point of the half lobe reaches that line.
    before = path(lobes).point(np.linspace(0, 0.999 * limit, 500), BALL)
    assert np.all(np.arctan2(before[:, 1], before[:, 0]) < math.pi / lobes)


def test_profile_without_self_intersection_is_usable_everywhere():
    assert usable_limit(BallPath(48e-3, 0.1e-3, 10), 2e-3) == math.pi
    assert curvature_limit(BallPath(48e-3, 0.1e-3, 10), 2e-3) == math.pi


@pytest.mark.parametrize(("lobes", "at_top", "at_bottom"), [(28, 3.917, -4.534), (30, 3.448, -3.901)])
def test_radii_of_curvature(lobes, at_top, at_bottom):
    top, bottom = 1e3 / path(lobes).curvature([0.0, math.pi])
    assert top == pytest.approx(at_top, abs=5e-4)
    assert bottom == pytest.approx(at_bottom, abs=5e-4)


@pytest.mark.parametrize(("lobes", "degrees"), [(28, 22.2), (30, 23.6)])
def test_greatest_pressure_angle(lobes, degrees):
    angles = np.degrees(path(lobes).pressure_angle(BETA))
    assert angles.max() == pytest.approx(degrees, abs=0.05)
    assert angles.min() >= 0


@pytest.mark.parametrize(("lobes", "degrees"), [(28, 138.8), (30, 133.0)])
def test_undercut_by_curvature_starts_beyond_the_self_intersection(lobes, degrees):
    undercut = math.degrees(curvature_limit(path(lobes), BALL))
    assert undercut == pytest.approx(degrees, abs=0.05)
    assert undercut > math.degrees(usable_limit(path(lobes), BALL)) + 30


@pytest.mark.parametrize("lobes", [28, 30])
def test_path_keeps_the_centre_distance_from_the_eccentric(lobes):
    # Triangle of axis, eccentric and element; its angle at the axis is beta.
    distance = np.abs(path(lobes).radius(BETA) - ECCENTRICITY * np.exp(1j * BETA))
    np.testing.assert_allclose(distance, CENTRE_DISTANCE, rtol=1e-14)


def test_slopes_are_derivatives():
    p = path(30)
    np.testing.assert_allclose(p.slope(BETA), difference(p.radius, BETA), atol=1e-11)
    np.testing.assert_allclose(p.second_slope(BETA), difference(p.slope, BETA), atol=1e-11)


@pytest.mark.parametrize("lobes", [28, 30])
def test_normal_is_perpendicular_to_the_path_and_points_outwards(lobes):
    n_r, n_t = path(lobes).normal(BETA)
    tangent = difference(lambda b: cartesian(lobes, b), BETA)
    normal = (n_r + 1j * n_t) * np.exp(1j * BETA / lobes)
    np.testing.assert_allclose((tangent * normal.conj()).real / np.abs(tangent), 0, atol=1e-7)
    np.testing.assert_allclose(np.abs(normal), 1, rtol=1e-14)
    assert np.all(n_r > 0)


def test_reversing_drive_meets_the_mirrored_flank():
    n_r, n_t = path(30).normal(BETA, -1)
    mirror_r, mirror_t = path(30).normal(-BETA)
    np.testing.assert_array_equal(n_r, mirror_r)
    np.testing.assert_array_equal(n_t, mirror_t)


@pytest.mark.parametrize("lobes", [28, 30])
def test_curvature_agrees_with_finite_differences(lobes):
    h = 1e-4
    before, here, after = (cartesian(lobes, BETA + s) for s in (-h, 0.0, h))
    first, second = (after - before) / (2 * h), (after - 2 * here + before) / h**2
    expected = (first.conj() * second).imag / np.abs(first) ** 3
    np.testing.assert_allclose(path(lobes).curvature(BETA), expected, atol=1e-5 * np.abs(expected).max())


def test_profile_is_the_equidistant():
    p = path(30)
    on_path, on_profile = p.point(BETA), p.point(BETA, BALL)
    np.testing.assert_allclose(np.linalg.norm(on_profile - on_path, axis=-1), BALL, rtol=1e-12)
    np.testing.assert_allclose(on_path[:, 0] + 1j * on_path[:, 1], cartesian(30, BETA), atol=1e-17)


@pytest.mark.parametrize(
    ("radius", "surface"),
    [
        (10.0, -1 / 17),  # concave: the gear's groove has the radius rho + q
        (-10.0, 1 / 3),  # convex: |rho| - q
        (math.inf, 0.0),
    ],
)
def test_profile_curvature_of_circles_and_a_straight_line(radius, surface):
    assert float(profile_curvature(1 / radius, 7.0)) == pytest.approx(surface, rel=1e-14)


@given(st.floats(-1e3, 1e3))
def test_wrapped_angle_has_the_same_direction(angle):
    wrapped = float(wrap(angle))
    assert -math.pi < wrapped <= math.pi
    assert math.isclose(math.cos(wrapped), math.cos(angle), abs_tol=1e-10)
    assert math.isclose(math.sin(wrapped), math.sin(angle), abs_tol=1e-10)


def test_21_elements_fit_side_by_side_in_table_i():
    assert max_elements_on_circle(48e-3, 7e-3) == 21


@given(st.floats(1e-4, 0.3))
def test_greatest_number_of_elements_follows_from_their_chord(radius):
    most = max_elements_on_circle(1.0, radius)
    assert 2 * math.sin(math.pi / most) >= 2 * radius * (1 - 1e-9)
    assert 2 * math.sin(math.pi / (most + 1)) < 2 * radius * (1 + 1e-9)


def test_elements_that_touch_each_other_fit():
    assert max_elements_on_circle(1.0, math.sin(math.pi / 6)) == 6
