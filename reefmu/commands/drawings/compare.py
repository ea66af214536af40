"""`reefmu compare`: a drive's stiffness beside published gears."""

from __future__ import annotations

import argparse
import csv
import math
import textwrap
from collections.abc import Sequence
from pathlib import Path

from stiffness_model.catalog.gears import CatalogGear, catalog
from stiffness_model.io.atomic_files import staged_folder
from stiffness_model.kinds import TOLERANCES, lacking
from stiffness_model.montecarlo.twist_torque_curve import TwistTorqueCurve
from stiffness_model.plotting import curves as plots
from stiffness_model.units import ARCMIN

from ..terminal.drawing_input import drawing_with_fields, output_folder
from ..terminal.notes import show_notes
from ..terminal.text_table import aligned_table
from .population_run import run_population


def run(args: argparse.Namespace) -> int:
    """Simulate, print the twists at several torques, and write compare.csv and a picture."""
    drive, notes = drawing_with_fields(args.drive, args.fields)
    gears = catalog(args.catalog)
    drawn = [gear for gear in gears if gear.has_curve]
    folder = output_folder(args, "compare")
    with staged_folder(folder) as stage:
        curve = run_population(drive, args).curve()
        torques = torque_steps(curve.full_torque)
        twists = [_twists(curve, drawn, torque) for torque in torques]
        _write_csv(stage / "compare.csv", drive.name, drawn, torques, twists)
        plots.save(plots.against_catalog(curve, gears), stage / f"compare.{args.format}")
    show_notes(notes)
    letters = [chr(ord("a") + k) if k < 26 else str(k) for k in range(len(drawn))]
    drives = "" if lacking(drive, TOLERANCES) else f", mean of {args.drives} virtual drives,"
    print(f"twist at the output: {drive.name}{drives} and published gears\n")
    rows = [
        [f"{torque:g}", *("-" if math.isnan(twist) else f"{twist:.2f}" for twist in line)]
        for torque, line in zip(torques, twists, strict=True)
    ]
    print(aligned_table(["torque", drive.name, *letters], ["[N.m]", *["[arcmin]"] * (1 + len(drawn))], rows))
    print()
    for letter, gear in zip(letters, drawn, strict=True):
        print(_entry(letter, gear))
    without = [gear for gear in gears if not gear.has_curve]
    if without:
        print("\nwithout a curve:")
        for gear in without:
            print(_entry("-", gear))
    print(f"\nwritten to {folder}: compare.csv, compare.{args.format}")
    return 0


def torque_steps(greatest: float, most: int = 8) -> list[float]:
    """Round torques, N.m, evenly spaced up to `greatest`, at most `most` of them.

    >>> torque_steps(281.3), torque_steps(0.8)
    ([50.0, 100.0, 150.0, 200.0, 250.0], [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8])
    """
    scale = 10.0 ** math.floor(math.log10(greatest / most))
    step = next(s * scale for s in (1, 2, 5, 10, 20) if s * scale * (most + 1) > greatest)
    # Rounded to the step's own digits: 3 * 0.1 is not 0.3.
    digits = max(0, -math.floor(math.log10(step)))
    return [round(step * k, digits) for k in range(1, int(greatest / step + 1e-9) + 1)]


def _twists(curve: TwistTorqueCurve, gears: Sequence[CatalogGear], torque: float) -> list[float]:
    """Twists in arcmin of the drive and the gears; NaN above what a gear's row allows."""
    allowed = [gear.greatest_torque is None or torque <= gear.greatest_torque for gear in gears]
    others = [
        float(gear.twist_at(torque)) / ARCMIN if ok else math.nan for gear, ok in zip(gears, allowed, strict=True)
    ]
    return [float(curve.twist_at(torque)) / ARCMIN, *others]


def _write_csv(
    path: Path, name: str, gears: Sequence[CatalogGear], torques: Sequence[float], twists: Sequence[Sequence[float]]
) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        names = [name, *(gear.label for gear in gears)]
        writer.writerow(["torque [N.m]", *(f"{label} twist [arcmin]" for label in names)])
        for torque, line in zip(torques, twists, strict=True):
            writer.writerow([f"{torque:g}", *("" if math.isnan(twist) else f"{twist:.9g}" for twist in line)])


def _entry(mark: str, gear: CatalogGear) -> str:
    """A gear, and below it the source of its numbers and remarks on them."""
    parts = [gear.source + (f", page {gear.page}" if gear.page else "")]
    if gear.second_hand:
        parts.append("quoted at second hand")
    if gear.note:
        parts.append(gear.note)
    below = textwrap.fill("; ".join(parts), width=100, initial_indent=" " * 5, subsequent_indent=" " * 5)
    return f"  {mark}  {gear.label}\n{below}"
