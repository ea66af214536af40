"""Peak pressures over a turn against whole drives solved angle by angle, and limiting cases."""

from __future__ import annotations

import math
from dataclasses import fields

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.contact.element_contacts import build_contacts
from stiffness_model.contact.usable_elements import is_usable
from stiffness_model.drawing import sampling
from stiffness_model.drawing.sampling import Deviations
from stiffness_model.equilibrium.closed_form import solve
from stiffness_model.ratings import peak_pressure
from stiffness_model.ratings.peak_pressure import peak_pressures, smallest_lobe_distances
from stiffness_model.ratings.pressure import max_per_drive
from stiffness_model.rotation import Individual
from stiffness_model.rotation.element_positions import Window, element_positions, low_discrepancy_angles


def virtual_drive(drive: sm.Drive, seed: int) -> Individual:
    """The first virtual drive of a seed with all its lobes, as an individual. The order of the lobes in their row does
    not matter, since every element meets all of them.
    """
    drawn = sampling.draw(drive, 0, 1, seed)
    tight, rows = smallest_lobe_distances(drive, drawn, 0, seed)[0], drive.eccentrics
    lobe = np.empty((rows, drive.lobes))
    for row in range(rows):
        near = np.abs(drawn.beta[0, row::rows]).argsort(kind="stable")[: drive.lobes]
        faced = drawn.gear[0, row::rows][near]
        lobe[row, : len(faced)] = faced
        lobe[row, len(faced) :] = tight[row] if tight[row] < faced.min() else faced.max()
    return Individual(drive, float(drawn.beta[0, 0]), drawn.element[0], drawn.crank[0], drawn.cage[0], lobe)


def turned_through(drive: sm.Drive, seed: int, twist: float, angles: int) -> np.ndarray:
    """Greatest pressures, (3,) Pa, of a whole drive over many angles of a turn, with every lobe in its place."""
    one, found = virtual_drive(drive, seed), []
    for angle in np.array_split(low_discrepancy_angles(angles), max(1, angles // 300)):
        at = element_positions(one, Window(math.pi, math.pi, drive.elements), angle)
        parts = Deviations(
            at.beta, one.element[at.element], one.crank[at.element], one.cage[at.element], one.lobe[at.row, at.lobe]
        )
        keep = is_usable(drive, at.beta)
        contacts = build_contacts(drive, parts)[keep.ravel()]
        some = Deviations(*(getattr(parts, f.name)[keep] for f in fields(Deviations)))
        result = solve(contacts, [twist * drive.ratio])
        found.append(max_per_drive(drive, contacts, some, result, np.nonzero(keep)[0], len(keep))[0].max(axis=0)[0])
    return np.max(found, axis=0)


@pytest.mark.slow
@pytest.mark.parametrize(("name", "lobes"), [("drive_1", 30), ("drive_2", 28)])
def test_peak_pressures_are_those_of_a_whole_turn(name: str, lobes: int) -> None:
    drive = sm.load_drive(name, lobes=lobes)
    turned = turned_through(drive, 3, drive.max_twist, 6000)
    found = peak_pressures(drive, [drive.max_twist], 1, 3).pressure[0, 0]
    assert found[1] == pytest.approx(turned[1], rel=1e-3)
    # At the gear the pressure has its maximum at the very end of the profile, which few of the angles approach.
    assert 0 <= found[0] / turned[0] - 1 < 0.02
    assert found[2] == pytest.approx(turned[2], rel=0.015)


@pytest.mark.parametrize(
    ("name", "extra"),
    [
        ("drive_1", {"bearing_stiffness": "250 N/um"}),
        ("drive_2", {"bearing_stiffness": "250 N/um", "housing_stiffness": "80 N.m/arcmin"}),
    ],
)
def test_pressures_of_coupled_elements_are_conservative(name: str, extra: dict[str, str]) -> None:
    drive = sm.load_drive(name, **extra)
    worst = turned_through(drive, 1, drive.max_twist, 600)
    found = peak_pressures(drive, [drive.max_twist], 1, 1).pressure[0, 0]
    assert (found[:2] > 0.99 * worst[:2]).all()
    assert (found[:2] < 1.07 * worst[:2]).all()


@pytest.mark.parametrize(
    ("name", "extra"),
    [
        ("drive_1", {}),
        ("drive_2", {"lobes": 28}),
        ("drive_3", {}),
        ("drive_2", {"cage_offset": 0.0}),
        ("drive_1", {"element": "roller", "element_length": "12 mm"}),
        ("drive_1", {"crank_deviation": "eccentric"}),
        ("drive_1", {"cage_contact": "lamina", "ring_stiffness": "500 N/um"}),
        ("drive_2", {"elements": 42}),
    ],
)
def test_no_drive_at_rest_exceeds_its_peak_pressure(name: str, extra: dict[str, object]) -> None:
    drive = sm.load_drive(name, **extra)
    twist = np.array([0.0, 0.2, 0.6, 1.0]) * drive.max_twist
    standing, turning = (f(drive, twist, 20, 1).pressure for f in (sm.contact_pressures, peak_pressures))
    assert (turning[..., :2] >= standing[..., :2] * (1 - 2e-3)).all()
    assert (turning[..., 2] >= standing[..., 2] * (1 - 2e-2)).all()
    assert (turning[:, -1, 1] > 1.01 * standing[:, -1, 1]).mean() > 0.5


@pytest.mark.slow
@pytest.mark.parametrize("name", ["drive_1", "drive_3"])
def test_the_number_of_positions_and_twists_matters_little(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    drive = sm.load_drive(name)
    twist = np.linspace(0.1, 1.0, 12) * drive.max_twist
    coarse = peak_pressures(drive, twist, 20)
    monkeypatch.setattr(peak_pressure, "POSITIONS", 145)
    fine = peak_pressures(drive, twist, 20)
    assert np.abs(coarse.pressure / fine.pressure - 1)[..., :2].max() < 1e-3
    assert np.abs(coarse.pressure / fine.pressure - 1)[..., 2].max() < 0.015
    alone = peak_pressures(drive, twist[4:5], 5, cage=False)
    np.testing.assert_allclose(alone.pressure[:, 0, :2], fine.pressure[:5, 4, :2], rtol=1e-12)
    assert np.isnan(alone.pressure[..., 2]).all()


@pytest.mark.parametrize(("lobes", "expected"), [(30, -2.0428), (28, -2.0137)])
def test_smallest_distance_of_a_row_s_lobes(lobes: int, expected: float) -> None:
    """Expected minimum of n standard normal numbers (Harter 1961, table of expected values of order statistics)."""
    drive = sm.load_drive("drive_1", lobes=lobes)
    least = np.concatenate([smallest_lobe_distances(drive, sampling.draw(drive, k, 16, 0), k, 0) for k in range(100)])
    deviate = (least - drive.element_radius) / drive.tolerances["gear"].sigma
    assert deviate.mean() == pytest.approx(expected, abs=4 * deviate.std() / math.sqrt(deviate.size))


def test_peak_pressures_without_tolerances_are_the_envelope_over_positions() -> None:
    exact = {
        f"{part}_{kind}": "0 um" for part in ("element", "crank", "cage", "gear") for kind in ("tolerance", "offset")
    }
    drive = sm.load_drive("drive_1", **exact)
    many = sm.contact_pressures(drive, [drive.max_twist], 100).pressure.max(axis=0)  # of 4400 places
    found = peak_pressures(drive, [drive.max_twist], 3).pressure
    assert np.ptp(found, axis=0).max() == 0
    assert found[0, :, :2] == pytest.approx(many[:, :2], rel=2e-3)


def test_bad_input() -> None:
    with pytest.raises(sm.InputError, match="finite twists"):
        peak_pressures(sm.load_drive("drive_1"), [np.nan])
    with pytest.raises(sm.InputError, match="at least one drive"):
        peak_pressures(sm.load_drive("drive_1"), [0.001], n_drives=0)
