"""One controller on ten individual drives
=======================================

One controller on ten individual drives of one drawing.

A controller is designed on the mean drive. Balls, bores and lobes of a real drive deviate, and as it turns, the twist
at the same torque changes by an arc minute or two. A feedback of crank and output angle takes this for a change of
torque, some 40 N.m per arc minute, and reacts. Two designs that perform alike on the mean drive differ on the
individuals, here during one turn of the crank under load.

::

    python examples/ten_drives.py [FOLDER] [--drive drive_2] [--individuals N]

writes ten_drives.png to FOLDER (default ten-drives) and prints the tracking errors.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import stiffness_model as sm
from reefmu.joint import JointModel, Masses
from reefmu.joint.controller import Design, Weights, design_lqr
from reefmu.joint.joint_simulation import Motion, simulate_joint
from reefmu.model.contacts.tables import cached_lookup
from reefmu.model.drive_model import build_model
from stiffness_model.plotting.style import BLUE, FAINT, INK, format_axes

MASSES = Masses(motor_inertia=1e-4, load_inertia=2.0, motor_damping=1e-3, load_damping=0.5)
SAMPLE = 5e-4  # s
SPEED = 2 * np.pi * 5.0  # rad/s of the crank
LOAD = -60.0  # N.m on the output
WEIGHTS = {"soft on the output": Weights(), "stiff on the output": Weights(output_angle=1e6, integral=1e8)}
DURATION = 0.2  # s, one turn of the crank
SUBSTEPS = 2  # a third of a radian of the fastest oscillation in each


def tracking_controller(
    design: Design, ratio: float, motor_torque: float, start: np.ndarray
) -> Callable[[float, np.ndarray], tuple[float, float]]:
    """State feedback along a uniform motion from `start`, with the integral of the output's error."""
    speeds = np.array([SPEED, 0.0, SPEED / ratio, 0.0])
    held = np.array([0.0, SPEED, 0.0, SPEED / ratio])
    integral = 0.0

    def controller(time: float, motion: np.ndarray) -> tuple[float, float]:
        nonlocal integral
        wanted = np.array([start[0], 0.0, start[2], 0.0]) + held + speeds * time
        torque = motor_torque - float(design.gains[:4] @ (motion[:4] - wanted) + design.gains[4] * integral)
        integral += design.sample * (motion[2] - wanted[2])
        return torque, LOAD

    return controller


def track(joint: JointModel, design: Design) -> tuple[Motion, np.ndarray]:
    """The motion during one turn of the crank, and the error of the output, arcmin."""
    x, torques = joint.equilibrium(LOAD)
    speeds = np.array([0.0, SPEED, 0.0, SPEED / joint.ratio])
    damping = MASSES.motor_damping * SPEED + MASSES.load_damping * SPEED / joint.ratio**2
    motion = simulate_joint(
        joint,
        tracking_controller(design, joint.ratio, float(torques[0]) + damping, x),
        step=SAMPLE,
        duration=DURATION,
        start=x + joint.state(speeds),
        substeps=SUBSTEPS,
    )
    return motion, (motion["output.phi"] - x[2] - SPEED / joint.ratio * motion.time) / sm.ARCMIN


def main() -> None:
    """Design on the mean drive, simulate all drives, draw and print."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("folder", nargs="?", default="ten-drives", type=Path)
    parser.add_argument("--drive", default="drive_2")
    parser.add_argument("--individuals", type=int, default=10)
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    drive = sm.load_drive(args.drive)
    lookup = cached_lookup(drive, n_drives=60)
    mean = JointModel(build_model(drive, lookup=lookup), MASSES)
    designs = [design_lqr(mean, -LOAD, SAMPLE, name, weights) for name, weights in WEIGHTS.items()]

    figure = Figure(figsize=(8.4, 6.0), dpi=150, layout="constrained")
    axes = figure.subplots(len(designs), sharex=True)
    print("greatest error of the output [arcmin] and motor torque [N.m]")
    print("".join(f"{text:>26}" for text in ("", *WEIGHTS)))
    for seed in [*range(args.individuals), None]:
        joint = mean if seed is None else JointModel(build_model(drive, lookup=lookup, individual=seed), MASSES)
        colour, width = {None: (INK, 1.8), 0: (BLUE, 1.4)}.get(seed, (FAINT, 0.8))
        label = {None: "mean drive", 0: "individual 0", 1: "other individuals"}.get(seed)
        cells = ["mean" if seed is None else f"individual {seed}"]
        for design, ax in zip(designs, axes, strict=True):
            motion, error = track(joint, design)
            ax.plot(motion.time * SPEED / (2 * np.pi), error, color=colour, lw=width, label=label)
            torque = motion.torques[:, 0]
            cells.append(f"{np.abs(error).max():.2f}   {torque.min():.2f} to {torque.max():.2f}")
        print("".join(f"{cell:>26}" for cell in cells))
    for design, ax in zip(designs, axes, strict=True):
        format_axes(ax, "", "error of the output [arcmin]").set_title(design.name, loc="right", fontsize="medium")
    axes[0].legend(frameon=False, ncols=3, loc="lower left", bbox_to_anchor=(0, 1))
    axes[-1].set_xlabel("turns of the crank")
    axes[-1].set_xlim(0, DURATION * SPEED / (2 * np.pi))
    figure.savefig(args.folder / "ten_drives.png")
    print(f"picture in {args.folder}")


if __name__ == "__main__":
    main()
