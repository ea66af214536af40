"""A controller for a robot joint, designed on a constant stiffness and tried on the drive's real curve.

An REE drive is soft around zero torque and stiff under load. A discrete LQR with integral action, designed with the
stiffness at 100 N.m, damps the joint's oscillation well there. At rest the drive has a fifth of that stiffness, and
the same controller drives the joint into a lasting oscillation. Designed with the stiffness at zero torque, the same
weights give a controller that holds over the whole range.

    python examples/joint_control.py [FOLDER] [--drives N]

leaves stiffness.png and response.png in FOLDER (default joint-control) and prints the figures behind them.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import stiffness_model as sm
from reefmu.joint import JointModel, Masses
from reefmu.joint.controller import Design, design_lqr, least_damping
from reefmu.joint.plots import damping_over_torque, response, tangents
from reefmu.model import build_model

MASSES = Masses(motor_inertia=1e-4, load_inertia=2.0, motor_damping=1e-3, load_damping=0.5)
SAMPLE = 5e-4  # s
STIFF_POINT = 100.0  # N.m on the output, about half the drive's rated torque


def picture_stiffness(joint: JointModel, designs: list[Design]) -> Figure:
    """The curve with the designs' straight lines, and how well each loop is damped over the torque."""
    figure = Figure(figsize=(9.6, 4.0), dpi=150, layout="constrained")
    left, right = figure.subplots(1, 2)
    tangents(joint, designs, left)
    damping_over_torque(joint, designs, right)
    return figure


def picture_response(joint: JointModel, designs: list[Design]) -> tuple[Figure, dict[str, dict[str, float]]]:
    """Set point and load steps, small and large; and what oscillation each leaves in the drive, N.m."""
    figure = Figure(figsize=(9.6, 6.4), dpi=150, layout="constrained")
    axes = figure.subplots(2, 2)
    left = {
        "set point 0.2 mrad": response(joint, designs, axes[0, 0], target=0.2e-3),
        "set point 50 mrad": response(joint, designs, axes[1, 0], target=50e-3),
        "load 1 N.m": response(joint, designs, axes[0, 1], load=1.0),
        "load 120 N.m": response(joint, designs, axes[1, 1], load=120.0),
    }
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper left", ncols=3, frameon=False, fontsize="small")
    return figure, left


def main() -> None:
    """Design, try, draw, print."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("folder", nargs="?", default="joint-control", type=Path)
    parser.add_argument("--drives", type=int, default=60, help="virtual drives behind the curve (default 60)")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)

    joint = JointModel(build_model(sm.load_drive("drive_1"), n_drives=args.drives), MASSES)
    designs = [design_lqr(joint, STIFF_POINT, SAMPLE, f"at {STIFF_POINT:g} N.m"),
               design_lqr(joint, 0.0, SAMPLE, "at rest")]
    inertia = MASSES.reduced_inertia(joint.ratio)
    for made in designs:
        print(f"designed {made.name}: stiffness {made.stiffness / 1e3:.1f} kN.m/rad, eigenfrequency "
              f"{np.sqrt(made.stiffness / inertia) / (2 * np.pi):.0f} Hz, "
              f"gains {np.array2string(made.gains, precision=3)}")
        print("  least damping ratio at " + ", ".join(
            f"{torque:g} N.m: {least_damping(joint, made, torque):.2f}" for torque in (0.0, 10.0, 50.0, 100.0, 200.0)))
    picture_stiffness(joint, designs).savefig(args.folder / "stiffness.png")
    figure, left = picture_response(joint, designs)
    figure.savefig(args.folder / "response.png")
    print("oscillation of the drive's torque left after 0.4 s (half of peak to peak):")
    for case, by_design in left.items():
        print(f"  {case}: " + ", ".join(f"{torque:.3g} N.m designed {name}" for name, torque in by_design.items()))
    print(f"pictures in {args.folder}")


if __name__ == "__main__":
    main()
