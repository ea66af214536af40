"""A joint under control
=====================

A controller for a robot joint, designed with a constant stiffness and simulated with the drive's curve.

An REE drive is soft around zero torque and stiff under load. A discrete LQR with integral action, designed with the
stiffness at 100 N.m, damps the joint's oscillation well there. Around zero torque the drive has a fifth of that
stiffness, and the same controller leads to a limit cycle. Designed with the stiffness at zero torque, the same weights
give a controller that damps the joint over the whole range.

::

    python examples/joint_control.py [FOLDER] [--drives N]

writes stiffness.png and response.png to FOLDER (default joint-control) and prints the figures behind them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np

import stiffness_model as sm
from reefmu.joint import JointModel, Masses
from reefmu.joint.controller import design_lqr, minimum_damping_ratio
from reefmu.joint.plots import picture_designs, picture_responses
from reefmu.model.drive_model import build_model
from stiffness_model.units import quantity_text

MASSES = Masses(motor_inertia=1e-4, load_inertia=2.0, motor_damping=1e-3, load_damping=0.5)
SAMPLE = 5e-4  # s
STIFF_POINT = 100.0  # N.m on the output, about half the drive's rated torque


def main() -> None:
    """Design both controllers, simulate, draw and print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", nargs="?", default="joint-control", type=Path)
    parser.add_argument("--drives", type=int, default=60, help="virtual drives behind the curve (default 60)")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)

    joint = JointModel(build_model(sm.load_drive("drive_1"), n_drives=args.drives), MASSES)
    designs = [
        design_lqr(joint, STIFF_POINT, SAMPLE, f"at {STIFF_POINT:g} N.m"),
        design_lqr(joint, 0.0, SAMPLE, "at rest"),
    ]
    inertia = MASSES.reduced_inertia(joint.ratio)
    for made in designs:
        print(
            f"designed {made.name}: stiffness {quantity_text(made.stiffness, 'N.m/rad', 3)}, eigenfrequency "
            f"{np.sqrt(made.stiffness / inertia) / (2 * np.pi):.0f} Hz, "
            f"gains {np.array2string(made.gains, precision=3)}"
        )
        print(
            "  smallest damping ratio at "
            + ", ".join(
                f"{torque:g} N.m: {minimum_damping_ratio(joint, made, torque):.2f}"
                for torque in (0.0, 10.0, 50.0, 100.0, 200.0)
            )
        )
    picture_designs(joint, designs).savefig(args.folder / "stiffness.png")
    figure, left = picture_responses(joint, designs)
    figure.savefig(args.folder / "response.png")
    print("oscillation of the drive's torque left after 0.4 s (half of peak to peak):")
    for case, by_design in left.items():
        print(f"  {case}: " + ", ".join(f"{torque:.3g} N.m designed {name}" for name, torque in by_design.items()))
    print(f"pictures in {args.folder}")


if __name__ == "__main__":
    main()
