"""Communication step of a co-simulation
=====================================

Growth of an oscillation through the one-step lag of a co-simulated spring, and the largest step of each scheme.

The drive runs as an FMU; motor and load are integrated by the master around it, once in each scheme of
``reefmu.joint.cosimulate``. There is no damping, so that every change of amplitude is an effect of the coupling.

::

    python examples/cosimulation_step.py [FOLDER] [--drives N]

writes growth.png and swing.png to FOLDER (default cosimulation-step) and prints the largest steps.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import stiffness_model as sm
from reefmu.fmu.export import export_fmu
from reefmu.joint import JointModel, Masses, Motion, Scheme, cosimulate, growth_rate, largest_step, simulate_joint
from reefmu.model.drive_model import build_model
from stiffness_model.errors import InputError
from stiffness_model.plotting.style import BLUE, FAINT, GREEN, INK, RED, format_axes
from stiffness_model.units import quantity_text

MASSES = Masses(motor_inertia=1e-4, load_inertia=2.0)
LOAD = -100.0  # N.m: load about which the small oscillation takes place
DURATION = 0.1  # s
SMALL = 1e-9  # rad: amplitude at which the spring is linear
MAX_FACTOR = 1e5
SWING = 150.0  # N.m: torque from which the large oscillation is released
TOP = 4e-3  # rad: range of the picture of the large oscillation
LOOK: dict[Scheme, tuple[str, str, tuple[float, ...]]] = {
    "parallel": (RED, "o", ()),
    "sequential": (BLUE, "s", (6, 1.5)),
    "extrapolated": (GREEN, "^", (2, 1)),
}
STEPS: dict[Scheme, tuple[float, ...]] = {
    "parallel": (1.5e-5, 2e-5, 4e-5, 7e-5, 1e-4),
    "sequential": (5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 1.5e-3),
    "extrapolated": (5e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3),
}


def amplitude_factor(fmu: Path, joint: JointModel, scheme: Scheme, step: float) -> float:
    """Factor by which the amplitude of a small free oscillation about the load has changed after DURATION."""
    start, torques = joint.equilibrium(LOAD)
    rest = start[0] / joint.ratio - start[2]
    start[2] -= SMALL
    held = (float(torques[0]), float(torques[1]))
    n = round(DURATION / step)
    motion = cosimulate(
        fmu, joint.masses, lambda _t, _s: held, step=step, duration=n * step, start=start[:4], scheme=scheme
    )
    twist = motion["crank.phi"] / joint.ratio - motion["output.phi"] - rest
    rate = (motion["crank.w"] / joint.ratio - motion["output.w"]) / eigenfrequency(joint, LOAD)
    amplitude = np.hypot(twist, rate)
    return float(amplitude[-max(n // 10, 4) :].max() / SMALL)


def stiffness(joint: JointModel, load: float) -> float:
    """Stiffness, N.m/rad at the output, under a load, N.m."""
    return float(joint.drive.lookup.stiffness(joint.drive.lookup.twist_at(-load)))


def eigenfrequency(joint: JointModel, load: float) -> float:
    """Eigenfrequency, rad/s, of motor against load."""
    return float(np.sqrt(stiffness(joint, load) / joint.masses.reduced_inertia(joint.ratio)))


def picture_growth(fmu: Path, joint: JointModel) -> Figure:
    """Factor of the amplitude over the step: theory as lines, simulations with the FMU as points."""
    k, inertia = stiffness(joint, LOAD), joint.masses.reduced_inertia(joint.ratio)
    figure = Figure(figsize=(6.8, 4.4), dpi=150, layout="constrained")
    ax = format_axes(
        figure.subplots(), "communication step [ms]", f"amplitude after {DURATION:g} s, relative to the initial one"
    )
    fine = np.geomspace(2e-6, 6e-3, 500)
    for scheme, (colour, marker, dashes) in LOOK.items():
        theory = np.array([np.exp(min(growth_rate(h, k, inertia, scheme=scheme) * DURATION, 40)) for h in fine])
        ax.plot(1e3 * fine, theory, color=colour, lw=1.6, dashes=dashes)
        factors = [amplitude_factor(fmu, joint, scheme, h) for h in STEPS[scheme]]
        ax.plot(1e3 * np.array(STEPS[scheme]), factors, marker, color=colour, ms=5.5, label=scheme)
        for h, factor in zip(STEPS[scheme], factors, strict=True):
            print(
                f"  {scheme:12s} {1e3 * h:5.3g} ms: x{factor:.6g}   theory "
                f"x{np.exp(growth_rate(h, k, inertia, scheme=scheme) * DURATION):.6g}"
            )
    limit = 1e3 * 2 / eigenfrequency(joint, LOAD)
    ax.axvline(limit, color=FAINT, lw=0.9, zorder=0)
    ax.text(limit * 0.94, 3e4, "2/eigenfrequency", color=INK, fontsize="small", ha="right")
    ax.set(xscale="log", yscale="log", ylim=(0.5, MAX_FACTOR), xlim=(2e-3, 6))
    ax.set_xticks([0.01, 0.1, 1], ["0.01", "0.1", "1"])
    ax.set_title(
        f"Undamped joint about {-LOAD:g} N.m, {eigenfrequency(joint, LOAD) / 2 / np.pi:.0f} Hz: "
        "theory (lines) and FMU (points)",
        loc="left",
        fontsize="medium",
    )
    ax.legend(frameon=False, loc="center", bbox_to_anchor=(0.66, 0.5))
    return figure


def picture_large_oscillation(fmu: Path, joint: JointModel) -> Figure:
    """A large oscillation through the soft range around zero torque, where the stiffness changes within a step."""
    start, _ = joint.equilibrium(-SWING)
    figure = Figure(figsize=(9.6, 4.0), dpi=150, layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    reference = simulate_joint(joint, lambda _t, _s: (0.0, 0.0), step=1e-4, duration=DURATION / 2, start=start)
    for ax, step in zip(axes, (1e-4, 5e-4), strict=True):
        format_axes(ax, "time [ms]", "twist [mrad]" if ax is axes[0] else "")
        ax.plot(1e3 * reference.time, 1e3 * reference["twist"], color=FAINT, lw=3.5, label="one system, Runge-Kutta")
        for scheme, (colour, _, dashes) in LOOK.items():
            motion = bounded_motion(fmu, joint, scheme, step, start)
            twist = twist_of(motion, joint)
            exceeded = np.abs(twist) > TOP
            end = int(np.argmax(exceeded)) + 1 if exceeded.any() else len(twist)
            ax.plot(1e3 * motion.time[:end], 1e3 * twist[:end], color=colour, lw=1.5, dashes=dashes, label=scheme)
            late = np.abs(twist[-max(len(twist) // 5, 1) :]).max() / np.abs(twist[0])
            print(f"  {scheme:12s} {1e3 * step:g} ms: amplitude x{late:.3g} after {1e3 * motion.time[-1]:.3g} ms")
        ax.set_title(f"step {1e3 * step:g} ms", loc="left", fontsize="medium")
        ax.set(xlim=(0, 500 * DURATION), ylim=(-1e3 * TOP, 1e3 * TOP))
    handles, names = axes[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper left", ncols=4, frameon=False)
    return figure


def bounded_motion(fmu: Path, joint: JointModel, scheme: Scheme, step: float, start: np.ndarray) -> Motion:
    """The free motion for half of DURATION, or for the part of it that stays bounded."""
    duration = DURATION / 2
    while True:
        try:
            return cosimulate(
                fmu,
                joint.masses,
                lambda _t, _s: (0.0, 0.0),
                step=step,
                duration=duration,
                start=start[:4],
                scheme=scheme,
            )
        except InputError:
            duration = step * round(0.8 * duration / step)


def twist_of(motion: Motion, joint: JointModel) -> np.ndarray:
    """Twist of the masses, rad; the output of the FMU is one step old in some schemes."""
    return motion["crank.phi"] / joint.ratio - motion["output.phi"]


def main() -> None:
    """Export, run, draw, print."""
    parser = argparse.ArgumentParser(description="Growth of an oscillation over the communication step")
    parser.add_argument("folder", nargs="?", default="cosimulation-step", type=Path)
    parser.add_argument("--drives", type=int, default=60, help="virtual drives behind the curve (default 60)")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)

    joint = JointModel(build_model(sm.load_drive("drive_1"), n_drives=args.drives), MASSES)
    fmu = export_fmu(joint.drive, args.folder / "drive_1.fmu")
    inertia = MASSES.reduced_inertia(joint.ratio)
    print(f"reduced inertia {inertia:.4f} kg.m2 at the output; largest step, us, of each scheme")
    print("  load     stiffness     eigenfrequency   parallel: growth below 1/s, with 1 % and 5 % damping   sequential")
    for load in (0.0, -100.0, -280.0):
        k, omega = stiffness(joint, load), eigenfrequency(joint, load)
        damped = [largest_step(k, inertia, growth=0.0, decay=ratio * omega) for ratio in (0.01, 0.05)]
        steps = [largest_step(k, inertia), *damped, largest_step(k, inertia, scheme="sequential")]
        print(
            f"  {abs(load):3.0f} N.m  {quantity_text(k, 'N.m/rad', 3):>15}  {omega / 2 / np.pi:4.0f} Hz       "
            + "   ".join(f"{1e6 * h:9.3g}" for h in steps)
        )
    print(f"small oscillation about {-LOAD:g} N.m, amplitude after {DURATION:g} s")
    picture_growth(fmu, joint).savefig(args.folder / "growth.png")
    print(f"large oscillation, released at {SWING:g} N.m")
    picture_large_oscillation(fmu, joint).savefig(args.folder / "swing.png")
    print(f"pictures in {args.folder}")


if __name__ == "__main__":
    main()
