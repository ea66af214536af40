"""Signatures of the effects
=========================

The signature of every effect: the measured torque with it, and its difference from the model of the drawing.

One picture for each effect. Left: the torque that a rig would measure, grey without the effect, in colour with it.
Right: the difference, over the coordinate that shows the effect. The motions are those of a rig: loops with the crank
locked, a hold, rotation in both senses, a warm run, a run after many turns.

::

    python examples/effect_signatures.py [FOLDER] [--drives N]

writes backlash.png, preload.png and so on to FOLDER (default effect-signatures).
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

import stiffness_model as sm
from reefmu.effects import EFFECTS
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.record import Record, make_record
from reefmu.simulate import simulate_record
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.numerics.arrays import Array
from stiffness_model.plotting.style import (
    BLUE,
    FAINT,
    GREEN,
    INK,
    ORANGE,
    PURPLE,
    RED,
    format_axes,
    headline,
    new_figure,
)
from stiffness_model.plotting.text_fit import fit_text
from stiffness_model.units import quantity_text

ARCMIN = np.pi / 10800
TURN = 2 * np.pi
RATIO = -29.0
COLOURS = (BLUE, ORANGE, PURPLE, GREEN, RED)
TORQUE = "torque [N.m]"
CHANGE = "what the effect adds [N.m]"
COORDINATES = {
    "twist": "twist [arcmin]",
    "torque": "torque of the drawing [N.m]",
    "time": "time [s]",
    "turns": "turns of the crank",
    "angle": "crank angle within the turn [deg]",
    "output": "output angle [deg]",
    "speed": "speed of the output [rad/s]",
    "rate": "rate of the twist [arcmin/s]",
    "hours": "time [h]",
}


class Run(NamedTuple):
    """One run on the rig; time, s, crank angle, rad, and twist, rad, (n,); temperature, degC."""

    label: str
    time: Array
    crank: Array
    twist: Array
    temperature: float = 20.0


def loop(
    label: str,
    reach: float = 6.0,
    *,
    seconds: float = 40.0,
    crank: float = 0.0,
    temperature: float = 20.0,
    start: float = 0.0,
) -> Run:
    """One and a quarter loops to +-`reach` arcmin with the crank locked."""
    t = np.linspace(0, 1.25, 1250)
    twist = reach * ARCMIN * np.interp(t, [0, 0.25, 0.75, 1.25], [0, 1, -1, 1])
    return Run(label, start + seconds * t, np.full(t.shape, crank), twist, temperature)


def hold(label: str, reach: float = 6.0) -> Run:
    """To `reach` arcmin within 5 s, held for 150 s, back within 5 s, held again."""
    t = np.linspace(0, 260, 2601)
    return Run(label, t, 0 * t, reach * ARCMIN * np.interp(t, [0, 5, 155, 160], [0, 1, 1, 0]))


def turning(label: str, turns: float, *, first: float = 0.0, twist: float = 4.0, seconds: float = 60.0) -> Run:
    """The crank turns slowly at a constant twist, arcmin."""
    t = np.linspace(0, 1, int(400 * abs(turns)) + 1)
    return Run(label, seconds * t, TURN * (first + turns * t), np.full(t.shape, twist * ARCMIN))


def oscillation(*speeds: float, twist: float = 4.0) -> Callable[[], list[Run]]:
    """The output oscillates over 20 deg, with these greatest speeds, rad/s, at a constant twist, arcmin."""

    def runs() -> list[Run]:
        angle = np.linspace(-0.25, 1.0, 2501) * TURN  # from a point of zero speed
        output = np.radians(10) * np.sin(angle)
        held = np.full(angle.shape, twist * ARCMIN)
        path = (angle - angle[0]) * np.radians(10)
        return [Run(f"up to {speed:g} rad/s", path / speed, RATIO * (output + held), held) for speed in speeds]

    return runs


@dataclass(frozen=True)
class Signature:
    """How an effect is shown. values: of its parameters; left, right: names of `COORDINATES` for the axes; reads: the
    output that is drawn."""

    values: Mapping[str, float]
    runs: Callable[[], Sequence[Run]]
    left: str
    right: str
    reads: str = "measured.tau"


def loops(*reaches: float) -> Callable[[], list[Run]]:
    """Runs with loops of several amplitudes, arcmin."""
    return lambda: [loop(f"to {reach:g} arcmin", reach) for reach in reaches]


SIGNATURES: dict[str, Signature] = {
    "backlash": Signature({"clearance": 6e-6}, loops(6), "twist", "twist"),
    "preload": Signature({"clearance": 6e-6}, loops(6), "twist", "twist"),
    "thermal_clearance": Signature(
        {"rate": 3e-7}, lambda: [loop(f"{t:g} degC", temperature=t) for t in (10.0, 20.0, 35.0, 50.0)], "twist", "twist"
    ),
    "wear": Signature(
        {"rate": 1e-9}, lambda: [loop(f"after {n:g} turns", crank=TURN * n) for n in (0, 500, 1500)], "twist", "twist"
    ),
    "modulus_error": Signature({"error": -0.3}, loops(8), "twist", "torque"),
    "missing_ball": Signature(
        {"size": 1.0, "phase": 1.0},
        lambda: [turning(f"turn {first + 1}", 1.0, first=first) for first in (0, 6, 12)],
        "angle",
        "angle",
    ),
    "kinematic_error": Signature(
        {"amplitude_1": 1e-4, "phase_1": 0.5, "amplitude_2": 5e-5},
        lambda: [turning(f"at {twist:g} arcmin", 2.0, twist=twist) for twist in (2.0, 5.0)],
        "turns",
        "turns",
    ),
    "structural_compliance": Signature({"compliance": 3e-6}, loops(8), "twist", "torque"),
    "creep": Signature({"compliance": 1e-6, "time": 30.0}, lambda: [hold("held at 6 arcmin")], "time", "time"),
    "hysteresis": Signature({"torque": 12.0, "presliding": 5e-5}, loops(2, 4, 6), "twist", "torque"),
    "load_dependent_hysteresis": Signature({"fraction": 0.1, "presliding": 5e-5}, loops(2, 4, 6), "twist", "torque"),
    "damping": Signature(
        {"coefficient": 2e3}, lambda: [loop(f"loop of {s:g} s", seconds=s) for s in (1.0, 10.0, 100.0)], "twist", "rate"
    ),
    "coulomb_friction": Signature({"torque": 5.0}, oscillation(1.0, 0.3), "output", "speed", "output.tau"),
    "viscous_friction": Signature({"coefficient": 6.0}, oscillation(1.0, 0.3, 0.1), "output", "speed", "output.tau"),
    "stribeck_friction": Signature(
        {"torque": 5.0, "speed": 0.2}, oscillation(1.0, 0.3, 0.1), "output", "speed", "output.tau"
    ),
    "elastoplastic_friction": Signature(
        {"torque": 5.0, "stribeck": 0.3}, oscillation(1.0, 0.3, 0.1), "output", "speed", "output.tau"
    ),
    "crank_friction": Signature(
        {"torque": 0.05, "fraction": 0.1, "viscous": 2e-3}, oscillation(1.0, 0.3), "output", "speed", "crank.tau"
    ),
    "torque_sensor_offset": Signature({"torque": -8.0}, loops(6), "twist", "torque"),
    "torque_sensor_drift": Signature(
        {"rate": 2e-3},
        lambda: [loop(f"from {h:g} h on", seconds=2000, start=3600 * h) for h in (0.0, 1.0, 2.0)],
        "twist",
        "hours",
    ),
}


def record_of(runs: Sequence[Run]) -> Record:
    """Join runs to one record; a clock that starts anew in a run remains so."""
    joined = {name: np.concatenate([getattr(r, name) for r in runs]) for name in ("time", "crank", "twist")}
    return make_record(
        {
            "time": joined["time"],
            "run": np.repeat(np.arange(len(runs)), [len(r.time) for r in runs]),
            "crank_angle": joined["crank"],
            "output_angle": joined["crank"] / RATIO - joined["twist"],
            "output_torque": np.zeros(len(joined["time"])),
            "temperature": np.concatenate([np.full(len(r.time), r.temperature) for r in runs]),
        }
    )


def coordinate(name: str, run: Run, torque: Array) -> Array:
    """Values along an axis of a picture. torque: without the effect, N.m."""
    output = run.crank / RATIO - run.twist
    return {
        "twist": lambda: run.twist / ARCMIN,
        "torque": lambda: torque,
        "time": lambda: run.time,
        "turns": lambda: run.crank / TURN,
        "angle": lambda: np.degrees(run.crank - run.crank[0]),
        "output": lambda: np.degrees(output),
        "speed": lambda: np.gradient(output, run.time),
        "hours": lambda: run.time / 3600,
        "rate": lambda: np.gradient(run.twist, run.time) / ARCMIN,
    }[name]()


def draw(name: str, plain: DriveModel, lookup: Lookup) -> Figure:
    """The picture of one effect."""
    shown, effect = SIGNATURES[name], EFFECTS[name]
    runs = list(shown.runs())
    record = record_of(runs)
    model = build_model(plain.drive, {name: shown.values}, lookup=lookup)
    before, after = (simulate_record(m, record)[shown.reads] for m in (plain, model))
    figure = new_figure(9.2, 4.6)
    left, right = figure.subplots(1, 2)
    for k, (run, first) in enumerate(zip(runs, record.starts, strict=True)):
        part = slice(first, first + len(run.time))
        along_left, along_right = (coordinate(axis, run, before[part]) for axis in (shown.left, shown.right))
        left.plot(along_left, before[part], color=FAINT, linewidth=2.4, label="as drawn" if k == 0 else None, zorder=1)
        left.plot(along_left, after[part], color=COLOURS[k], linewidth=1.3, label=run.label, zorder=9 - k)
        # Where runs coincide, later ones are thinner, so that all remain visible.
        width = len(runs) - k + 0.3 if shown.right in ("speed", "rate") else 1.3
        right.plot(along_right, (after - before)[part], color=COLOURS[k], linewidth=width, zorder=2 + k)
    format_axes(left, COORDINATES[shown.left], TORQUE)
    format_axes(right, COORDINATES[shown.right], CHANGE)
    right.axhline(0, color=FAINT, linewidth=1, zorder=1)
    left.set_title(" ", fontsize="small")  # room for the legend, which may reach over the other axes
    left.legend(
        loc="lower left", bbox_to_anchor=(-0.02, 1.0), ncols=5, frameon=False, fontsize="small", labelcolor=INK
    ).set_in_layout(False)
    headline(figure, heading(name), "medium")
    excitation = fit_text("excitation: " + effect.excitation.replace("`", ""), 9.0, "small")
    figure.supxlabel(excitation, x=0.01, ha="left", fontsize="small", color=INK)
    return figure


def heading(name: str) -> str:
    """Title with name, parameters and equation of an effect."""
    effect, values = EFFECTS[name], SIGNATURES[name].values
    units = {p.name: p.unit for p in effect.parameters}
    sizes = ", ".join(parameter_text(key, value, units[key]) for key, value in values.items())
    return f"{effect.title} ({name}: {sizes})\n{effect.equation}"


def parameter_text(name: str, value: float, unit: str) -> str:
    """A parameter with its value and unit."""
    return f"{name} {quantity_text(value, unit)}"


def main() -> None:
    """Draw all pictures."""
    parser = argparse.ArgumentParser(description="The signature of every effect")
    parser.add_argument("folder", nargs="?", default="effect-signatures", type=Path)
    parser.add_argument("--drives", type=int, default=60, help="virtual drives behind the curve (default 60)")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    plain = build_model(sm.load_drive("drive_1"), n_drives=args.drives)
    assert plain.drive.ratio == RATIO
    for name in EFFECTS:
        draw(name, plain, plain.lookup).savefig(args.folder / f"{name}.png")
    print(f"{len(EFFECTS)} pictures in {args.folder}")


if __name__ == "__main__":
    main()
