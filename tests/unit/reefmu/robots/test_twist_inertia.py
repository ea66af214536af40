"""The derivation of the added inertia, against the eigenvalues of the step that it describes."""

from __future__ import annotations

import math

import numpy as np
import pytest

from reefmu.robots.twist_inertia import SAFE_PHASE, largest_time_step, numerical_frequency, twist_armature
from stiffness_model.errors import InputError


def multipliers(masses: np.ndarray, stiffness: np.ndarray, step: float) -> np.ndarray:
    """Eigenvalues of one step of the symplectic Euler method for M a = -K q."""
    n = len(masses)
    kick = -step * np.linalg.solve(masses, stiffness)
    whole = np.block([[np.eye(n) + step * kick, step * np.eye(n)], [kick, np.eye(n)]])
    return np.linalg.eigvals(whole)


def test_robots_of_any_inertia_with_several_drives_are_stable() -> None:
    """Random mass matrices of three joints, down to links without inertia, in the coordinates theta and delta."""
    rng, step, springs = np.random.default_rng(0), 2e-3, np.array([3e5, 1e5, 2e4])
    added = np.array([twist_armature(k, step) for k in springs])
    worst = 0.0
    for _ in range(200):
        roots = rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-4, 0.5)
        links, rotors = roots @ roots.T, np.diag(10.0 ** rng.uniform(-3, 0, 3))
        masses = np.block([[links + rotors, links], [links, links + np.diag(added)]])
        stiffness = np.diag([0, 0, 0, *springs])
        phases = np.linalg.eigvals(np.linalg.solve(masses, stiffness)).real * step**2
        worst = max(worst, phases.max())
        found = multipliers(masses, stiffness, step)
        assert np.abs(found).max() < 1 + 1e-6  # the motions without a spring have double eigenvalues at 1
    assert 0.9 * SAFE_PHASE < worst < SAFE_PHASE


@pytest.mark.parametrize("armature", [0.0, 0.05])
def test_largest_step_is_where_an_eigenvalue_leaves_the_unit_circle(armature: float) -> None:
    limit = largest_time_step(3e5, 0.08, armature=armature)
    for factor, stable in ((0.999, True), (1.001, False)):
        found = multipliers(np.array([[0.08 + armature]]), np.array([[3e5]]), factor * limit)
        assert (np.abs(found).max() < 1 + 1e-9) == stable


def test_a_known_inertia_gives_the_frequency_to_fourth_order() -> None:
    exact = math.sqrt(3e5 / 0.08)
    steps = np.array([2e-4, 1e-4])
    errors = [
        numerical_frequency(h, 3e5, 0.08, armature=twist_armature(3e5, h, inertia=0.08)) / exact - 1 for h in steps
    ]
    assert errors[0] / errors[1] == pytest.approx(16, rel=0.1)
    assert abs(numerical_frequency(1e-4, 3e5, 0.08) / exact - 1) > 10 * abs(errors[1])
    angle = np.abs(np.angle(multipliers(np.array([[0.08]]), np.array([[3e5]]), 2e-4)[0]))
    assert numerical_frequency(2e-4, 3e5, 0.08) == pytest.approx(angle / 2e-4)


def test_values_out_of_range_are_refused() -> None:
    with pytest.raises(InputError, match="positive stiffness"):
        twist_armature(-1.0, 1e-3)
    with pytest.raises(InputError, match="positive inertia"):
        largest_time_step(1e5, 0.0)
