"""The twist-over-torque curve: derivative, inverse, symmetry, lost motion, file."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import stiffness_model as sm
from stiffness_model import ARCMIN, TwistTorqueCurve

FULL = 8 * ARCMIN


@pytest.fixture(scope="module")
def curve() -> TwistTorqueCurve:
    """Drive 1, one-sided: from zero to 8 arcmin."""
    return sm.simulate(sm.load_drive("drive_1"), np.linspace(0, FULL, 41), 64).curve()


@pytest.fixture(scope="module")
def two_sided() -> TwistTorqueCurve:
    return sm.simulate(sm.load_drive("drive_1"), np.linspace(-FULL, FULL, 81), 64).curve()


def curve_through(twist: np.ndarray, torque: np.ndarray) -> TwistTorqueCurve:
    """A curve through given points, without band, forces and load shares."""
    return TwistTorqueCurve(
        twist, torque, torque, torque, np.gradient(torque, twist), np.zeros((len(twist), 4)), np.zeros(len(twist))
    )


def test_stiffness_is_the_derivative_of_the_torque(curve: TwistTorqueCurve) -> None:
    inside = np.linspace(0.1, 7.9, 200) * ARCMIN
    step = 1e-5 * ARCMIN
    slope = (curve.torque_at(inside + step) - curve.torque_at(inside - step)) / (2 * step)
    np.testing.assert_allclose(curve.stiffness_at(inside), slope, rtol=1e-4)
    np.testing.assert_allclose(curve.stiffness_at(curve.twist), curve.stiffness, rtol=1e-12)


def test_mean_interpolates_its_points_and_lies_in_the_band(curve: TwistTorqueCurve) -> None:
    np.testing.assert_allclose(curve.torque_at(curve.twist), curve.torque, rtol=1e-12, atol=1e-12)
    assert (curve.torque_p10 < curve.torque).all()
    assert (curve.torque < curve.torque_p90).all()


@settings(max_examples=60, deadline=None)
@given(share=st.floats(0.02, 1.0), sign=st.sampled_from([-1, 1]))
def test_inverse_round_trip(curve: TwistTorqueCurve, share: float, sign: int) -> None:
    torque = sign * share * curve.full_torque
    assert float(curve.torque_at(curve.twist_at(torque))) == pytest.approx(torque, rel=1e-10)
    twist = sign * share * FULL
    assert float(curve.twist_at(curve.torque_at(twist))) == pytest.approx(twist, rel=1e-10)


def test_inverse_of_an_array_keeps_its_shape(two_sided: TwistTorqueCurve) -> None:
    torque = np.array([[-200.0, -20.0], [20.0, 200.0]])
    twist = two_sided.twist_at(torque)
    assert twist.shape == (2, 2)
    np.testing.assert_allclose(two_sided.torque_at(twist), torque, rtol=1e-10)


def test_one_sided_curve_is_odd(curve: TwistTorqueCurve) -> None:
    twist = np.linspace(0, 8, 30) * ARCMIN
    np.testing.assert_array_equal(curve.torque_at(-twist[1:]), -curve.torque_at(twist[1:]))
    np.testing.assert_array_equal(curve.stiffness_at(-twist), curve.stiffness_at(twist))
    torque = np.linspace(5, 250, 12)
    np.testing.assert_array_equal(curve.twist_at(-torque), -curve.twist_at(torque))


def test_one_and_two_sided_curves_agree(curve: TwistTorqueCurve, two_sided: TwistTorqueCurve) -> None:
    # For the same drives at the same twists the positive halves agree.
    np.testing.assert_allclose(two_sided.torque[40:], curve.torque, rtol=1e-6, atol=1e-6)
    assert two_sided.lost_motion() == pytest.approx(curve.lost_motion(), rel=0.1)


def test_lost_motion_and_backlash_of_known_curves() -> None:
    twist = np.linspace(0, FULL, 801)
    line = curve_through(twist, 30.0 / ARCMIN * twist)
    assert line.full_torque == pytest.approx(240)
    assert line.lost_motion() == pytest.approx(2 * 0.03 * FULL)
    assert line.lost_motion(100.0) == pytest.approx(2 * 3.0 / 30 * ARCMIN)
    assert line.backlash() == pytest.approx(2 * 0.001 * FULL)
    loose = curve_through(twist, 30.0 / ARCMIN * np.maximum(twist - 1 * ARCMIN, 0))
    assert loose.backlash() == pytest.approx(2 * ARCMIN * (1 + 0.001 * 7), abs=0.01 * ARCMIN)
    assert loose.lost_motion() == pytest.approx(2 * ARCMIN * (1 + 0.03 * 7), abs=0.01 * ARCMIN)


def test_lost_motion_of_a_two_sided_curve_takes_each_side_separately() -> None:
    twist = np.linspace(-FULL, FULL, 1601)
    asymmetric = curve_through(twist, np.where(twist > 0, 30.0, 20.0) / ARCMIN * twist)
    expected = 0.03 * 240 * (1 / 30 + 1 / 20) * ARCMIN
    assert asymmetric.lost_motion() == pytest.approx(expected, rel=1e-3)


def test_twist_at_vanishing_torque_is_the_end_of_the_backlash() -> None:
    twist = np.linspace(0, FULL, 801)
    loose = curve_through(twist, 30.0 / ARCMIN * np.maximum(twist - 1 * ARCMIN, 0))
    assert float(loose.twist_at(1e-6)) == pytest.approx(1 * ARCMIN, abs=0.02 * ARCMIN)


@pytest.mark.parametrize("twist", [9 * ARCMIN, -9 * ARCMIN, float("nan"), [0.0, 1.0]])
def test_twist_beyond_the_curve_is_refused(curve: TwistTorqueCurve, twist: float) -> None:
    for function in (curve.torque_at, curve.stiffness_at):
        with pytest.raises(sm.InputError, match=r"expected a twist within 0 \.\.\. 8 arcmin, got "):
            function(twist)


@pytest.mark.parametrize("torque", [400.0, -400.0, float("nan")])
def test_torque_beyond_the_curve_is_refused(curve: TwistTorqueCurve, torque: float) -> None:
    with pytest.raises(sm.InputError, match=r"expected a torque within .* \.\.\. 28\d(\.\d)? N\.m, got "):
        curve.twist_at(torque)


@pytest.mark.parametrize("torque", [0.0, -5.0, 1e6])
def test_lost_motion_needs_a_torque_that_the_curve_reaches(curve: TwistTorqueCurve, torque: float) -> None:
    with pytest.raises(sm.InputError, match="a torque the curve reaches"):
        curve.lost_motion(torque)


def test_rounding_error_beyond_the_last_twist_is_accepted(curve: TwistTorqueCurve) -> None:
    assert float(curve.torque_at(FULL * (1 + 1e-15))) == pytest.approx(curve.full_torque)


def test_csv_has_the_documented_columns(curve: TwistTorqueCurve, tmp_path: Path) -> None:
    curve.write_csv(tmp_path / "curve.csv")
    with (tmp_path / "curve.csv").open(newline="") as file:
        header, *rows = list(csv.reader(file))
    assert header[:5] == [
        "twist [arcmin]",
        "torque_mean [N.m]",
        "torque_p10 [N.m]",
        "torque_p90 [N.m]",
        "stiffness [N.m/arcmin]",
    ]
    assert len(rows) == len(curve.twist)
    values = np.array(rows, float)
    expected = (curve.twist / ARCMIN, curve.torque, curve.torque_p10, curve.torque_p90, curve.stiffness * ARCMIN)
    for column, numbers in enumerate(expected):
        np.testing.assert_allclose(values[:, column], numbers, rtol=1e-8, atol=1e-12)
    assert [path.name for path in tmp_path.iterdir()] == ["curve.csv"]


def test_csv_that_cannot_be_written_leaves_no_file(curve: TwistTorqueCurve, tmp_path: Path) -> None:
    with pytest.raises(sm.InputError, match="expected a folder that can be written"):
        curve.write_csv(tmp_path / "no" / "curve.csv")
    (tmp_path / "curve.csv").mkdir()
    with pytest.raises(sm.InputError, match=r"curve\.csv: expected the name of a file, got that of a folder"):
        curve.write_csv(tmp_path / "curve.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["curve.csv"]


def test_curve_is_the_mean_and_the_percentiles_of_the_drives() -> None:
    population = sm.simulate(sm.load_drive("drive_2"), [0.002, 0.001], 32)
    curve = population.curve()
    np.testing.assert_array_equal(curve.twist, [0.001, 0.002])
    np.testing.assert_allclose(curve.torque, population.torque.mean(axis=0)[::-1])
    np.testing.assert_allclose(curve.torque_p90, np.percentile(population.torque, 90, axis=0)[::-1])
    np.testing.assert_allclose(curve.contact_force, population.contact_force.mean(axis=0)[::-1])
    assert curve.notes["drives"] == "32"
    assert curve.notes["seed"] == "0"
    assert curve == population.curve()
    assert hash(curve) == hash(population.curve())
    assert curve != sm.simulate(population.drive, [0.002, 0.001], 32, seed=1).curve()
