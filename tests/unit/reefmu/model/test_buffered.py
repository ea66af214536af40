"""Fast calls with the same numbers: tables inside CasADi's splines, calls through buffers."""

from __future__ import annotations

import copy
import pickle
import threading

import casadi as ca
import control as ct
import numpy as np
import pytest

import stiffness_model as sm
from reefmu.effects import find_effect
from reefmu.joint import JointModel, Masses, joint_system
from reefmu.model.buffered import Buffered
from reefmu.model.contacts.element import element_function, with_contact_tables
from reefmu.model.contacts.tables import lookup_function
from reefmu.model.drive_model import DriveModel, build_model
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.lookup.element_table import ElementTable
from stiffness_model.numerics.bspline import Axis, evaluate


def places(axis: Axis, beyond: float) -> np.ndarray:
    """Nodes, both ends, points between and beyond them."""
    rng = np.random.default_rng(1)
    return np.concatenate(
        [
            axis.nodes[::7],
            [axis.start, axis.stop, 0.0],
            rng.uniform(axis.start, axis.stop, 60),
            [(1 + beyond) * axis.start, (1 + beyond) * axis.stop],
        ]
    )


@pytest.fixture(scope="module")
def element(drive: sm.Drive, lookup: Lookup) -> ElementTable:
    table = with_contact_tables(lookup, drive, [find_effect("missing_ball")]).element
    assert table is not None
    return table


@pytest.mark.parametrize("band", [-1.0, 0.0, 0.3])
def test_the_function_equals_the_lookup(lookup: Lookup, band: float) -> None:
    twist, clearance = (np.ravel(v) for v in np.meshgrid(places(lookup.twist, 0.2), places(lookup.clearance, 0.2)))
    found = [np.asarray(v).ravel() for v in lookup_function(lookup).map(twist.size)(twist, clearance, band)]
    axes = (lookup.twist, lookup.clearance)
    values, slopes = (evaluate(axes, lookup.coefficients, twist, clearance, slope=s) for s in (False, True))
    force, share = values[3:]
    blended = [v[0] + max(band, 0) * (v[2] - v[0]) + max(-band, 0) * (v[1] - v[0]) for v in (values, slopes)]
    for name, got, expected in zip(
        ("torque", "stiffness", "force", "share"), found, (*blended, force, share), strict=False
    ):
        assert np.abs(got - expected).max() < 1e-13 * np.abs(expected).max(), name
    inside = (np.abs(twist) <= lookup.twist.stop) & (np.abs(clearance) <= lookup.clearance.stop)
    np.testing.assert_array_equal(found[4].astype(bool), inside)


def test_the_derivative_is_the_stiffness_on_both_sides_of_an_edge(lookup: Lookup) -> None:
    """Also at the nodes and at the ends of the range."""
    twist = ca.MX.sym("twist")
    torque, stiffness, *_ = lookup_function(lookup)(twist, 0.0, 0.0)
    both = ca.Function("both", [twist], [ca.jacobian(torque, twist), stiffness])
    for x in places(lookup.twist, 0.2):
        slope, said = (float(v) for v in both(x))
        assert slope == pytest.approx(said, rel=1e-11, abs=1e-9 * lookup.full_torque)


def test_one_element_equals_its_table(element: ElementTable) -> None:
    rng = np.random.default_rng(2)
    twist, clearance = (rng.uniform(1.2 * a.start, 1.2 * a.stop, 400) for a in (element.twist, element.clearance))
    position = rng.uniform(-7.0, 7.0, 400)
    torque, stiffness = (np.asarray(v).ravel() for v in element_function(element).map(400)(twist, clearance, position))
    wrapped = np.arctan2(np.sin(position), np.cos(position))
    expected = element.evaluate(twist, clearance, wrapped)
    assert np.abs(torque - expected[0]).max() < 1e-12 * np.abs(expected[0]).max()
    assert np.abs(stiffness - expected[1]).max() < 1e-12 * np.abs(expected[1]).max()


def test_a_call_copies_no_table(lookup: Lookup, element: ElementTable, drive: sm.Drive) -> None:
    """CasADi computes in one work vector, in which a table that is copied at every call would need room."""
    assert lookup_function(lookup).sz_w() < lookup.coefficients.size / 10
    assert element_function(element).sz_w() < element.coefficients.size / 10
    model = build_model(drive, {"missing_ball": {}, "modulus_error": {}}, lookup=lookup)
    assert model.output.sz_w() < lookup.coefficients.size / 10


def test_a_simulation_calls_through_buffers_only(model: DriveModel, monkeypatch: pytest.MonkeyPatch) -> None:
    """An ordinary call of a CasADi function converts its arguments, which takes ten times as long as the rates."""
    joint = JointModel(model, Masses(1e-3, 2.0))
    system = joint_system(joint, name="joint")
    expected = np.asarray(joint.equations.rate(np.zeros(4), [0.0, 20.0], list(system.params.values()))).ravel()

    def refuse(*_args: object, **_named: object) -> None:
        raise AssertionError("an ordinary call")

    system.dynamics(0, np.zeros(4), [0.0, 20.0])  # makes the buffers
    system.output(0, np.zeros(4), [0.0, 20.0])
    monkeypatch.setattr(ca.Function, "__call__", refuse)
    monkeypatch.setattr(ca.Function, "call", refuse)
    assert system.dynamics(0, np.zeros(4), [0.0, 20.0]) == pytest.approx(expected, rel=1e-15)
    ct.input_output_response(system, [0, 1e-3], np.zeros((2, 2)), 0)


def test_buffers_serve_threads_copies_and_pickles() -> None:
    x, k = ca.MX.sym("x", 3), ca.MX.sym("k")
    function = Buffered(ca.Function("f", [x, k, ca.MX.sym("none", 0)], [ca.vertcat(k * x, ca.MX(1, 1))]))
    first = function([1.0, 2.0, 3.0], 2.0, [])
    for same in (function, copy.deepcopy(function), pickle.loads(pickle.dumps(function))):
        assert same([1.0, 1.0, 1.0], 5.0, []).tolist() == [5.0, 5.0, 5.0, 0.0]
    assert first.tolist() == [2.0, 4.0, 6.0, 0.0], "a result stays as it was"
    wrong: list[float] = []

    def work(size: float) -> None:
        wrong.extend(size for _ in range(2000) if function([size] * 3, 2.0, [])[0] != 2 * size)

    threads = [threading.Thread(target=work, args=(float(size),)) for size in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not wrong
