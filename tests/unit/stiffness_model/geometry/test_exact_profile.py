"""The gear's exact profile against a search along the path, and the error of its linearisation."""

from __future__ import annotations

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.contact.usable_elements import usable_elements
from stiffness_model.drawing import sampling
from stiffness_model.equilibrium.closed_form import solve
from stiffness_model.geometry.exact_profile import GearProfile


@pytest.mark.parametrize("lobes", [28, 30])
def test_nearest_point_agrees_with_a_search(lobes: int) -> None:
    """Search along `BallPath.point` for centres anywhere near the path."""
    drive = sm.load_drive("drive_1", lobes=lobes)
    path, side = drive.path, drive.orientation
    profile = GearProfile(path, side, 1e-11, None)
    beta = np.linspace(-1.5, 1.5, 31)
    x = 1e-4 * np.random.default_rng(3).uniform(-1, 1, (2, len(beta)))
    point = profile.nearest_point(beta, x, beta, steps=6)
    # The element's frame is rotated by side beta/z in the gear's.
    angle = side * beta / lobes
    radial = np.stack([np.cos(angle), np.sin(angle)])
    centre = (path.radius(beta) + x[0]) * radial + x[1] * np.stack([-radial[1], radial[0]])
    for j, at in enumerate(beta):
        along = np.linspace(at - 0.2, at + 0.2, 40001)
        curve = path.point(along)
        curve[:, 1] *= side
        distance = np.hypot(*(curve.T - centre[:, j, None]))
        k = distance.argmin()
        signed = point.normal_r[j] * x[0, j] + point.normal_t[j] * x[1, j] - point.offset[j]
        assert abs(signed) == pytest.approx(distance[k], abs=2e-10)
        assert point.beta[j] == pytest.approx(along[k], abs=2e-5)
    n_r, n_t = path.normal(beta, side)
    neutral = profile.nearest_point(beta, np.zeros_like(x), beta)
    np.testing.assert_allclose([neutral.normal_r, neutral.normal_t], [n_r, n_t], atol=1e-14)
    np.testing.assert_allclose(neutral.offset, 0, atol=1e-17)


def test_linear_gap_is_the_first_term_of_the_exact_one() -> None:
    """The second is half the curvature times the square of the displacement along the path; the remainder is cubic."""
    drive = sm.load_drive("drive_1")
    profile, beta = GearProfile(drive.path, drive.orientation, 1e-11, None), np.linspace(-1.4, 1.4, 15)
    n_r, n_t = drive.path.normal(beta, drive.orientation)
    remainder = []
    for size in (4e-5, 2e-5, 1e-5):
        x = size * np.stack([0.3 * n_r - n_t, 0.3 * n_t + n_r])
        point = profile.nearest_point(beta, x, beta, steps=6)
        exact = point.normal_r * x[0] + point.normal_t * x[1] - point.offset
        second = 0.3 * size + 0.5 * drive.path.curvature(beta) * size**2
        remainder.append(np.abs(exact - second).max() / size**3)
    assert max(remainder) < 1.3 * min(remainder)


@pytest.mark.parametrize(("name", "bound"), [("drive_1", 0.004), ("drive_2", 0.01), ("drive_3", 0.04)])
def test_error_of_the_linearised_gear_is_small(name: str, bound: float) -> None:
    drive = sm.load_drive(name)
    twist = np.array([0.25, 0.5, 1.0]) * drive.max_twist
    plain = sm.simulate(drive, twist, 48).torque.mean(axis=0)
    exact = sm.simulate(sm.load_drive(name, gear_contact="exact"), twist, 48).torque.mean(axis=0)
    error = np.abs(exact / plain - 1)
    assert 1e-4 < error.max() < bound


def test_exact_and_linear_gear_agree_at_small_twist() -> None:
    drive, exact = (sm.load_drive("drive_1", gear_contact=kind) for kind in ("linear", "exact"))
    deviations = sampling.nominal(drive)
    twist = [1e-4 * drive.max_twist * drive.ratio]
    one, other = (solve(usable_elements(d, deviations).contacts, twist) for d in (drive, exact))
    np.testing.assert_allclose(other.output_torque, one.output_torque, rtol=1e-3, atol=1e-4 * one.output_torque.max())
