"""Several systems in a python-control interconnection: each runs as by itself, with its own parameters."""

from __future__ import annotations

import control as ct
import numpy as np
import pytest

import stiffness_model as sm
from reefmu.fmu.model.joint_component import joint_component
from reefmu.joint import JointModel, Masses, drive_system, joint_system, masses_block
from reefmu.joint.equations import JOINT_INPUTS
from reefmu.model.drive_model import DriveModel, build_model
from stiffness_model.errors import InputError, UnknownNameError
from stiffness_model.lookup.build_lookup import Lookup

LIGHT, HEAVY = Masses(1e-3, 2.0), Masses(3e-3, 5.0, 1e-3, 0.5)
TIME = np.linspace(0.0, 0.02, 41)
SOLVER = {"max_step": 5e-4, "rtol": 1e-11, "atol": 1e-13}


@pytest.fixture(scope="module")
def soft(drive: sm.Drive, lookup: Lookup) -> JointModel:
    return JointModel(
        build_model(drive, {"hysteresis": {"torque": 3.0, "presliding": 5e-5}}, lookup=lookup), HEAVY, 30.0
    )


@pytest.fixture(scope="module")
def plain(model: DriveModel) -> JointModel:
    return JointModel(model, LIGHT)


def loaded(system: ct.NonlinearIOSystem, torque: float, params: dict[str, float] | None = None) -> np.ndarray:
    """Outputs (n_outputs, n_time) of joints under the same load torque."""
    inputs = np.array([[torque if "load" in label else 0.0] for label in system.input_labels]) * np.ones_like(TIME)
    return np.asarray(ct.input_output_response(system, TIME, inputs, 0, params=params, solve_ivp_kwargs=SOLVER).outputs)


def side_by_side(left: JointModel, right: JointModel) -> ct.InterconnectedSystem:
    systems = [joint_system(left, name="left"), joint_system(right, name="right")]
    outputs = [f"{s.name}.{label}" for s in systems for label in s.output_labels]
    return ct.interconnect(
        systems,
        inplist=["left.load_tau", "right.load_tau"],
        outlist=outputs,
        check_unused=False,
        inputs=["left_load", "right_load"],
        outputs=[o.replace(".", "_") for o in outputs],
    )


def close(found: np.ndarray, single: np.ndarray) -> bool:
    scale = np.abs(single).max(axis=1, keepdims=True)
    return bool((np.abs(found - single) <= 1e-9 * scale + 1e-15).all())


def test_two_joints_run_as_each_by_itself(plain: JointModel, soft: JointModel) -> None:
    loop = side_by_side(plain, soft)
    together = loaded(loop, 20.0)
    left, right = np.split(together, 2)
    assert close(left, loaded(joint_system(plain), 20.0))
    assert close(right, loaded(joint_system(soft), 20.0))
    assert np.ptp(left[2]) > 2 * np.ptp(right[2])
    left, right = np.split(loaded(loop, 20.0, {"right.load.inertia": 2.0, "left.band": 1.0}), 2)
    stiffer = JointModel(plain.drive.with_parameters(band=1.0), LIGHT)
    assert close(left, loaded(joint_system(stiffer), 20.0))
    assert close(right, loaded(joint_system(soft), 20.0, {"load.inertia": 2.0}))


def test_an_interconnection_within_another(plain: JointModel, soft: JointModel) -> None:
    inner = side_by_side(plain, soft)
    third = joint_system(JointModel(plain.drive, HEAVY), name="third")
    outer = ct.interconnect(
        [inner, third],
        inplist=[f"{inner.name}.left_load", "third.load_tau"],
        inputs=["load_1", "load_2"],
        outlist=[f"{inner.name}.left_output_phi", "third.output_phi"],
        outputs=["one", "two"],
        check_unused=False,
    )
    x, u = np.zeros(outer.nstates), np.array([20.0, 20.0])
    rate = outer.dynamics(0.0, x, u, {"left.load.inertia": 4.0})
    assert rate[outer.state_labels.index(f"{inner.name}_left_output_w")] == pytest.approx(20 / 4)
    assert rate[outer.state_labels.index("third_output_w")] == pytest.approx(20 / HEAVY.load_inertia)


def test_unknown_parameters_are_refused(plain: JointModel, soft: JointModel, model: DriveModel) -> None:
    single, loop = joint_system(plain, name="left"), side_by_side(plain, soft)
    x, u = np.zeros(4), np.zeros(2)
    for wrong, meant in (("bnad", "band"), ("left.bnad", "left.band"), ("load.inertai", "load.inertia")):
        with pytest.raises(UnknownNameError, match=f"unknown parameter '{wrong}'; did you mean '{meant}'"):
            single.dynamics(0, x, u, {wrong: 1.0})
        with pytest.raises(UnknownNameError, match=f"did you mean '{meant}'"):
            ct.input_output_response(single, [0, 1e-3], np.zeros((2, 2)), 0, params={wrong: 1.0})
    with pytest.raises(UnknownNameError, match=r"left: unknown parameter 'left\.bnad'; did you mean 'left\.band'"):
        loaded(loop, 20.0, {"left.bnad": 1.0})
    with pytest.raises(UnknownNameError, match=r"'load\.inertia'; did you mean 'left\.load\.inertia'"):
        loaded(loop, 20.0, {"load.inertia": 1.0})
    with pytest.raises(InputError, match=r"left\.band: expected a finite number, got nan"):
        single.output(0, x, u, {"left.band": np.nan})
    with pytest.raises(InputError, match=r"masses: expected no parameters, got 'load\.inertia'"):
        masses_block(LIGHT, 1e-3, -29.0).output(0, x, np.zeros(6), {"load.inertia": 1.0})
    with pytest.raises(UnknownNameError, match="did you mean 'ratio'"):
        drive_system(model).output(0, [], np.zeros(5), {"ratoi": 1.0})


def test_parameters_of_other_systems_are_ignored(plain: JointModel) -> None:
    """Also one with the name of a joint's parameter without prefix, and one that its system does not declare."""
    law = ct.nlsys(
        None,
        lambda t, x, u, params: params["ratio"] * u[0] + params.get("more", 0.0),
        inputs=["output_phi"],
        outputs=["motor_tau"],
        params={"ratio": 3.0},
        name="law",
    )
    loop = ct.interconnect(
        [joint_system(plain, name="joint"), law],
        inputs=["load_tau"],
        outputs=["motor_tau", "crank_w"],
        check_unused=False,
    )
    x = np.array([0.0, 0.0, 1e-3, 0.0])
    assert loop.output(0, x, [0.0])[0] == pytest.approx(3e-3)
    assert loop.output(0, x, [0.0], {"ratio": 4.0, "more": 0.5, "joint.band": 1.0})[0] == pytest.approx(0.504)


def test_two_systems_of_one_name(plain: JointModel, soft: JointModel) -> None:
    def joined(*joints: JointModel) -> ct.InterconnectedSystem:
        return ct.interconnect(
            [joint_system(joint) for joint in joints], inplist=[], outlist=[], check_unused=False, warn_duplicate=False
        )

    with pytest.raises(InputError, match="expected systems of different names, got two called 'drive_1_joint'"):
        joined(plain, soft)
    assert joined(plain, plain).nstates == 8


def test_a_copy_has_its_own_prefix(plain: JointModel) -> None:
    copied = joint_system(plain, name="left").copy(name="right")
    assert set(copied.params) == {f"right.{name}" for name in plain.equations.parameters}
    rate = copied.dynamics(0, np.zeros(4), [0.0, 20.0], {"right.load.inertia": 4.0})
    assert rate[3] == pytest.approx(5.0)
    with pytest.raises(UnknownNameError):
        copied.dynamics(0, np.zeros(4), [0.0, 20.0], {"left.load.inertia": 4.0})


def test_outputs_equal_those_of_the_joint_fmu(soft: JointModel) -> None:
    """In names and values."""
    component = joint_component(soft.drive, soft.masses)
    system = joint_system(soft)
    assert tuple(s.name for s in component.outputs) == soft.equations.outputs
    assert tuple(s.name for s in component.inputs) == JOINT_INPUTS
    assert system.output_labels == [name.replace(".", "_") for name in soft.equations.outputs]
    x, u = soft.equilibrium(-80.0, crank_angle=0.4)
    x[1], x[3] = -20.0, 0.9
    parameters = np.array([p.value for p in component.parameters])
    parameters[[p.name for p in component.parameters].index("temperature")] = soft.temperature
    full = np.concatenate([x[:4], np.zeros(len(component.states) - len(x)), x[4:]])
    expected = np.asarray(component.output(full, u, parameters)).ravel()
    assert system.output(0, x, u) == pytest.approx(expected, rel=1e-12, abs=1e-12)
