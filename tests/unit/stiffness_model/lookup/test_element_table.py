"""Torque of one element: against single elements of virtual drives, against whole drives, and its derivatives."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.contact.element_contacts import build_contacts
from stiffness_model.drawing import sampling
from stiffness_model.drawing.sampling import Deviations
from stiffness_model.drawing.twist_limits import clearance_deviation
from stiffness_model.equilibrium.closed_form import solve
from stiffness_model.lookup.build_lookup import mean_torque
from stiffness_model.lookup.element_table import FADE_HALF_WIDTH, ElementTable, build_element_table


@pytest.fixture(scope="module")
def table(drive: sm.Drive) -> ElementTable:
    return build_element_table(drive)


@pytest.mark.parametrize("position", [0.3, 0.8, 1.2, 1.55, -0.8, -1.5])
@pytest.mark.parametrize("clearance", [0.0, 8e-6, -8e-6])
def test_table_is_the_mean_over_drawn_elements(
    position: float, clearance: float, drive: sm.Drive, table: ElementTable
) -> None:
    drawn = [sampling.draw(drive, block, 16, 5) for block in range(6)]
    radii = {
        part: np.concatenate([getattr(d, part).ravel() for d in drawn]) for part in ("element", "crank", "cage", "gear")
    }
    elements = Deviations(np.full(radii["gear"].shape, position), **radii)
    twist = np.array([-1.0, -0.4, 0.4, 1.0, 1.8]) * drive.max_twist
    torque = solve(build_contacts(drive, elements, clearance), twist * drive.ratio).output_torque
    error = 4 * torque.std(axis=1) / np.sqrt(torque.shape[1])
    assert (np.abs(table.torque(twist, clearance, position) - torque.mean(axis=1)) < error + 0.1).all()


def test_a_clearance_that_wide_tolerances_allow_is_within_the_table() -> None:
    drive = sm.load_drive("drive_2")
    table = build_element_table(drive)
    twist, clearance = np.linspace(-1, 1, 9) * drive.max_twist, 4.5 * clearance_deviation(drive)
    around = np.linspace(-np.pi, np.pi, 2001)[:-1]
    whole = drive.elements * table.torque(twist[:, None], clearance, around).mean(axis=1)
    solved = mean_torque(drive, twist, clearance)
    assert whole == pytest.approx(solved, abs=4e-3 * np.abs(solved).max())


@pytest.mark.parametrize("fields", [{}, {"lobes": 28}, {"element": "roller", "element_length": "10 mm"}], ids=str)
def test_the_sum_over_all_positions_is_the_drive_s_torque(fields: dict) -> None:
    drive = sm.load_drive("drive_1", **fields)
    table = build_element_table(drive)
    assert table.error < 3e-4
    twist = np.linspace(-1, 1, 9) * drive.max_twist
    around = np.linspace(-np.pi, np.pi, 2001)[:-1]
    for clearance in (0.0, 6e-6):
        whole = drive.elements * table.torque(twist[:, None], clearance, around).mean(axis=1)
        drives = sm.simulate(drive, twist, 200, clearance=clearance).torque.mean(axis=0)
        assert whole == pytest.approx(drives, abs=4e-3 * np.abs(drives).max())


def test_no_torque_where_the_profile_is_cut_away(drive: sm.Drive, table: ElementTable) -> None:
    beyond = np.array([drive.usable_limit + FADE_HALF_WIDTH, 2.0, 3.0, np.pi, 4.0, -2.0])
    assert (table.torque(drive.max_twist, 0.0, beyond) == 0).all()
    inside = drive.usable_limit - FADE_HALF_WIDTH
    assert table.torque(drive.max_twist, 0.0, inside) > 20


def test_odd_in_twist_and_position_and_periodic(drive: sm.Drive, table: ElementTable) -> None:
    rng = np.random.default_rng(0)
    twist, position = rng.uniform(-2, 2, 300) * drive.max_twist, rng.uniform(-3, 3, 300)
    torque = table.torque(twist, 2e-6, position)
    assert np.array_equal(table.torque(-twist, 2e-6, -position), -torque)
    assert table.torque(twist, 2e-6, position + 4 * np.pi) == pytest.approx(torque, abs=1e-9)


def test_derivatives_are_exact(drive: sm.Drive, table: ElementTable) -> None:
    rng = np.random.default_rng(1)
    twist, clearance = rng.uniform(-2.3, 2.3, 500) * drive.max_twist, rng.uniform(-1.2, 1.2, 500) * table.clearance.stop
    point = [twist, clearance, rng.uniform(-7, 7, 500)]
    slopes = table.evaluate(*point)[1:]
    for k, step in enumerate((1e-8, 1e-11, 1e-7)):
        up, down = ([v + sign * step * (i == k) for i, v in enumerate(point)] for sign in (1, -1))
        difference = (table.torque(*up) - table.torque(*down)) / (2 * step)
        assert difference == pytest.approx(slopes[k], abs=1e-7 * np.abs(slopes[k]).max())


def test_a_saved_table_is_loaded_unchanged(table: ElementTable, tmp_path: Path) -> None:
    table.save(tmp_path / "table.npz")
    again = ElementTable.load(tmp_path / "table.npz")
    assert np.array_equal(again.coefficients, table.coefficients)
    assert again.header() == table.header()
    (tmp_path / "table.npz").write_bytes(b"no table")
    with pytest.raises(sm.InputError, match="expected a saved element table"):
        ElementTable.load(tmp_path / "table.npz")
