"""The gear's true profile and the forces of inertia, against the geometry itself."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.contact.element_contacts import build_contacts
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
