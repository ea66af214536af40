"""A controller for a robot joint, designed on a constant stiffness and tried on the drive's real curve.

An REE drive is soft around zero torque and stiff under load. A discrete LQR with integral action, designed with the
stiffness at 100 N.m, damps the joint's oscillation well there. At rest the drive has a fifth of that stiffness, and
the same controller drives the joint into a lasting oscillation. Designed with the stiffness at rest, the same
weights give a controller that holds over the whole range.

    python examples/joint_control.py [FOLDER] [--drives N]

leaves design.png and response.png in FOLDER (default joint-control) and prints the figures behind them.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
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
STIFF_POINT = 100.0  # N.m on the output
SMALL_STEP, LARGE_STEP = 0.2e-3, 50e-3  # rad
SMALL_LOAD, LARGE_LOAD = 1.0, 120.0  # N.m
CASES = ((SMALL_STEP, 0.0), (LARGE_STEP, 0.0), (0.0, SMALL_LOAD), (0.0, LARGE_LOAD))
DURATION = 0.5  # s
TORQUES = (0, 10, 50, 100, 200)  # N.m, at which the damping is printed


def draw_designs(joint: JointModel, designs: Sequence[Design]) -> Figure:
    """The curve with the designs' straight lines, and how well each loop is damped over the torque."""
    figure = Figure(figsize=(9.6, 4.0), dpi=150, layout="constrained")
    left, right = figure.subplots(1, 2)
    tangents(joint, designs, left)
    damping_over_torque(joint, designs, right)
    return figure


def draw_responses(joint: JointModel, designs: Sequence[Design]) -> Figure:
    """Steps of set point (left) and load (right), small (top) and large (bottom)."""
    figure = Figure(figsize=(9.6, 6.4), dpi=150, layout="constrained")
    axes = figure.subplots(2, 2)
    print(f"oscillation left in the drive after {0.8 * DURATION:g} s, half of peak to peak")
    for ax, (target, load) in zip(axes.T.ravel(), CASES, strict=True):
        left = response(joint, designs, ax, target=target, load=load, duration=DURATION)
        step = f"set point {1e3 * target:g} mrad" if target else f"load {load:g} N.m"
        print(f"  {step:20s}" + ", ".join(f"designed {name}: {torque:.2g} N.m" for name, torque in left.items()))
    handles, names = axes[0, 0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper left", ncols=3, frameon=False, fontsize="small")
    return figure


def print_design(joint: JointModel, design: Design) -> None:
    """Gains, and the damping over the torque."""
    frequency = np.sqrt(design.stiffness / MASSES.reduced_inertia(joint.ratio)) / (2 * np.pi)
    gains = ", ".join(f"{gain:.4g}" for gain in design.gains)
    damping = ", ".join(f"{torque:g} N.m: {least_damping(joint, design, torque):.2f}" for torque in TORQUES)
    print(f"designed {design.name}: stiffness {design.stiffness / 1e3:.1f} kN.m/rad, eigenfrequency {frequency:.0f} Hz")
    print(f"  gains on crank.phi, crank.w, output.phi, output.w and the integral: {gains}")
    print(f"  least damping ratio at {damping}")


def main() -> None:
    """Design, try, draw, print."""
    parser = argparse.ArgumentParser(description="An LQR on a constant stiffness and on the drive's real curve")
    parser.add_argument("folder", nargs="?", default="joint-control", type=Path)
    parser.add_argument("--drives", type=int, default=60, help="virtual drives behind the curve (default 60)")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)

    joint = JointModel(build_model(sm.load_drive("drive_1"), n_drives=args.drives), MASSES)
    designs = [design_lqr(joint, STIFF_POINT, SAMPLE, f"at {STIFF_POINT:g} N.m"),
               design_lqr(joint, 0.0, SAMPLE, "at rest")]
    for design in designs:
        print_design(joint, design)
    draw_designs(joint, designs).savefig(args.folder / "design.png")
    draw_responses(joint, designs).savefig(args.folder / "response.png")
    print(f"pictures in {args.folder}")


if __name__ == "__main__":
    main()
