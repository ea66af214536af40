"""From a record to an FMU and back
================================

From a measured record to an FMU with the missing effects, and back to the record.

::

    record -> reefmu diagnose -> model.toml -> reefmu export -> FMU -> simulation of the record -> the same gap

::

    python examples/diagnosis_round_trip.py [FOLDER] [--record FILE --drive DRIVE]

writes the results, an FMU of each back end and round_trip.png to FOLDER (default diagnosis-round-trip). The record
beside this file, hidden_effect.csv.gz, was made with the equations of tests/validation/blind, not with those of this
package: drive_1 with 1.26 um more gear clearance than drawn and a friction of 5.9 % of the load, noise 1.1 N.m.
"""

from __future__ import annotations

import argparse
import json
import shutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from reefmu.cli import main as reefmu
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.report.corrected_model import denoised_record
from reefmu.fmu.importer.replay import replay_record
from reefmu.model.drive_model import build_model
from reefmu.model.model_file import load_model
from reefmu.record import Record, read_record
from reefmu.simulate import Response, simulate_record
from stiffness_model.numerics.arrays import Array
from stiffness_model.plotting.style import BLUE, INK, RED, format_axes, legend_above, new_figure
from stiffness_model.units import ARCMIN


def run(*words: str) -> None:
    """One call of the command line."""
    print("\n$ reefmu " + " ".join(words))
    assert reefmu(list(words)) == 0


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def replays(folder: Path, measured: Record, zero: float) -> dict[str, Array]:
    """Measured torque over the record: of the drawing's model, of model.toml, and of the FMUs exported from it.

    All get the twist without the noise of the encoder, which moves no friction; it is added through the stiffness.
    """
    model = load_model(folder / "model.toml")
    record, jitter = denoised_record(make_trace(measured, model.drive.ratio), zero)
    runs: dict[str, Mapping[str, Array] | Response] = {
        "model as drawn, reefmu.simulate": simulate_record(build_model(model.drive), record),
        "model.toml, reefmu.simulate": simulate_record(model, record),
    }
    for backend in ("python", "native"):
        if backend == "native" and not any(map(shutil.which, ("cc", "gcc", "clang"))):
            print("\nno C compiler: no native FMU")
            continue
        fmu = folder / f"{backend}.fmu"
        run("export", str(folder / "model.toml"), "-o", str(fmu), "--backend", backend)
        runs[f"{backend} FMU, through FMPy"] = replay_record(fmu, record)
    return {name: outputs["measured.tau"] + outputs["stiffness"] * jitter for name, outputs in runs.items()}


def picture(record: Record, ratio: float, found: Mapping[str, Array], path: Path) -> None:
    """Draw the widest loop, and the gap over the record."""
    starts = [*record.starts.tolist(), len(record)]
    twist = record.twist(ratio) / ARCMIN
    widest = max(range(len(starts) - 1), key=lambda k: float(np.ptp(twist[starts[k] : starts[k + 1]])))
    inside = slice(starts[widest], starts[widest + 1])
    figure = new_figure(11, 4.4)
    left, right = figure.subplots(1, 2, width_ratios=(1, 1.4))
    lines = list(found.items())
    drawn, last = lines[0], lines[-1]
    left.plot(twist[inside], record.output_torque[inside], ".", ms=3, color=INK, label="measured")
    left.plot(twist[inside], drawn[1][inside], "-", lw=1, color=RED, label=drawn[0])
    left.plot(twist[inside], last[1][inside], "-", lw=1, color=BLUE, label=last[0])
    for (name, torque), colour in zip((drawn, last), (RED, BLUE), strict=True):
        gap = record.output_torque - torque
        right.plot(gap, lw=0.6, color=colour, label=f"{name}: {rms(gap):.2f} N.m rms")
    format_axes(left, "twist [arcmin]", "torque [N.m]")
    format_axes(right, "sample", "measured - model [N.m]")
    legend_above(left, f"run {record.run[starts[widest]]}, the widest")
    legend_above(right, "gap over the record")
    figure.savefig(path)


def main(arguments: list[str] | None = None) -> dict[str, float]:
    """Run the round trip; gaps, N.m rms, by simulation."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default="diagnosis-round-trip", type=Path)
    parser.add_argument("--record", default=Path(__file__).with_name("hidden_effect.csv.gz"), type=Path)
    parser.add_argument("--drive", default="drive_1")
    args = parser.parse_args(arguments)
    run("diagnose", str(args.record), "--drive", args.drive, "--out", str(args.folder))
    answer = json.loads((args.folder / "diagnosis.json").read_text("utf-8"))
    measured = read_record(args.record)
    found = replays(args.folder, measured, answer["base"]["zero [rad]"])
    gap = answer["gap"]
    gaps = {
        "diagnosis.json, before": gap["before"],
        "diagnosis.json, after": gap["after"],
        **{name: rms(measured.output_torque - torque) for name, torque in found.items()},
        "noise": gap["noise"],
    }
    print("\n" + "\n".join(f"{name:34s} {value:7.3f} N.m" for name, value in gaps.items()))
    picture(measured, load_model(args.folder / "model.toml").drive.ratio, found, args.folder / "round_trip.png")
    print(f"\nwritten to {args.folder}: report.html, model.toml, FMUs, round_trip.png")
    return gaps


if __name__ == "__main__":
    main()
