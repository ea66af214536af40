"""The gear's true profile and the forces of inertia, against the geometry itself."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.contact.element_contacts import build_contacts
from stiffness_model.contact.inertia import element_mass, inertia_force
from stiffness_model.contact.usable_elements import is_usable
from stiffness_model.drawing import sampling
from stiffness_model.equilibrium.closed_form import solve
from stiffness_model.geometry.exact_profile import GearProfile


@pytest.mark.parametrize("lobes", [28, 30])
def test_the_nearest_point_is_nearest(lobes: int) -> None:
    """On the gear's own profile (`Path.point`), for a centre placed anywhere near it."""
    drive = sm.load_drive("drive_1", lobes=lobes)
    path, side = drive.path, drive.orientation
    profile = GearProfile(path, side, 1e-11, None)
    beta = np.linspace(-1.5, 1.5, 31)
    x = 1e-4 * np.random.default_rng(3).uniform(-1, 1, (2, len(beta)))
    foot = profile.nearest_point(beta, x, beta, steps=6)
    # Element's frame in the gear's: turned by side beta/z.
    angle = side * beta / lobes
    radial = np.stack([np.cos(angle), np.sin(angle)])
    centre = (path.radius(beta) + x[0]) * radial + x[1] * np.stack([-radial[1], radial[0]])
    for j, at in enumerate(beta):
        along = np.linspace(at - 0.2, at + 0.2, 40001)
        points = path.point(along)
        points[:, 1] *= side
        distance = np.hypot(*(points.T - centre[:, j, None]))
        k = distance.argmin()
        signed = foot.normal_r[j] * x[0, j] + foot.normal_t[j] * x[1, j] - foot.offset[j]
        assert abs(signed) == pytest.approx(distance[k], abs=2e-10)
        assert foot.beta[j] == pytest.approx(along[k], abs=2e-5)
    n_r, n_t = path.normal(beta, side)
    at_rest = profile.nearest_point(beta, np.zeros_like(x), beta)
    np.testing.assert_allclose([at_rest.normal_r, at_rest.normal_t], [n_r, n_t], atol=1e-14)
    np.testing.assert_allclose(at_rest.offset, 0, atol=1e-17)


def test_the_papers_linear_gap_is_the_first_term() -> None:
    """The rest is curvature times half the square of the displacement along the path, and a cubic remainder."""
    drive = sm.load_drive("drive_1")
    profile, beta = GearProfile(drive.path, drive.orientation, 1e-11, None), np.linspace(-1.4, 1.4, 15)
    n_r, n_t = drive.path.normal(beta, drive.orientation)
    left = []
    for size in (4e-5, 2e-5, 1e-5):
        x = size * np.stack([0.3 * n_r - n_t, 0.3 * n_t + n_r])
        foot = profile.nearest_point(beta, x, beta, steps=6)
        exact = foot.normal_r * x[0] + foot.normal_t * x[1] - foot.offset
        second = 0.3 * size + 0.5 * drive.path.curvature(beta) * size**2
        left.append(np.abs(exact - second).max() / size**3)
    assert max(left) < 1.3 * min(left)


@pytest.mark.parametrize(("name", "most"), [("drive_1", 0.004), ("drive_2", 0.01), ("drive_3", 0.04)])
def test_the_linearised_gear_is_wrong_by_little(name: str, most: float) -> None:
    drive = sm.load_drive(name)
    twist = np.array([0.25, 0.5, 1.0]) * drive.max_twist
    plain = sm.simulate(drive, twist, 48).torque.mean(axis=0)
    exact = sm.simulate(sm.load_drive(name, gear_contact="exact"), twist, 48).torque.mean(axis=0)
    error = np.abs(exact / plain - 1)
    assert 1e-4 < error.max() < most


def test_a_tiny_element_displacement_makes_no_difference() -> None:
    drive, exact = (sm.load_drive("drive_1", gear_contact=kind) for kind in ("linear", "exact"))
    deviations = dataclasses.replace(sampling.nominal(drive))
    keep = is_usable(drive, deviations.beta).ravel()
    twist = [1e-4 * drive.max_twist * drive.ratio]
    one, other = (solve(build_contacts(d, deviations)[keep], twist) for d in (drive, exact))
    np.testing.assert_allclose(other.output_torque, one.output_torque, rtol=1e-3, atol=1e-4 * one.output_torque.max())


@pytest.mark.parametrize("lobes", [28, 30])
def test_inertia_is_mass_times_the_acceleration_of_the_orbit(lobes: int) -> None:
    """Positions in the fixed frame over time, differenced twice."""
    drive = sm.load_drive("drive_1", lobes=lobes, inertia="on", crank_speed="3000 rpm")
    speed, h = drive.beyond.crank_speed, 2e-6
    beta = np.linspace(-1.5, 1.5, 13)
    cage = speed / drive.ratio

    def place(time: float) -> np.ndarray:
        # The element's own angle is that of the cage; beta is the crank's angle past it.
        own, crank = cage * time, beta + speed * time
        return drive.path.radius(crank - own) * np.exp(1j * own)

    acceleration = (place(h) - 2 * place(0.0) + place(-h)) / h**2
    force = -element_mass(drive, np.full(13, 7e-3)) * acceleration
    ours = inertia_force(drive, beta, np.full(13, 7e-3))
    np.testing.assert_allclose(ours, np.stack([force.real, force.imag], axis=1), atol=2e-5)
    assert ours[6, 0] == pytest.approx(0.9, abs=0.12)


def test_inertia_goes_with_the_square_of_the_speed_and_needs_its_switch() -> None:
    beta, radius = np.array([0.3, 1.0]), np.full(2, 7e-3)
    slow, fast = (
        inertia_force(sm.load_drive("drive_2", inertia="on", crank_speed=v), beta, radius) for v in (100.0, 300.0)
    )
    np.testing.assert_allclose(fast, 9 * slow, rtol=1e-12)
    assert not np.any(inertia_force(sm.load_drive("drive_2", crank_speed=300.0), beta, radius))


def test_a_roller_as_long_as_it_is_thick_weighs_three_halves_of_its_ball() -> None:
    """Archimedes, On the Sphere and Cylinder; and a ball of 14 mm and 7810 kg/m3 weighs 11.2 g."""
    radius = np.array([5e-3, 7e-3])
    ball = element_mass(sm.load_drive("drive_1"), radius)
    roller = [
        element_mass(sm.load_drive("drive_1", element="roller", element_length=2 * r), np.array(r)) for r in radius
    ]
    np.testing.assert_allclose(roller, 1.5 * ball, rtol=1e-12)
    assert ball[1] == pytest.approx(11.22e-3, rel=1e-3)
