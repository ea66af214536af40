"""Pressure limits and the bearings' rating life: published numbers, definitions, and who refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model import ARCMIN
from stiffness_model.beyond.life import bearing_forces, bearing_life
from stiffness_model.beyond.strength import check_strength, pressure_limits

TWIST = np.array([0.0, 2.0, 4.0, 6.0, 8.0]) * ARCMIN


def test_limits_of_iso_76_and_of_the_drawing() -> None:
    roller = sm.load_drive("drive_1", element="roller", element_length="10 mm")
    assert pressure_limits(roller) == pytest.approx([4000e6] * 3)
    printed = pressure_limits(sm.load_drive("drive_3"))
    assert printed[1] == 4200e6
    assert np.isnan(printed[[0, 2]]).all()
    stated = pressure_limits(sm.load_drive("drive_3", gear_pressure_limit="90 MPa", cage_pressure_limit=80e6))
    assert stated == pytest.approx([90e6, 4200e6, 80e6])


def test_safety_over_torque() -> None:
    drive = sm.load_drive("drive_1")
    strength = check_strength(drive, TWIST, 24)
    pressures = sm.contact_pressures(drive, TWIST, 24)
    np.testing.assert_allclose(strength.safety[:, 1:, :2], 4200e6 / pressures.pressure[:, 1:, :2])
    np.testing.assert_allclose(strength.load_safety[:, 1:], strength.safety[:, 1:] ** 3)
    assert (np.diff(strength.least()[1:]) < 0).all()
    assert set(strength.governing()) <= {"gear", "crank", "cage", ""}
    # The crank has no hollow to hold the ball: it governs, and 4200 MPa are reached within the paper's range.
    assert strength.governing()[-1] == "crank"
    torque = sm.simulate(drive, TWIST, 24).torque.mean(axis=0)
    permissible = strength.permissible(torque)
    assert torque[3] < permissible < torque[4]
    at = np.interp(permissible, torque, TWIST)
    assert check_strength(drive, [at], 24).least()[0] == pytest.approx(1, abs=0.01)
    assert math.isnan(
        check_strength(drive, TWIST[:2], 24).permissible(torque[:2]))


def test_load_safety_is_in_terms_of_the_load() -> None:
    """One ball: the force at which its pressure reaches the limit is the force times the load safety."""
    drive = sm.load_drive("drive_1", elements=1, eccentrics=1)
    strength = check_strength(drive, TWIST[[4]], 30)
    force = sm.simulate(drive, TWIST[[4]], 30).contact_force[:, 0, 1]
    loaded = force > 0
    expected = force[loaded] * strength.load_safety[loaded, 0, 1]
    assert np.ptp(expected) < 0.01 * expected.mean()  # the load of 4200 MPa, the same for all


def test_without_a_limit_there_is_no_safety() -> None:
    strength = check_strength(sm.load_drive("drive_3"), [20 * ARCMIN], 8)
    assert np.isnan(strength.safety[..., [0, 2]]).all()
    assert strength.governing() == ["crank"]  # the only one known
    unknown = sm.Material("POM", 2.8e9, 0.35, 1410.0)
    all_plastic = sm.load_drive("drive_3", crank_material=unknown)
    nothing = check_strength(all_plastic, [20 * ARCMIN], 8)
    assert np.isnan(nothing.least()).all()
    assert nothing.governing() == [""]


def test_bearing_forces_are_the_reaction_to_the_crank_s_torque() -> None:
    """The part across the eccentricity makes the torque; at 250 N/um the shift carries the same force."""
    drive = sm.load_drive("drive_1")
    force, torque = bearing_forces(drive, TWIST, 24)
    assert force.shape == (24, 3, 5)
    population = sm.simulate(drive, TWIST, 24)
    np.testing.assert_allclose(torque, population.torque, rtol=1e-12)
    across = np.abs(population.crank_torque) / (3 * drive.eccentricity)
    ratio = force[..., -1].mean() / across[:, -1].mean()
    assert 1.05 < ratio < 1.4
    soft = sm.load_drive("drive_1", bearing_stiffness="250 N/um")
    from stiffness_model.beyond.blocks import solved_blocks
    block = next(solved_blocks(soft, TWIST[[4]], 1, 0))
    shift = np.hypot(*block.result.centre_shift[:, 0])  # type: ignore[attr-defined]
    by_shift = [2.5e8 * shift[block.eccentric == k].mean() for k in range(3)]
    np.testing.assert_allclose(bearing_forces(soft, TWIST[[4]], 1)[0][0, :, 0], by_shift, rtol=1e-7)


def test_life_of_iso_281() -> None:
    ball, roller = (sm.load_drive("drive_1", bearing_capacity="40 kN", bearing_type=kind, crank_speed="1500 rpm")
                    for kind in ("ball", "roller"))
    life = bearing_life(ball, TWIST[1:], 24)
    assert life.revolutions == pytest.approx(1e6 * (40e3 / life.load) ** 3)
    assert life.hours == pytest.approx(life.together / (1500 * 60))
    assert life.together == pytest.approx(life.revolutions * 3 ** -0.9)
    assert bearing_life(roller, TWIST[1:], 24).revolutions == pytest.approx(
        1e6 * (40e3 / bearing_life(roller, TWIST[1:], 24).load) ** (10 / 3))
    # The mean of order 3 is above the plain mean, and half the load lives eight times as long.
    force = bearing_forces(ball, TWIST[1:], 24)[0]
    assert (life.load > force.mean(axis=(0, 1))).all()
    assert np.isnan(bearing_life(sm.load_drive("drive_1", bearing_capacity="40 kN"), TWIST[1:], 4).hours).all()
    assert life.valid.all()
    assert not bearing_life(sm.load_drive("drive_1", bearing_capacity="8 kN"), TWIST[[4]], 4).valid.any()
    with pytest.raises(sm.InputError, match="dynamic load rating"):
        bearing_life(sm.load_drive("drive_1"), TWIST, 4)
