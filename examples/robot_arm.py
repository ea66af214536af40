"""A robot arm with three drives, one of them worn
===============================================

The error of an arm's hand by its gears, in the robot simulator MuJoCo.

The arm swings a load on a circle below its shoulder. Its motors follow the circle, as the encoders of most robots are
on the motors; what the gears twist, the hand deviates. The shoulder has an REE drive, the elbow a strain wave gear by
its data sheet, the wrist a smaller REE drive. A second arm has the same drives, but that of the shoulder has worn by
20 um of gear clearance, and rubs. Where its load changes sides, below the shoulder, the hand falls through the play. A
third arm has rigid gears, against which both are measured. All run at MuJoCo's usual time step of 2 ms, twice what the
spring of the shoulder would allow without the inertia that the export adds to its twist.

::

    python examples/robot_arm.py [FOLDER] [--drives N]

writes robot_arm.png to FOLDER (default robot-arm) and prints the errors. Needs a C compiler and MuJoCo
(the extra `mujoco`).
"""

from __future__ import annotations

import argparse
import tempfile
import warnings
from pathlib import Path
from typing import Any

import numpy as np

import stiffness_model as sm
from reefmu.model.contacts.tables import cached_lookup
from reefmu.model.drive_model import build_model
from reefmu.robots import add_drive, export_mujoco, settle
from stiffness_model.errors import install_command
from stiffness_model.plotting.style import BLUE, FAINT, RED, format_axes, legend_above, new_figure

try:
    import mujoco
except ModuleNotFoundError:
    raise SystemExit(f"This example needs MuJoCo: {install_command('mujoco')}.") from None

UPPER, LOWER, HAND = 0.45, 0.40, 0.10  # m, lengths of the links
PAYLOAD = 8.0  # kg
CENTRE, RADIUS, PERIOD = np.array([-0.10, -0.60]), 0.15, 4.0  # m, m, s: the circle of the wrist, x and z
JOINTS = ("shoulder", "elbow", "wrist")
MOTOR_INERTIA = 1e-4  # kg.m2 at the crank
STEP = 2e-3  # s
BANDWIDTH = 30.0  # rad/s of the motors' control
WORN = {"backlash.clearance": 20e-6, "hysteresis.torque": 4.0}  # m, N.m
ARM = f"""<mujoco>
  <option timestep="{STEP}"><flag contact="disable"/></option>
  <worldbody>
    <body name="upper">
      <joint name="shoulder" axis="0 -1 0"/><geom type="capsule" size=".04" fromto="0 0 0 {UPPER} 0 0" mass="6"/>
      <body name="lower" pos="{UPPER} 0 0">
        <joint name="elbow" axis="0 -1 0"/><geom type="capsule" size=".03" fromto="0 0 0 {LOWER} 0 0" mass="3"/>
        <body name="hand" pos="{LOWER} 0 0">
          <joint name="wrist" axis="0 -1 0"/><geom type="capsule" size=".02" fromto="0 0 0 {HAND} 0 0" mass="0.5"/>
          <body name="payload" pos="{HAND} 0 0"><geom type="sphere" size=".06" mass="{PAYLOAD}"/></body>
        </body>
      </body>
    </body>
  </worldbody>
</mujoco>"""


def main() -> None:
    """Export the drives, swing the three arms, draw and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", nargs="?", default="robot-arm", type=Path)
    parser.add_argument("--drives", type=int, default=60, help="virtual drives behind each curve (default 60)")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", sm.DoesNotFitWarning)

    with tempfile.TemporaryDirectory() as name:
        drives = export_drives(Path(name), args.drives)
        hands = {"rigid": swing(None, {}), "new": swing(drives, {}), "worn": swing(drives, {"shoulder": WORN})}
    time = STEP * np.arange(len(hands["rigid"]))
    errors = {name: 1e3 * np.linalg.norm(hands[name] - hands["rigid"], axis=1) for name in ("new", "worn")}
    for name, error in errors.items():
        print(
            f"{name} shoulder drive: error of the hand {error.mean():.2f} mm on average, {error.max():.2f} mm at most, "
            f"horizontally {1e3 * np.ptp((hands[name] - hands['rigid'])[:, 0]):.2f} mm from end to end"
        )
    draw(args.folder / "robot_arm.png", time, hands, errors)


def export_drives(folder: Path, n_drives: int) -> dict[str, Path]:
    """The plugin of every joint. The worn drive is the new one with other settings, so it contains both effects."""
    effects = {"backlash": {}, "hysteresis": {}}
    drives = {joint: sm.load_drive(name) for joint, name in (("shoulder", "drive_1"), ("wrist", "workshop"))}
    models = {
        joint: build_model(drive, effects, lookup=cached_lookup(drive, n_drives=n_drives))
        for joint, drive in drives.items()
    }
    models["elbow"] = build_model("CHA-40A-50")
    return {joint: export_mujoco(model, folder / joint, step=STEP) for joint, model in models.items()}


def swing(drives: dict[str, Path] | None, settings: dict[str, dict[str, float]]) -> np.ndarray:
    """Path (n, 2) of the hand, x and z in m, over the second of two circles. drives: None for rigid gears."""
    spec = mujoco.MjSpec.from_string(ARM)
    for joint in JOINTS:
        if drives is None:
            spec.joint(joint).armature = 0.1
        else:
            add_drive(spec, joint, drives[joint], motor_inertia=MOTOR_INERTIA, settings=settings.get(joint))
    model = spec.compile()
    data = mujoco.MjData(model)
    motors = [model.joint(name).qposadr[0] for name in JOINTS]
    data.qpos[motors] = joint_angles(0.0)
    if drives is not None:
        settle(model, data)
    return follow_circle(model, data, motors)


def follow_circle(model: Any, data: Any, motors: list[int]) -> np.ndarray:
    """Torques on the motors by the inverse dynamics of the rigid arm at the motors' angles, as a robot's control has
    them. motors: indices of the motors' coordinates. The drives' twists follow the forces.
    """
    rigid = mujoco.MjSpec.from_string(ARM)
    for joint in JOINTS:
        rigid.joint(joint).armature = 0.1
    control = rigid.compile()
    plan = mujoco.MjData(control)
    hand, path = model.body("payload").id, []
    for k in range(round(2 * PERIOD / STEP)):
        before, wanted, after = (joint_angles((k + shift) * STEP) for shift in (-1, 0, 1))
        error, error_rate = wanted - data.qpos[motors], (after - before) / (2 * STEP) - data.qvel[motors]
        plan.qpos[:], plan.qvel[:] = data.qpos[motors], data.qvel[motors]
        plan.qacc[:] = (after - 2 * wanted + before) / STEP**2 + BANDWIDTH**2 * error + 2 * BANDWIDTH * error_rate
        mujoco.mj_inverse(control, plan)
        data.qfrc_applied[motors] = plan.qfrc_inverse
        mujoco.mj_step(model, data)
        mujoco.mj_kinematics(model, data)
        path.append(data.xpos[hand, [0, 2]].copy())
    return np.array(path[len(path) // 2 :])


def joint_angles(time: float) -> np.ndarray:
    """Angles (3,) with the wrist on the circle and the hand level, in rad; the circle begins gently."""
    turn = 2 * np.pi * max(time, 0.0) / PERIOD
    start = min(max(time, 0.0) / (PERIOD / 4), 1.0)
    x, z = CENTRE + RADIUS * start * np.array([np.cos(turn), np.sin(turn)])
    bend = -np.arccos((x * x + z * z - UPPER**2 - LOWER**2) / (2 * UPPER * LOWER))
    first = np.arctan2(z, x) - np.arctan2(LOWER * np.sin(bend), UPPER + LOWER * np.cos(bend))
    return np.array([first, bend, -first - bend])


def draw(path: Path, time: np.ndarray, hands: dict[str, np.ndarray], errors: dict[str, np.ndarray]) -> None:
    """The three paths, with the deviations drawn a hundred times as large, and the errors over one circle."""
    figure = new_figure(9.6, 4.4)
    circle, course = figure.subplots(1, 2)
    rigid = hands["rigid"]
    circle.plot(*rigid.T, color=FAINT, linewidth=2, label="rigid gears")
    for name, colour in (("new", BLUE), ("worn", RED)):
        label = f"{name} shoulder drive"
        circle.plot(*(rigid + 100 * (hands[name] - rigid)).T, color=colour, linewidth=1.2, label=label)
        course.plot(time, errors[name], color=colour, linewidth=1.2, label=label)
    circle.set_aspect("equal", adjustable="datalim")
    format_axes(circle, "x [m]", "z [m], deviations 100 times")
    format_axes(course, "time [s]", "error of the hand [mm]")
    course.set_ylim(bottom=0)
    for axes in (circle, course):
        legend_above(axes)
    figure.savefig(path)
    print(f"written to {path}")


if __name__ == "__main__":
    main()
