"""The scale of the torque with another modulus, against the solver with that modulus."""

from __future__ import annotations

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.lookup.modulus import BOUNDS, modulus_shares, with_modulus


@pytest.mark.parametrize(
    ("preset", "fields"),
    [
        ("drive_1", {}),
        ("drive_2", {"lobes": 28}),
        ("drive_3", {}),
        ("drive_1", {"element": "roller", "element_length": "10 mm"}),
        ("drive_1", {"cage_material": "PLA"}),
    ],
    ids=str,
)
def test_scaled_torque_is_that_of_the_solver(preset: str, fields: dict) -> None:
    drive = sm.load_drive(preset, **fields)
    shares = modulus_shares(drive)
    assert shares.error < (1.5e-2 if fields.get("cage_material") else 8e-3)
    twist = np.linspace(-1, 1, 11) * drive.max_twist
    drawn = sm.simulate(drive, twist, 32, seed=3).torque.mean(axis=0)
    for error, bound in ((BOUNDS[0], 1.5e-3), (-0.2, 3e-4), (0.1, 2e-4), (BOUNDS[1], 1.5e-3)):
        other = sm.simulate(with_modulus(drive, error), twist, 32, seed=3).torque.mean(axis=0)
        assert shares.scale(error) * drawn == pytest.approx(other, abs=bound * other.max()), error
        assert (other[-1] > drawn[-1]) == (error > 0)


def test_without_an_error_the_scale_is_exactly_one() -> None:
    for preset in ("drive_1", "drive_2", "drive_3", "workshop"):
        assert modulus_shares(sm.load_drive(preset)).scale(0.0) == 1.0


def test_the_crank_s_contact_keeps_its_stiffness() -> None:
    drive = sm.load_drive("drive_1")
    shares = modulus_shares(drive)
    assert 0.4 < shares.gear + shares.cage < 0.6
    # With rigid gear and cage only the crank's contact and the elements are compliant.
    assert shares.scale(1e9) < (1 - 0.6 * 0.4) ** -1.5
    soft = with_modulus(drive, -0.5)
    assert soft.materials["crank"] == drive.materials["crank"]
    assert soft.materials["element"] == drive.materials["element"]
    assert soft.materials["gear"].youngs_modulus == drive.materials["gear"].youngs_modulus / 2
