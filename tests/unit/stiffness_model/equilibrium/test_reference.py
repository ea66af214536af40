"""The paper's method checked against itself: Jacobian, root and descent, and equilibria that are not unique."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.contact.element_contacts import Contacts
from stiffness_model.contact.usable_elements import usable_elements
from stiffness_model.drawing import sampling
from stiffness_model.equilibrium.closed_form import solve
from stiffness_model.equilibrium.reference import ElementEquilibrium, solve_element

NUMBERS = [f.name for f in dataclasses.fields(ElementEquilibrium) if f.name != "method"]


def elements(name: str = "drive_1", n: int = 40, **changes) -> Contacts:
    drive = sm.load_drive(name, **changes)
    deviations = sampling.draw(drive, 0, sampling.BLOCK, seed=3)
    return usable_elements(drive, deviations).contacts[slice(0, n)]


@pytest.mark.parametrize("changes", [{}, {"cage_offset": 0.0}, {"element": "roller", "element_length": 0.01}])
def test_descent_and_root_search_agree(changes):
    contacts = elements("drive_2", **changes)
    methods = set()
    for j in range(len(contacts)):
        root, descent = (solve_element(contacts, j, -0.04, descend=way) for way in (False, True))
        methods |= {root.method, descent.method}
        for name in NUMBERS:
            assert getattr(descent, name) == pytest.approx(getattr(root, name), rel=1e-6, abs=1e-12)
    assert methods == {"clearance", "root", "descent"}


def test_descent_converges_from_a_start_without_contact():
    contacts = elements()
    for j in range(10):
        # 0.2 mm off the crank nothing touches, and the Jacobian of the root search is zero.
        found = solve_element(contacts, j, 0.0, external_force=(-25.0, 0.0), start=(2e-4, 0.0))
        expected = solve_element(contacts, j, 0.0, external_force=(-25.0, 0.0))
        assert found.crank == pytest.approx(expected.crank, rel=1e-6)
        assert found.crank > 20


def test_jacobian_is_the_derivative_of_the_force():
    """Eq. 17 with eq. 18 corrected; with eq. 18 as printed the difference would be far larger."""
    from stiffness_model.equilibrium.reference import _element

    element = _element(elements("drive_3"), 7, -0.1, (3.0, -2.0))
    x, h = (4e-5, 9e-5), 1e-10
    columns = [
        (
            np.array(element.total_force((x[0] + h * a, x[1] + h * b)))
            - element.total_force((x[0] - h * a, x[1] - h * b))
        )
        / (2 * h)
        for a, b in ((1, 0), (0, 1))
    ]
    np.testing.assert_allclose(element.jacobian(x), np.array(columns).T, rtol=1e-6)
    slope = [
        -(element.energy((x[0] + h * a, x[1] + h * b)) - element.energy((x[0] - h * a, x[1] - h * b))) / (2 * h)
        for a, b in ((1, 0), (0, 1))
    ]
    np.testing.assert_allclose(element.total_force(x), slope, rtol=1e-5)


def test_two_equilibria_where_crank_and_gear_are_parallel():
    """Near beta = 0 a squeezed element is stable at either wall; both solvers take the side to which it is pushed."""
    base = elements(n=1)
    one = np.ones(1)
    contacts = dataclasses.replace(
        base,
        beta=1e-5 * one,
        path_radius=48.7e-3 * one,
        normal_r=one,
        normal_t=-1.5e-5 * one,
        gear_gap=-8e-6 * one,
        cage_gap=3e-6 * one,
        radius_sum=48e-3 * one,
    )
    left, right = (solve_element(contacts, 0, 0.0, start=(-4e-6, side * 3e-6)) for side in (-1, 1))
    assert left.cage_minus > 0 == left.cage_plus
    assert right.cage_plus > 0 == right.cage_minus
    pushed = solve_element(contacts, 0, 0.0)
    assert pushed == right or pushed.cage_plus == pytest.approx(right.cage_plus, rel=1e-9)
    ours = solve(contacts, 0.0)
    assert ours.cage_plus[0, 0] == pytest.approx(right.cage_plus, rel=1e-8)
    assert ours.cage_minus[0, 0] == 0


def test_clearance_is_recognised_by_geometry():
    contacts = elements()
    found = [solve_element(contacts, j, -0.04) for j in range(len(contacts))]
    unloaded = [f for f in found if f.method == "clearance"]
    assert 0.3 < len(unloaded) / len(found) < 0.7
    assert all(f.gear == f.crank == f.output_torque == 0 for f in unloaded)


def test_missing_equilibrium_is_reported():
    contacts = dataclasses.replace(elements(n=1), stiffness_gear=np.array([np.nan]), gear_gap=np.array([-1e-5]))
    found = solve_element(contacts, 0, -0.04)
    assert found.method == "none"
    assert found.gear == found.output_torque == 0
