"""Torques of single elements along a path, against maps of the same individual."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from stiffness_model import load_drive
from stiffness_model.rotation import draw_individual, turning_map
from stiffness_model.rotation.element_torques import ElementPath, Places, Steps, element_path

DRIVE = load_drive("drive_3")
ONE = draw_individual(DRIVE, 4)
OUTPUT = np.linspace(0.0, 0.3, 40)
TWIST = DRIVE.max_twist * np.cos(np.linspace(0, 9, 40))


def total(path: ElementPath) -> np.ndarray:
    return path.torque.sum(axis=1)


@pytest.mark.parametrize("clearance", [0.0, 4e-6])
def test_the_elements_carry_the_torque_of_the_map(clearance: float) -> None:
    expected = np.diag(turning_map(ONE, TWIST, OUTPUT, clearance=clearance).torque)
    for given in (clearance, np.full(len(TWIST), clearance)):
        found = total(element_path(ONE, OUTPUT, TWIST, given))
        np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_bores_and_lobes_all_beside_their_places_are_another_path() -> None:
    """All bores ahead: the output need not turn as far while the crank stands. Lobes ahead: it turns farther."""
    ahead = 2e-4
    none = Places(np.zeros(DRIVE.elements), np.zeros(ONE.lobe.shape))
    bores, lobes = replace(none, bore=none.bore + ahead), replace(none, lobe=none.lobe + ahead)
    np.testing.assert_array_equal(
        total(element_path(ONE, OUTPUT, TWIST, 0.0, none)), total(element_path(ONE, OUTPUT, TWIST))
    )
    found = total(element_path(ONE, OUTPUT, TWIST, 0.0, bores))
    np.testing.assert_allclose(found, total(element_path(ONE, OUTPUT + ahead, TWIST - ahead)), rtol=1e-9, atol=1e-9)
    # A gear that is turned by an angle against the frame: the crank stands, and has turned past the gear by less.
    ratio = DRIVE.ratio
    found = total(element_path(ONE, OUTPUT, TWIST, 0.0, lobes))
    expected = total(element_path(ONE, OUTPUT - ahead, TWIST + (1 - 1 / ratio) * ahead))
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("part", ["crank", "cage", "gear"])
def test_changes_are_those_of_an_individual_with_other_parts(part: str) -> None:
    step = 1e-8
    path = element_path(ONE, OUTPUT, TWIST)
    name = {"gear": "lobe"}.get(part, part)
    other = replace(ONE, **{name: getattr(ONE, name) + step})
    expected = total(element_path(other, OUTPUT, TWIST)) - total(path)
    found = path.changes([Steps(**{part: step})])[0].sum(axis=1)
    # The step changes gaps; the change of the contact stiffness is left out.
    assert np.abs(found - expected).max() < 2e-3 * np.abs(expected).max()


def test_changes_of_position_and_twist_are_those_of_other_paths() -> None:
    step, path = 1e-7, element_path(ONE, OUTPUT, TWIST)
    by_position, by_twist = path.changes([Steps(position=step), Steps(twist=step)]).sum(axis=2)
    moved = total(element_path(replace(ONE, start=ONE.start + step), OUTPUT, TWIST)) - total(path)
    twisted = total(element_path(ONE, OUTPUT, TWIST + step)) - total(path)
    for found, expected in ((by_position, moved), (by_twist, twisted)):
        assert np.abs(found - expected).max() < 1e-4 * np.abs(expected).max()
