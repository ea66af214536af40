"""Contact pressures of virtual drives: forces recovered from the pressures, and the scaling laws of Hertz."""

from __future__ import annotations

import numpy as np
import pytest

import stiffness_model as sm


@pytest.mark.parametrize("name", ["drive_1", "drive_3"])
def test_pressure_over_the_ellipse_is_the_force(name: str) -> None:
    drive = sm.load_drive(name)
    twist = np.array([0.5, 1.0]) * drive.max_twist
    found = sm.contact_pressures(drive, twist, n_drives=20)
    force = 2 / 3 * np.pi * found.pressure * found.major * found.minor
    greatest = sm.simulate(drive, twist, 20).contact_force
    # The crank's curvature hardly scatters, so its greatest pressure and its greatest force are in the same contact.
    assert force[:, :, 1] == pytest.approx(greatest[:, :, 1], rel=2e-3)
    assert (force[:, :, 0] <= greatest[:, :, 0] * (1 + 1e-9)).all()


def test_rollers_have_line_contact() -> None:
    roller = sm.load_drive("drive_1", element="roller", element_length="14 mm")
    twist = [roller.max_twist]
    found = sm.contact_pressures(roller, twist, n_drives=10)
    force = np.pi / 2 * found.pressure * found.minor * 14e-3
    greatest = sm.simulate(roller, twist, 10).contact_force
    assert force[:, :, 1] == pytest.approx(greatest[:, :, 1], rel=1e-3)
    ball = sm.contact_pressures(sm.load_drive("drive_1"), twist, n_drives=10)
    assert (found.pressure[:, :, 1] / force[:, :, 1] < ball.pressure[:, :, 1] / greatest[:, :, 1]).all()


def test_ellipse_in_the_bore_exceeds_the_ball() -> None:
    """Hertz's theory does not hold for the conforming bore, and the semi-axis shows it."""
    drive = sm.load_drive("drive_1")
    found = sm.contact_pressures(drive, [drive.max_twist], n_drives=50)
    assert found.major[:, 0, 2].max() > drive.element_radius
    assert found.major[:, 0, :2].max() < drive.element_radius / 10


def test_bad_input() -> None:
    with pytest.raises(sm.InputError, match="finite twists"):
        sm.contact_pressures(sm.load_drive("drive_1"), [np.nan])
    with pytest.raises(sm.InputError, match="at least one drive"):
        sm.contact_pressures(sm.load_drive("drive_1"), [0.001], n_drives=0)
