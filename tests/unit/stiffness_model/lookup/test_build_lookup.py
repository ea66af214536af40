"""The lookup against the solver: error bound, monotonicity, symmetry, inverse, extrapolation, file."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import stiffness_model as sm
from stiffness_model.drawing.twist_limits import clearance_deviation
from stiffness_model.lookup.build_lookup import ERROR_BOUND, QUANTITIES, Lookup, build_lookup, mean_torque
from stiffness_model.numerics.bspline import Axis, evaluate, fit


@pytest.mark.slow
def test_mean_torque_within_the_stated_bound_of_the_solver(drive: sm.Drive, lookup: Lookup) -> None:
    rng = np.random.default_rng(7)
    twist = rng.uniform(-2, 2, 25) * drive.max_twist
    for clearance in rng.uniform(lookup.clearance.start, lookup.clearance.stop, 6):
        solved = [mean_torque(drive, sign * twist, float(clearance)) for sign in (1, -1)]
        odd = (solved[0] - solved[1]) / 2
        assert np.abs(lookup.torque(twist, clearance) - odd).max() / lookup.full_torque < ERROR_BOUND


@pytest.mark.parametrize("name", ["drive_1", "drive_2", "drive_3"])
def test_evenly_spread_elements_give_the_mean_of_drawn_drives(name: str) -> None:
    drive = sm.load_drive(name)
    twist = np.array([0.3, 0.6, 1.0]) * drive.max_twist
    torque = sm.simulate(drive, twist, 2000, seed=5).torque
    error = torque.std(axis=0) / np.sqrt(len(torque))
    assert (np.abs(mean_torque(drive, twist) - torque.mean(axis=0)) < 4 * error).all()
    assert np.abs(mean_torque(drive, twist) + mean_torque(drive, -twist)).max() < 3e-4 * torque[:, -1].mean()


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drive_2", "drive_3"])
def test_stated_error_meets_the_bound(name: str) -> None:
    drive = sm.load_drive(name)
    lookup = build_lookup(drive, n_drives=64)
    assert lookup.error["torque_mean"] < ERROR_BOUND
    twist = np.linspace(-1, 1, 9) * drive.max_twist
    for clearance in (-4.5 * clearance_deviation(drive), 4.5 * clearance_deviation(drive)):
        solved = mean_torque(drive, twist, clearance)
        assert np.abs(lookup.torque(twist, clearance) - solved).max() / lookup.full_torque < 3 * ERROR_BOUND
    assert set(lookup.error) == set(QUANTITIES)


def test_torque_rises_with_twist_and_falls_with_clearance(lookup: Lookup) -> None:
    twist = np.linspace(-1.5, 1.5, 1501) * lookup.twist.stop
    clearance = np.linspace(-1.2, 1.2, 41) * lookup.clearance.stop
    grid = np.meshgrid(twist, clearance)
    for band in (-1.0, 0.0, 0.5, 1.0):
        assert (lookup.stiffness(*grid, band) >= 0).all()
    positive = twist > 0
    loaded = lookup.torque(grid[0], grid[1])[:, positive]
    # Between nodes the spline over the clearance may oscillate within its own error.
    assert (np.diff(loaded, axis=0) <= ERROR_BOUND * lookup.full_torque).all()


def test_torque_is_odd_and_the_percentiles_mirror_each_other(lookup: Lookup) -> None:
    twist = np.linspace(0, 1.2, 201) * lookup.twist.stop
    scale = 1e-12 * lookup.full_torque
    assert np.abs(lookup.torque(twist) + lookup.torque(-twist)).max() < scale
    assert np.abs(lookup.torque(twist, 3e-6, 1.0) + lookup.torque(-twist, 3e-6, -1.0)).max() < scale
    assert np.abs(lookup.max_contact_force(twist) - lookup.max_contact_force(-twist)).max() < 1e-8
    assert float(lookup.torque(0.0)) == pytest.approx(0, abs=scale)


def test_band_is_that_of_the_population(drive: sm.Drive, lookup: Lookup) -> None:
    twist = np.array([0.5, 1.0]) * drive.max_twist
    torque = np.concatenate([sm.simulate(drive, twist, 16).torque, -sm.simulate(drive, -twist, 16).torque])
    low, high = np.percentile(torque, [10, 90], axis=0) - torque.mean(axis=0) + lookup.torque(twist)
    spread = high - low
    assert np.abs(lookup.torque(twist, band=-1.0) - low).max() < 0.3 * spread.max()
    assert np.abs(lookup.torque(twist, band=1.0) - high).max() < 0.3 * spread.max()
    assert (lookup.torque(twist, band=-1.0) < lookup.torque(twist)).all()
    half = lookup.torque(twist, band=0.5)
    assert half == pytest.approx((lookup.torque(twist) + lookup.torque(twist, band=1.0)) / 2)


def test_stiffness_is_the_continuous_derivative_of_the_torque(lookup: Lookup) -> None:
    twist = np.linspace(-1.3, 1.3, 997) * lookup.twist.stop
    h = 1e-9
    difference = (lookup.torque(twist + h, 1e-6) - lookup.torque(twist - h, 1e-6)) / (2 * h)
    assert lookup.stiffness(twist, 1e-6) == pytest.approx(difference, rel=1e-5, abs=1e-5 * difference.max())
    nodes = lookup.twist.nodes
    jump = lookup.stiffness(nodes + 1e-12) - lookup.stiffness(nodes - 1e-12)
    assert np.abs(jump).max() < 1e-6 * lookup.stiffness(nodes).max()


@settings(max_examples=60, deadline=None)
@given(share=st.floats(-2.5, 2.5), clearance=st.floats(-1, 1), band=st.sampled_from([-1.0, 0.0, 1.0]))
def test_twist_at_is_the_inverse_of_torque(lookup: Lookup, share: float, clearance: float, band: float) -> None:
    torque, shift = share * lookup.full_torque, clearance * lookup.clearance.stop
    twist = lookup.twist_at(torque, shift, band)
    assert float(lookup.torque(twist, shift, band)) == pytest.approx(torque, abs=1e-9 * lookup.full_torque)


def test_extrapolation_is_linear_and_reported(lookup: Lookup) -> None:
    edge = lookup.twist.stop
    slope = float(lookup.stiffness(edge))
    assert float(lookup.torque(3 * edge)) == pytest.approx(float(lookup.torque(edge)) + slope * 2 * edge, rel=1e-12)
    assert float(lookup.torque(1.0)) == pytest.approx(float(lookup.torque(edge)) + slope * (1 - edge), rel=1e-12)
    assert lookup.in_range(0.99 * edge)
    assert not lookup.in_range(1.01 * edge)
    assert not lookup.in_range(0.0, 1.01 * lookup.clearance.stop)


def test_a_saved_lookup_is_loaded_with_its_origin(lookup: Lookup, drive: sm.Drive, tmp_path: Path) -> None:
    lookup.save(tmp_path / "tables.npz")
    again = Lookup.load(tmp_path / "tables.npz")
    assert (again.coefficients == lookup.coefficients).all()
    for field in dataclasses.fields(Lookup):
        if field.name != "coefficients":
            assert getattr(again, field.name) == getattr(lookup, field.name)
    assert sm.drive_from_dict(again.drawing) == drive
    assert again.version
    assert [f.name for f in tmp_path.iterdir()] == ["tables.npz"]


@pytest.mark.parametrize("content", [b"", b"PK\x03\x04 half", b"not a lookup"])
def test_foreign_or_truncated_file_is_refused(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "tables.npz"
    path.write_bytes(content)
    with pytest.raises(sm.InputError, match=r"tables\.npz: expected a saved lookup"):
        Lookup.load(path)


def test_truncated_save_is_refused(lookup: Lookup, tmp_path: Path) -> None:
    path = tmp_path / "tables.npz"
    lookup.save(path)
    path.write_bytes(path.read_bytes()[:-4000])
    with pytest.raises(sm.InputError, match="expected"):
        Lookup.load(path)


def test_spline_reproduces_straight_lines_and_converges_with_fourth_order() -> None:
    def error(cells: int) -> float:
        axis, other = Axis(-1.0, 2 / cells, cells), Axis(0.0, 1.0, 4)
        values = np.cos(2 * axis.nodes)[:, None] * np.ones(5)
        x = np.linspace(-0.5, 0.5, 301)
        found = evaluate((axis, other), fit(other, fit(axis, values, 0), 1), x, 1.7)
        return float(np.abs(found - np.cos(2 * x)).max())

    assert error(80) < error(40) / 12
    axis, other = Axis(-1.0, 0.25, 8), Axis(0.0, 1.0, 4)
    line = 3 * axis.nodes[:, None] - 2 * other.nodes
    x = np.linspace(-5, 5, 31)
    assert evaluate((axis, other), fit(other, fit(axis, line, 0), 1), x, 1.3) == pytest.approx(3 * x - 2.6, abs=1e-12)
