"""The plugin gives the numbers of the model and the motion of `reefmu.joint`."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.effects import EFFECTS
from reefmu.fmu.model.joint_equations import maximum_stiffness
from reefmu.joint import JointModel, simulate_joint
from reefmu.model.drive_model import DriveModel, build_model
from stiffness_model.lookup.table import Lookup
from stiffness_model.numerics.arrays import Array
from tests.integration.robots.joint_models import MASSES, at_nominal, joint_text

pytestmark = pytest.mark.slow
SAMPLE, DURATION = 1e-3, 0.05


def motor_torque(time: float, _: object = None) -> tuple[float, float]:
    """A torque whose direction, and with it that of the motion, changes."""
    return -0.8 * np.sin(80 * time) + 0.2, 0.0


def simulated(mujoco: Any, folder: Path, ratio: float, step: float, integrator: str) -> Array:
    """Motion (n, 4) of crank and output after every sample, as `simulate_joint` gives it."""
    model = mujoco.MjModel.from_xml_string(joint_text(folder, step=step, armature=0.0, integrator=integrator))
    data, rows = mujoco.MjData(model), []
    for k in range(round(DURATION / SAMPLE)):
        data.ctrl[0] = motor_torque(k * SAMPLE)[0]
        mujoco.mj_step(model, data, round(SAMPLE / step))
        (theta, delta), (speed, rate) = data.qpos, data.qvel
        rows.append([ratio * theta, ratio * speed, theta + delta, speed + rate])
    return np.array(rows)


def deviation(came: Array, expected: Array) -> float:
    """Greatest deviation of the angles, relative to their greatest value."""
    return float((np.abs(came - expected).max(axis=0) / np.abs(expected).max(axis=0))[[0, 2]].max())


@pytest.fixture(scope="module")
def motions(plain_model: DriveModel, lossy_model: DriveModel) -> dict[str, Array]:
    return {
        name: simulate_joint(
            JointModel(model, MASSES), motor_torque, step=SAMPLE, duration=DURATION, substeps=200
        ).values[1:, :4]
        for name, model in (("plain", plain_model), ("lossy", lossy_model))
    }


def test_the_motion_is_that_of_the_joint_to_a_millionth(
    mujoco: Any, plain: Path, lossy: Path, plain_model: DriveModel, motions: dict[str, Array]
) -> None:
    """Without loss the error falls with the fourth power of the step; friction reverses within a step."""
    ratio = plain_model.parameters[0].value
    errors = [
        deviation(simulated(mujoco, plain, ratio, step, "RK4"), motions["plain"]) for step in (1e-4, 5e-5, 2.5e-5)
    ]
    assert errors[0] < 1e-6
    assert errors[0] / errors[1] > 12
    assert errors[1] / errors[2] > 12
    assert deviation(simulated(mujoco, lossy, ratio, 1e-5, "RK4"), motions["lossy"]) < 1e-6


def test_the_error_of_the_euler_method_falls_with_the_step(
    mujoco: Any, lossy: Path, plain_model: DriveModel, motions: dict[str, Array]
) -> None:
    ratio = plain_model.parameters[0].value
    coarse, fine = (
        deviation(simulated(mujoco, lossy, ratio, step, "Euler"), motions["lossy"]) for step in (5e-5, 2.5e-5)
    )
    assert fine < 1e-3
    assert 1.8 < coarse / fine < 2.2


@pytest.mark.parametrize("individual", [None, 3])
def test_outputs_and_states_are_those_of_the_model_with_all_effects(
    mujoco: Any,
    exported: Callable[[DriveModel, str], Path],
    drive: sm.Drive,
    lookup: Lookup,
    individual: int | None,
) -> None:
    """To 1e-11 of full torque along a motion through reversals; the time step is so short that friction is whole."""
    model = at_nominal(build_model(drive, {e: {} for e in EFFECTS}, lookup=lookup, individual=individual))
    folder = exported(model, f"full_{individual}")
    step = 1e-4
    simulator = mujoco.MjModel.from_xml_string(
        joint_text(folder, step=step, inertia=0.5, settings='<config key="temperature" value="35"/>').replace(
            '<config key="temperature" value="20"/>', "", 1
        )
    )
    data, p, ratio = mujoco.MjData(simulator), model.parameter_vector(), model.parameters[0].value
    states = None
    for k in range(200):
        data.ctrl[0] = motor_torque(4 * k * step)[0]
        mujoco.mj_forward(simulator, data)
        (theta, delta), (speed, rate) = data.qpos, data.qvel
        inputs = np.array([ratio * theta, ratio * speed, theta + delta, speed + rate, 35.0])
        states = model.initial(inputs, p) if states is None else model.advance(states, inputs, step, p)
        expected = np.array(model.output(states, inputs, p)).ravel()
        sizes = {"N.m": model.full_torque, "N.m/rad": maximum_stiffness(model), "rad": 1.0, "N": 100.0}
        full = [sizes.get(signal.unit, 0.0) for signal in model.outputs]
        assert (np.abs(data.sensordata - expected) <= 1e-11 * np.maximum(np.abs(expected), full)).all()
        assert data.qfrc_passive[1] == pytest.approx(expected[0], abs=1e-11 * model.full_torque)
        assert data.plugin_state[2:] == pytest.approx(np.array(states).ravel(), abs=1e-11)
        mujoco.mj_step(simulator, data)


def test_the_torques_do_no_work_on_a_common_turn(mujoco: Any, plain: Path) -> None:
    """Without friction the drive exerts no torque on the motor's coordinate, which turns both sides alike."""
    model = mujoco.MjModel.from_xml_path(str(plain / "joint.xml"))
    data = mujoco.MjData(model)
    data.qpos[:] = 0.3, -1e-3
    mujoco.mj_forward(model, data)
    assert data.qfrc_passive[1] > 10
    assert abs(data.qfrc_passive[0]) < 1e-12 * data.qfrc_passive[1]


def test_export_of_a_catalogue_gear(mujoco: Any, exported: Callable[[DriveModel, str], Path]) -> None:
    """The twist under half the rated torque is that of the sheet's stiffness."""
    model = build_model("CHA-40A-50", inherent=False)
    simulator = mujoco.MjModel.from_xml_path(str(exported(model, "cha") / "joint.xml"))
    data = mujoco.MjData(simulator)
    data.qpos[1] = -40.0 / 100e3
    mujoco.mj_forward(simulator, data)
    assert data.qfrc_passive[1] == pytest.approx(40.0, rel=1e-9)
