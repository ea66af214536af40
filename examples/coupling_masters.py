"""Four masters around one FMU
===========================

A stiff spring in co-simulation: four ways to couple the same native FMU with motor and load.

* Jacobi: drive and masses step in parallel, each with the last result of the other (the usual default).
* Sequential: the masses step first, then the drive; speeds take the mean of old and new torque (Verlet).
* Linearly implicit: the same order, but the masses step with the trapezoidal rule on the torques and their directional
  derivatives, which the FMU provides.
* Kind ``joint``: the masses are inside the FMU, which takes substeps.

There is no damping, so that every change of amplitude is an effect of the coupling. Left: a small oscillation about
100 N.m. Right: an oscillation released at 150 N.m, through the soft range around zero torque; its amplitude is the
twist at which its energy would be potential.

::

    python examples/coupling_masters.py [FOLDER] [--drives N]

writes masters.png to FOLDER (default coupling-masters) and prints the table. Needs a C compiler.
"""

from __future__ import annotations

import argparse
import math
import shutil
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import stiffness_model as sm
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.joint import JointModel, Masses
from reefmu.model.drive_model import build_model
from stiffness_model.numerics.arrays import Array
from stiffness_model.plotting.style import BLUE, FAINT, GREEN, INK, PURPLE, RED, format_axes

MASSES = Masses(motor_inertia=1e-4, load_inertia=2.0)
DURATION = 0.5  # s
SMALL = 1e-8  # rad
LOAD, SWING = 100.0, 150.0  # N.m
STEPS = (1e-5, 3e-5, 1e-4, 2e-4, 5e-4, 1e-3, 2e-3, 5e-3)  # s
FAR = 1e4
"""Growth of the amplitude at which a run ends."""
MOTION = ("crank.phi", "crank.w", "output.phi", "output.w")
INERTIAS = np.array([MASSES.motor_inertia, MASSES.load_inertia])


@dataclass(frozen=True)
class Case:
    """An oscillation. start: angles and speeds, rad and rad/s; held: torques on motor and load, N.m; amplitude: of a
    motion, rad."""

    start: Array
    held: tuple[float, float]
    amplitude: Callable[[Array], float]


Master = Callable[[Path, Case, float], Array]
"""(FMU, case, communication step, s) -> the last tenth of the motion, (n, 4), or as far as it stayed bounded."""


def jacobi(fmu: Path, case: Case, step: float) -> Array:
    phi, gamma = MASSES.step_matrices(step)

    def advance(drive: FmuDrive, motion: Array, torques: Array) -> tuple[Array, Array]:
        return phi @ motion + gamma @ (torques + case.held), answer(drive.step(step, named(motion)))

    return run(fmu, case, step, advance)


def sequential(fmu: Path, case: Case, step: float) -> Array:
    def advance(drive: FmuDrive, motion: Array, torques: Array) -> tuple[Array, Array]:
        rise = step / 2 * (torques + case.held) / INERTIAS
        reached = np.array(
            [
                motion[0] + step * (motion[1] + rise[0]),
                motion[1] + rise[0],
                motion[2] + step * (motion[3] + rise[1]),
                motion[3] + rise[1],
            ]
        )
        new = answer(drive.step(step, named(reached)))
        reached[1::2] += step / 2 * (new + case.held) / INERTIAS
        return reached, new

    return run(fmu, case, step, advance)


def linearly_implicit(fmu: Path, case: Case, step: float) -> Array:
    """(I - h/2 A) change = h f, A the Jacobian of the masses' motion f with the drive's torques in it."""

    def advance(drive: FmuDrive, motion: Array, torques: Array) -> tuple[Array, Array]:
        slope = np.array([answer(drive.derivative(ANSWER, {name: 1.0})) for name in MOTION]).T
        a, f = np.zeros((4, 4)), np.zeros(4)
        a[0, 1] = a[2, 3] = 1.0
        a[1::2] = slope / INERTIAS[:, None]
        f[::2], f[1::2] = motion[1::2], (torques + case.held) / INERTIAS
        motion = motion + np.linalg.solve(np.eye(4) - step / 2 * a, step * f)
        return motion, answer(drive.step(step, named(motion)))

    return run(fmu, case, step, advance)


def joint(fmu: Path, case: Case, step: float) -> Array:
    """The kind joint, whose masses are inside; the master only steps it."""
    start = {f"start.{name}": float(value) for name, value in zip(MOTION, case.start, strict=True)}
    torques = dict(zip(("motor.tau", "load.tau"), case.held, strict=True))
    n, kept = round(DURATION / step), []
    with FmuDrive(fmu, parameters=start) as inside:
        inside.initialize(torques)
        for k in range(n):
            outputs = inside.step(step, torques)
            if k >= n - max(n // 10, 4):
                kept.append([outputs[name] for name in MOTION])
    return np.array(kept)


MASTERS: dict[str, tuple[Master, str, str, float]] = {
    "Jacobi": (jacobi, RED, "o", 6),
    "sequential": (sequential, BLUE, "s", 9),
    "linearly implicit": (linearly_implicit, GREEN, "^", 7),
    "kind joint": (joint, PURPLE, ".", 6),
}
"""Master, colour, marker and its size; the sizes differ so that coinciding points remain visible."""
ANSWER = ("crank.tau", "output.tau")


def named(motion: Array) -> dict[str, float]:
    return dict(zip(MOTION, motion.tolist(), strict=True))


def answer(outputs: dict[str, float]) -> Array:
    """Torques of the drive on motor and load, N.m."""
    return np.array([outputs[name] for name in ANSWER])


def run(fmu: Path, case: Case, step: float, advance: Callable[[FmuDrive, Array, Array], tuple[Array, Array]]) -> Array:
    n, motion, kept = round(DURATION / step), case.start.copy(), []
    first = case.amplitude(motion)
    with FmuDrive(fmu) as drive:
        torques = answer(drive.initialize(named(motion)))
        for k in range(n):
            motion, torques = advance(drive, motion, torques)
            if k >= n - max(n // 10, 4) or (k % 50 == 0 and case.amplitude(motion) > FAR * first):
                kept.append(motion)
            if kept and case.amplitude(motion) > FAR * first:
                break
    return np.array(kept)


def small_case(model: JointModel) -> Case:
    """A small oscillation about a load, where the spring is nearly linear."""
    start, held = model.equilibrium(-LOAD)
    rest = start[0] / model.ratio - start[2]
    omega = math.sqrt(float(model.drive.lookup.stiffness(rest)) / MASSES.reduced_inertia(model.ratio))
    start[2] -= SMALL

    def amplitude(motion: Array) -> float:
        return math.hypot(motion[0] / model.ratio - motion[2] - rest, (motion[1] / model.ratio - motion[3]) / omega)

    return Case(start[:4], (float(held[0]), float(held[1])), amplitude)


def large_case(model: JointModel) -> Case:
    """An oscillation released at a load; its amplitude is the twist at which all its energy would be potential."""
    start, _ = model.equilibrium(-SWING)
    twist = np.linspace(0, 2 * model.drive.lookup.twist.stop, 20001)
    torque = np.asarray(model.drive.lookup.torque(twist))
    energy = np.concatenate([[0.0], np.cumsum((torque[1:] + torque[:-1]) / 2 * np.diff(twist))])
    inertia = MASSES.reduced_inertia(model.ratio)

    def amplitude(motion: Array) -> float:
        at, rate = abs(motion[0] / model.ratio - motion[2]), motion[1] / model.ratio - motion[3]
        held = float(np.interp(at, twist, energy)) + max(at - twist[-1], 0.0) * torque[-1] + inertia * rate**2 / 2
        # Beyond the table the amplitude is only a measure of the growth.
        return float(np.interp(held, energy, twist)) * max(1.0, math.sqrt(held / energy[-1]))

    return Case(start[:4], (0.0, 0.0), amplitude)


def main() -> None:
    """Export the FMUs, run all masters, print and draw."""
    parser = argparse.ArgumentParser(description="Four masters around one stiff drive")
    parser.add_argument("folder", nargs="?", default="coupling-masters", type=Path)
    parser.add_argument("--drives", type=int, default=60, help="virtual drives behind the curve (default 60)")
    args = parser.parse_args()
    if not any(shutil.which(name) for name in ("cc", "gcc", "clang")):
        print("This example needs a C compiler on the PATH, for the native FMU.")
        return
    args.folder.mkdir(parents=True, exist_ok=True)

    model = JointModel(build_model(sm.load_drive("drive_1"), n_drives=args.drives), MASSES)
    fmus = {
        "drive": export_fmu(model.drive, args.folder / "drive.fmu", backend="native"),
        "joint": export_fmu(model.drive, args.folder / "joint.fmu", backend="native", masses=MASSES),
    }
    figure = Figure(figsize=(10.4, 4.2), dpi=150, layout="constrained")
    axes = figure.subplots(1, 2, sharey=True)
    cases = {
        f"small oscillation about {LOAD:g} N.m": small_case(model),
        f"oscillation released at {SWING:g} N.m": large_case(model),
    }
    for ax, (title, case) in zip(axes, cases.items(), strict=True):
        label = f"amplitude after {DURATION:g} s, relative to the initial one"
        format_axes(ax, "communication step [ms]", label if ax is axes[0] else "")
        print(f"{title}: {label}")
        print(f"  {'step [ms]':18s}" + "".join(f"{1e3 * h:>8g}" for h in STEPS))
        first = case.amplitude(case.start)
        for name, (master, colour, marker, size) in MASTERS.items():
            fmu = fmus["joint" if name == "kind joint" else "drive"]
            factors = [max(case.amplitude(m) for m in master(fmu, case, h)) / first for h in STEPS]
            print(f"  {name:18s}" + "".join(f"{'unbound' if f > FAR else f'{f:.3g}':>8s}" for f in factors), flush=True)
            ax.plot(
                1e3 * np.array(STEPS),
                np.minimum(factors, FAR),
                marker=marker,
                color=colour,
                lw=1.4,
                ms=size,
                mfc="white" if size > 6 else colour,
                label=name,
                clip_on=False,
            )
        ax.axhline(1.0, color=FAINT, lw=0.8, zorder=0)
        ax.set(xscale="log", yscale="log", xlim=(0.009, 5.5), ylim=(0.01, FAR))
        ax.set_xticks([0.01, 0.1, 1], ["0.01", "0.1", "1"])
        ax.set_yticks([0.01, 0.1, 1, 10, 100, 1000, FAR], ["0.01", "0.1", "1", "10", "100", "1000", "unbounded"])
        ax.set_title(title, loc="left", fontsize="medium", color=INK)
    handles, names = axes[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside upper left", ncols=4, frameon=False)
    figure.savefig(args.folder / "masters.png")
    print(f"picture in {args.folder}")


if __name__ == "__main__":
    main()
