"""Lines between points are exact; their rounded form has a slope everywhere and keeps the stated distance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stiffness_model.numerics.piecewise_line import ROUNDING, PiecewiseLine, QuadraticSpline, rounding_error

SHEET = PiecewiseLine.through([5.4e-4, 1.55e-3, 3e-3], [54.0, 196.0, 420.0])

positive = st.floats(0.01, 10)
steps = st.lists(st.tuples(positive, positive), min_size=2, max_size=12)


def line_of(increments: list[tuple[float, float]]) -> PiecewiseLine:
    twist, torque = np.cumsum(np.array(increments), axis=0).T
    return PiecewiseLine.through(twist, torque)


def rounded(line: PiecewiseLine, twist: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Torque and slope of both flanks together."""
    (right, by_right), (left, by_left) = line.flank(1).evaluate(twist), line.flank(-1).evaluate(twist)
    return line.at(0.0) + right + left, by_right + by_left


def test_a_spline_through_a_sheet_s_corners_is_not_the_sheet() -> None:
    """Why the lines are kept: PCHIP through the same points is 5 % off between them."""
    from scipy.interpolate import PchipInterpolator

    spline = PchipInterpolator(SHEET.twist, SHEET.torque)
    between = np.linspace(0, 3e-3, 301)
    assert np.abs(spline(between) - SHEET.at(between)).max() > 0.01 * 420


@given(steps)
def test_the_rounded_form_keeps_its_distance(increments: list[tuple[float, float]]) -> None:
    line = line_of(increments)
    bound = rounding_error(line)
    twist = np.concatenate([np.linspace(1.3 * line.twist[0], 1.3 * line.twist[-1], 2001), line.twist])
    torque, _ = rounded(line, twist)
    scale = np.abs(line.torque).max()
    assert np.abs(torque - line.at(twist)).max() <= bound + 1e-11 * scale
    # It is reached at a corner, and small: a quarter of the range times the change of slope.
    at_corners = rounded(line, line.twist[1:-1])[0] - line.at(line.twist[1:-1])
    assert np.abs(at_corners).max() == pytest.approx(bound, rel=1e-6, abs=1e-11 * scale)


@given(steps)
def test_away_from_the_corners_the_rounded_form_is_the_line(increments: list[tuple[float, float]]) -> None:
    line = line_of(increments)
    middles = (line.twist[:-1] + line.twist[1:]) / 2
    torque, slope = rounded(line, middles)
    scale = np.abs(line.torque).max()
    np.testing.assert_allclose(torque, line.at(middles), rtol=1e-11, atol=1e-12 * scale)
    np.testing.assert_allclose(slope, line.slopes, rtol=1e-8)


@given(steps)
def test_the_slope_is_the_derivative_and_has_no_jump(increments: list[tuple[float, float]]) -> None:
    line = line_of(increments)
    gaps = np.diff(line.twist)
    for corner, gap in zip(line.twist[1:-1], np.minimum(gaps[:-1], gaps[1:]), strict=True):
        fine = corner + ROUNDING * gap * np.linspace(-1.5, 1.5, 601)
        torque, slope = rounded(line, fine)
        jump = np.abs(np.diff(slope)).max()
        assert jump <= np.ptp(slope) / 100 + 1e-9 * slope.max()
        middle = (slope[:-1] + slope[1:]) / 2
        # Differences of rounded numbers: of torques, and of twists times the slope.
        rounding = 4 * np.finfo(float).eps * (np.abs(torque).max() + np.abs(fine).max() * slope.max())
        np.testing.assert_allclose(np.diff(torque), middle * np.diff(fine), rtol=1e-4, atol=rounding)


def test_near_zero_twist_both_flanks_make_one_straight_line() -> None:
    twist = ROUNDING * 5.4e-4 * np.linspace(-2, 2, 81)
    torque, slope = rounded(SHEET, twist)
    np.testing.assert_allclose(torque, 1e5 * twist, rtol=1e-10, atol=1e-12)
    np.testing.assert_allclose(slope, 1e5, rtol=1e-12)


def test_one_flank_carries_nothing_on_the_other_side() -> None:
    torque, slope = SHEET.flank(1).evaluate([-1e-3, -1e-6])
    assert torque.tolist() == [0.0, 0.0]
    assert slope.tolist() == [0.0, 0.0]


def test_a_curve_without_symmetry_keeps_both_sides_and_its_zero() -> None:
    line = PiecewiseLine.through([-2.0, -1.0, 1.0, 3.0], [-5.0, -1.0, 3.0, 4.0])
    assert line.at([-3.0, -1.5, 0.0, 2.0, 5.0]).tolist() == [-9.0, -3.0, 1.0, 3.5, 5.0]
    torque, _ = rounded(line, np.array([-3.0, -1.5, 0.0, 2.0, 5.0]))
    np.testing.assert_allclose(torque, [-9.0, -3.0, 1.0, 3.5, 5.0], rtol=1e-12)


def test_a_quadratic_spline_is_equal_to_its_copy() -> None:
    spline = SHEET.flank(1)
    assert spline == QuadraticSpline(spline.knots.copy(), spline.coefficients.copy())
    assert spline != SHEET.flank(-1)
