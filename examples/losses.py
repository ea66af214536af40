"""Losses of a drive
=================

Power out over power in of a native FMU, with the crank driving and with the output driving, over torque and speed.

A drawing with ``friction_coefficient`` gives a model that contains friction at the crank (the effect
``crank_friction``). The FMU turns at constant twist in both directions of power, and its efficiency is compared with
the friction analysis of the same drawing (``stiffness_model.ratings.efficiency``), from 0.1 % of full torque on; for
the other presets the law of the friction is compared with the analysis. The analysis states dry friction alone; a
viscous part, here of a grease that is assumed, adds a loss that grows with the speed.

::

    python examples/losses.py [FOLDER]

writes efficiency.png to FOLDER (default losses) and prints the efficiencies. Needs a C compiler.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import stiffness_model as sm
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.model.drive_model import build_model
from stiffness_model.numerics.arrays import Array
from stiffness_model.plotting import style
from stiffness_model.ratings.efficiency import FrictionLosses, contact_friction, expected_losses
from stiffness_model.transmission_losses import preloaded_loss

COEFFICIENT = 0.05
SHARES = np.array([0.003, 0.007, 0.012, 0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.45, 0.6, 0.8, 1.0])
"""Twists over the greatest one."""
SPEEDS = (10.0, 100.0, 300.0)
"""rad/s of the crank."""
VISCOUS = 1e-4
"""N.m.s/rad at the crank: assumed, so that the viscous loss at 300 rad/s is 0.03 N.m."""


def main(folder: Path) -> None:
    """Compute, print and draw."""
    folder.mkdir(parents=True, exist_ok=True)
    drive = sm.load_drive("workshop", friction_coefficient=COEFFICIENT)
    losses = expected_losses(drive, SHARES * drive.max_twist)
    model = build_model(drive, {"crank_friction": {"viscous": 0.0}})
    fmu = export_fmu(model, folder / "workshop.fmu", backend="native")
    dry = efficiencies(fmu, losses.twist, SPEEDS[0], 0.0)
    print_table(losses, dry)
    print_law_errors()
    greased = {speed: efficiencies(fmu, losses.twist, speed, VISCOUS) for speed in SPEEDS}
    for speed, found in greased.items():
        print(
            f"with {VISCOUS:g} N.m.s/rad at {speed:g} rad/s: {text(found[0][-1])} driving, {text(found[1][-1])} driven"
        )
    draw(losses, dry, greased).savefig(folder / "efficiency.png")


def efficiencies(fmu: Path, twists: Array, speed: float, viscous: float) -> tuple[Array, Array]:
    """Power out over power in of the FMU at these twists, (n,) rad, with the crank driving and with the output driving.

    speed: of the crank, rad/s; viscous: of the friction at the crank, N.m.s/rad.
    """
    found = np.empty((2, len(twists)))
    with FmuDrive(fmu, parameters={"crank_friction.viscous": viscous}) as drive:
        ratio = drive.set_values["ratio"]
        for k, twist in enumerate(twists):
            # A positive twist makes a positive torque on the output, which then drives what turns in its sense.
            for row, sense in enumerate((1, -1)):
                crank_speed = sense * np.copysign(speed, ratio)
                drive.reset({"crank_friction.viscous": viscous})
                outputs = drive.initialize({"output.phi": -twist})
                for crank in crank_speed * np.linspace(0, 0.5 / speed, 20)[1:]:
                    inputs = {"crank.phi": crank, "crank.w": crank_speed}
                    inputs |= {"output.phi": crank / ratio - twist, "output.w": crank_speed / ratio}
                    outputs = drive.step(0.5 / speed / 19, inputs)
                at_output, at_crank = outputs["output.tau"] / ratio, -outputs["crank.tau"]
                found[row, k] = at_output / at_crank if sense > 0 else at_crank / at_output
    # Where both shafts must be driven, the quotient of the powers is negative.
    return found[0], np.maximum(found[1], 0)


def print_table(losses: FrictionLosses, dry: tuple[Array, Array]) -> None:
    """The efficiencies of analysis and FMU, and their greatest difference."""
    analysis = losses.mean_efficiencies()
    print(" torque    crank driving       output driving")
    print("  [N.m]  analysis     FMU    analysis     FMU")
    for k, torque in enumerate(losses.torque.mean(axis=0)):
        cells = [f"{torque:7.1f}", *(f"{text(x[k]):>9}" for pair in zip(analysis, dry, strict=True) for x in pair)]
        print(" ".join(cells))
    worst = max(np.abs(a - b).max() for a, b in zip(analysis, dry, strict=True))
    print(f"greatest difference {100 * worst:.2f} points")


def print_law_errors() -> None:
    """The greatest difference of efficiencies by the law of the friction from the analysis, over all loads."""
    print("greatest difference at any load, points: crank driving, output driving")
    for name in ("drive_1", "drive_2", "drive_3", "workshop"):
        cells = []
        for coefficient in (0.05, 0.1, 0.3):
            drive = sm.load_drive(name, friction_coefficient=coefficient)
            losses = expected_losses(drive, SHARES * drive.max_twist)
            useful = np.abs(losses.torque.mean(axis=0) / drive.ratio)
            lost = preloaded_loss(contact_friction(drive)["crank_friction"], useful)
            law = (useful / (useful + lost), np.maximum(1 - lost / useful, 0))
            worst = [np.abs(a - b).max() for a, b in zip(losses.mean_efficiencies(), law, strict=True)]
            cells.append(f"{coefficient:g}: {100 * worst[0]:.2f}, {100 * worst[1]:.2f}")
        print(f"{name:10} coefficient {'; '.join(cells)}")


def text(efficiency: float) -> str:
    """An efficiency in per cent; one that is not above 0 is that of a drive that locks."""
    return f"{100 * efficiency:.1f} %" if efficiency > 0 else "locks"


def draw(losses: FrictionLosses, dry: tuple[Array, Array], greased: dict[float, tuple[Array, Array]]) -> Figure:
    """Left: analysis and FMU, both directions; right: with a viscous part, at several speeds."""
    figure = Figure(figsize=(9.6, 4.6), dpi=150, layout="constrained")
    left, right = figure.subplots(1, 2, sharey=True)
    torque = losses.torque.mean(axis=0)
    names = ("crank driving", "output driving")
    for name, colour, mark, expected, found in zip(
        names, (style.BLUE, style.RED), "os", losses.mean_efficiencies(), dry, strict=True
    ):
        left.plot(torque, 100 * expected, color=colour, label=f"{name}, analysis")
        left.plot(torque, 100 * found, mark, color=colour, markerfacecolor="white", label=f"{name}, FMU")
    for (speed, found), line in zip(greased.items(), style.DRIVES, strict=False):
        right.plot(torque, 100 * found[0], color=line.colour, label=f"crank driving, {speed:g} rad/s")
        right.plot(torque, 100 * found[1], "--", color=line.colour, label=f"output driving, {speed:g} rad/s")
    style.format_axes(left, "torque at the output [N.m]", "power out over power in [%]")
    style.format_axes(right, "torque at the output [N.m]", "")
    for axes in (left, right):
        axes.set_xscale("log")
        style.legend_above(axes)
    return figure


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "losses"))
