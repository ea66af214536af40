"""The drive in a joint of an existing MuJoCo model (`mujoco.MjSpec`), and its equilibrium under load."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from stiffness_model.errors import InputError, expect, expect_number, unknown_name

from .mujoco_library import REMEDY
from .plugin_export import MANIFEST
from .twist_inertia import twist_armature

TWIST_SUFFIX, DRIVE_SUFFIX = "_twist", "_drive"
"""What is appended to a joint's name for the joint of the twist, and for the plugin's instance and its sensor."""
MAX_ITERATIONS, EQUILIBRIUM = 100, 1e-9
"""Newton steps of `settle`, and the torque, relative to the greatest, that ends them. Chosen by judgement."""


def load_plugin(folder: str | os.PathLike[str]) -> dict[str, Any]:
    """Load the library of an export into this process, unless it is there, and return the export's description.

    Raises `InputError` for a folder without an export, without MuJoCo, and for a library of another version of MuJoCo.
    """
    path = Path(folder) / MANIFEST
    try:
        described = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError) as error:
        raise InputError(f"{folder}: expected a folder of `reefmu export --to mujoco`, got {error}") from None
    mujoco = _mujoco()
    expect(
        described["mujoco"] == mujoco.__version__,
        f"an export for MuJoCo {mujoco.__version__}, which is installed; export the drive again",
        described["mujoco"],
        str(folder),
    )
    mujoco.mj_loadPluginLibrary(str((Path(folder) / described["library"]).resolve()))
    return described


def add_drive(
    spec: Any,
    joint: str,
    folder: str | os.PathLike[str],
    *,
    motor_inertia: float,
    settings: Mapping[str, float] | None = None,
    inertia: float = 0.0,
) -> None:
    """Put a drive between the motor of a joint and its link.

    spec: a `mujoco.MjSpec`, which is changed: the joint becomes that of the motor, in terms of the output, and a second
    one with the suffix `_twist` follows it; a sensor with the suffix `_drive` has the drive's outputs. joint: name of a
    hinge that is the last joint of its body. folder: of an export. motor_inertia: kg.m2 at the crank. settings: values
    of the drive's attributes by name, SI and degC. inertia: kg.m2 that acts on the twist, motor and link together; 0
    for a model that stays stable whatever its links weigh. The spec's time step must be set before.

    Raises `InputError` for another joint, an unknown attribute and the errors of `load_plugin`.
    """
    described, mujoco = load_plugin(folder), _mujoco()
    known = described["attributes"]
    for name in settings or {}:
        if name not in known:
            raise unknown_name("attribute", name, known, joint)
    expect_number(motor_inertia, "a positive inertia, kg.m2", "motor_inertia", low=0.0)
    names = [j.name for j in spec.joints]
    if joint not in names:
        raise unknown_name("joint", joint, names, "add_drive")
    motor = spec.joint(joint)
    body = motor.parent
    expect(
        motor.type == mujoco.mjtJoint.mjJNT_HINGE and body.joints[-1].name == joint,
        "a hinge that is the last joint of its body",
        joint,
        "add_drive",
    )
    plugin, instance = described["plugin"], joint + DRIVE_SUFFIX
    motor.armature = motor_inertia * described["ratio"] ** 2
    armature = twist_armature(described["max_stiffness"], spec.option.timestep, inertia=inertia)
    body.add_joint(
        name=joint + TWIST_SUFFIX,
        type=mujoco.mjtJoint.mjJNT_HINGE,
        axis=motor.axis,
        pos=motor.pos,
        armature=armature,
    )
    spec.activate_plugin(plugin)
    config = {name: repr(float(value)) for name, value in (settings or {}).items()}
    element = spec.add_plugin(name=instance, plugin_name=plugin, active=True)
    element.config = config
    sensor = spec.add_sensor(name=instance, type=mujoco.mjtSensor.mjSENS_PLUGIN)
    for user in (body, sensor):
        user.plugin = element
        user.plugin.name = instance
        user.plugin.active = True


def settle(model: Any, data: Any) -> np.ndarray[Any, Any]:
    """Set the twists to their equilibrium at the present angles of the motors, at rest, and return the motors' torques.

    model, data: `mujoco.MjModel` and `MjData`; of the data, qpos of the twists and qvel change. Returns the torques
    that hold the motors, (n_twists,) N.m at the output, in the order of the joints. Newton's method with the exact
    differences of MuJoCo's forces. Raises `InputError` if the drives cannot carry the load.
    """
    mujoco = _mujoco()
    twists = [j for j in range(model.njnt) if model.joint(j).name.endswith(TWIST_SUFFIX)]
    angles, dofs = model.jnt_qposadr[twists], model.jnt_dofadr[twists]
    data.qvel[:] = 0.0

    def excess(shift: Any = 0.0) -> Any:
        start = data.qpos[angles].copy()
        data.qpos[angles] += shift
        mujoco.mj_forward(model, data)
        data.qpos[angles] = start
        return data.qfrc_passive[dofs] - data.qfrc_bias[dofs] + data.qfrc_applied[dofs]

    probe = 1e-7 * np.eye(len(twists))  # rad, far below a twist and far above the rounding of angles
    now = np.zeros(len(twists))
    for _ in range(MAX_ITERATIONS):
        now = excess()
        mujoco.mj_forward(model, data)
        if np.abs(now).max(initial=0.0) <= EQUILIBRIUM * max(1.0, float(np.abs(data.qfrc_bias[dofs]).max(initial=0.0))):
            return data.qfrc_bias[dofs - 1] - data.qfrc_passive[dofs - 1] - data.qfrc_applied[dofs - 1]
        slope = np.stack([(excess(row) - now) / 1e-7 for row in probe], axis=1)
        data.qpos[angles] -= np.linalg.solve(slope - 1e-9 * np.diag(np.abs(np.diag(slope)) + 1.0), now)
    raise InputError(f"settle: expected a load that the drives carry, got {np.abs(now).max():.3g} N.m in excess")


def _mujoco() -> Any:
    try:
        import mujoco
    except ImportError:
        raise InputError(f"mujoco: expected the package ({REMEDY}), got none") from None
    return mujoco
