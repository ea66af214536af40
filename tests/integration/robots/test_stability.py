"""The drive's spring and friction at the time step of a simulator."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reefmu.fmu.model.joint_equations import maximum_stiffness
from reefmu.model.drive_model import DriveModel
from reefmu.robots import largest_time_step, twist_armature
from stiffness_model.numerics.arrays import Array
from tests.integration.robots.joint_models import MASSES, joint_text

pytestmark = pytest.mark.slow


def twists(mujoco: Any, model: Any, steps: int, start: float = -4e-3) -> Array:
    """Twists of a joint that is released twisted."""
    data = mujoco.MjData(model)
    data.qpos[1] = start
    found = np.empty(steps)
    for k in range(steps):
        mujoco.mj_step(model, data)
        found[k] = data.qpos[1]
    return found


@pytest.mark.parametrize("inertia", [1.0, 1e-2, 1e-4])
@pytest.mark.parametrize("step", [2e-3, 1e-2])
def test_an_undamped_joint_does_not_gain_energy(
    mujoco: Any, plain: Path, plain_model: DriveModel, inertia: float, step: float
) -> None:
    """Whatever the link weighs: the amplitude of the twist at the end of 20 000 steps is that at the beginning."""
    armature = twist_armature(maximum_stiffness(plain_model), step)
    model = mujoco.MjModel.from_xml_string(joint_text(plain, step=step, armature=armature, inertia=inertia))
    found = np.abs(twists(mujoco, model, 20_000)).reshape(4, -1).max(axis=1)
    assert found[0] < 1.2 * 4e-3
    assert found[1:] == pytest.approx(found[0], rel=0.01)


def test_a_step_that_is_too_long_is_refused_with_the_remedy(mujoco: Any, plain: Path, plain_model: DriveModel) -> None:
    """At the limit of the derivation, to its digits; beyond it the motion diverges where nothing refuses it."""
    stiffness = maximum_stiffness(plain_model)
    inertia = MASSES.reduced_inertia(plain_model.parameters[0].value)
    limit = largest_time_step(stiffness, inertia)
    model = mujoco.MjModel.from_xml_string(joint_text(plain, step=0.999 * limit, armature=0.0))
    assert np.abs(twists(mujoco, model, 5000, start=-2e-3)).max() < 0.01
    with pytest.raises(ValueError, match=r"joint_twist: expected armature of at least 0\.07"):
        mujoco.MjModel.from_xml_string(joint_text(plain, step=1.001 * limit, armature=0.0))
    data = mujoco.MjData(model)
    data.qpos[1] = -4e-3
    model.opt.timestep = 1.5 * limit
    mujoco.mj_step(model, data, 2000)
    assert not np.abs(data.qpos[1]) < 1.0 or data.warning[mujoco.mjtWarning.mjWARN_BADQACC].number > 0


def test_the_frequency_is_right_to_fourth_order_with_a_twelfth(
    mujoco: Any, plain: Path, plain_model: DriveModel
) -> None:
    """A quarter of the step: against the same joint at a step that resolves it, the twist after five periods."""
    stiffness = maximum_stiffness(plain_model)
    inertia = MASSES.reduced_inertia(plain_model.parameters[0].value)

    def period(step: float, armature: float) -> float:
        model = mujoco.MjModel.from_xml_string(joint_text(plain, step=step, armature=armature))
        found = twists(mujoco, model, round(0.1 / step))
        up = np.flatnonzero((found[:-1] < 0) & (found[1:] >= 0))
        crossings = step * (up + found[up] / (found[up] - found[up + 1]))
        return float(np.diff(crossings).mean())

    exact, step = period(5e-6, 0.0), 2e-4
    errors = {a: abs(period(step, a) / exact - 1) for a in (0.0, twist_armature(stiffness, step, inertia=inertia))}
    assert errors[0.0] > 1e-3
    assert list(errors.values())[1] < 0.35 * errors[0.0]


@pytest.mark.parametrize("inertia", [1.0, 1e-2])
def test_friction_holds_at_a_step_that_does_not_resolve_it(mujoco: Any, lossy: Path, inertia: float) -> None:
    """3 N.m of dry friction: under 1.5 N.m the link stands still, but for the slow sliding of Dahl's law, and under
    13 N.m it moves at the speed at which viscous friction, 2 N.m.s/rad, takes the rest."""
    model = mujoco.MjModel.from_xml_string(joint_text(lossy, step=2e-3, inertia=inertia))
    data, ratio = mujoco.MjData(model), model.actuator_gear[0, 0]
    data.ctrl[0] = 1.5 / ratio
    mujoco.mj_step(model, data, 500)
    start = float(data.qpos.sum())
    speeds = []
    for _ in range(500):
        mujoco.mj_step(model, data)
        speeds.append(abs(float(data.qvel.sum())))
    assert abs(float(data.qpos.sum()) - start) < 1e-3
    assert max(speeds) < 0.01
    data.ctrl[0] = 13.0 / ratio
    mujoco.mj_step(model, data, 5000)
    mean = np.mean([mujoco.mj_step(model, data) or float(data.qvel.sum()) for _ in range(500)])
    assert mean == pytest.approx((13.0 - 3.0) / 2.0, rel=0.02)
