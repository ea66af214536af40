"""Inertia forces against the acceleration of the orbit, and the mass of elements."""

from __future__ import annotations

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.contact.inertia import element_mass, inertia_force


@pytest.mark.parametrize("lobes", [28, 30])
def test_inertia_is_mass_times_the_acceleration_of_the_orbit(lobes: int) -> None:
    """Second difference over time of positions in the fixed frame."""
    drive = sm.load_drive("drive_1", lobes=lobes, inertia="on", crank_speed="3000 rpm")
    speed, h = drive.beyond.crank_speed, 2e-6
    beta = np.linspace(-1.5, 1.5, 13)
    cage = speed / drive.ratio

    def position(time: float) -> np.ndarray:
        # The element's own angle is the cage's; beta is the crank's angle minus that.
        own, crank = cage * time, beta + speed * time
        return drive.path.radius(crank - own) * np.exp(1j * own)

    acceleration = (position(h) - 2 * position(0.0) + position(-h)) / h**2
    force = -element_mass(drive, np.full(13, 7e-3)) * acceleration
    ours = inertia_force(drive, beta, np.full(13, 7e-3))
    np.testing.assert_allclose(ours, np.stack([force.real, force.imag], axis=1), atol=2e-5)
    assert ours[6, 0] == pytest.approx(0.9, abs=0.12)


def test_inertia_is_proportional_to_the_square_of_the_speed_and_off_by_default() -> None:
    beta, radius = np.array([0.3, 1.0]), np.full(2, 7e-3)
    slow, fast = (
        inertia_force(sm.load_drive("drive_2", inertia="on", crank_speed=v), beta, radius) for v in (100.0, 300.0)
    )
    np.testing.assert_allclose(fast, 9 * slow, rtol=1e-12)
    assert not np.any(inertia_force(sm.load_drive("drive_2", crank_speed=300.0), beta, radius))


def test_roller_as_long_as_its_diameter_weighs_three_halves_of_the_ball() -> None:
    """The ratio of a cylinder to its inscribed sphere; a ball of 14 mm and 7810 kg/m3 weighs 11.2 g."""
    radius = np.array([5e-3, 7e-3])
    ball = element_mass(sm.load_drive("drive_1"), radius)
    roller = [
        element_mass(sm.load_drive("drive_1", element="roller", element_length=2 * r), np.array(r)) for r in radius
    ]
    np.testing.assert_allclose(roller, 1.5 * ball, rtol=1e-12)
    assert ball[1] == pytest.approx(11.22e-3, rel=1e-3)
