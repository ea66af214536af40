"""`reefmu curve`: twist over torque, contact forces and load shares of a drawing."""

from __future__ import annotations

import argparse

from stiffness_model.drawing.drive import Drive
from stiffness_model.drawing.tolerances import clearance_offset
from stiffness_model.io.atomic_files import staged_folder
from stiffness_model.kinds import CONTACT_FORCES, INDIVIDUALS, TOLERANCES, AnyDrive, expect_has, kind_of, lacking
from stiffness_model.montecarlo.population import Population
from stiffness_model.montecarlo.twist_torque_curve import BACKLASH_SHARE, LOST_MOTION_SHARE, TwistTorqueCurve
from stiffness_model.plotting import curves as plots
from stiffness_model.units import ARCMIN

from ..terminal.drawing_input import drawing_with_fields, output_folder
from ..terminal.json_output import print_json
from ..terminal.notes import show_notes
from ..terminal.text_table import aligned_table
from . import turning_files, turning_individual
from .curve_summary import curve_summary, play
from .load_ratings import rate_loads
from .population_run import run_population

ROWS = 13
"""Rows of the printed table, chosen by judgement; curve.csv has all of them."""


def run(args: argparse.Namespace) -> int:
    """Simulate, print, and write curve.csv and pictures: of the curve and, with contacts, of forces and load shares."""
    drive, notes = drawing_with_fields(args.drive, args.fields)
    if args.individual is not None:
        expect_has(drive, INDIVIDUALS, "curve --individual")
    folder = output_folder(args, "curve")
    with staged_folder(folder) as stage:
        population = run_population(drive, args)
        curve = population.curve()
        ratings = rate_loads(population) if isinstance(drive, Drive) else None
        curve.write_csv(stage / "curve.csv", None if ratings is None else ratings.columns())
        pictures = {f"curve.{args.format}": plots.twist_over_torque(curve)}
        if not lacking(drive, CONTACT_FORCES):
            pictures[f"forces.{args.format}"] = plots.contact_forces(population)
            pictures[f"load_share.{args.format}"] = plots.load_share(population)
        for name, axes in pictures.items():
            plots.save(axes, stage / name)
        written = ["curve.csv", *pictures]
        turned = None if args.individual is None else turning_individual.turn_individual(drive, args.individual)
        if turned is not None:
            written += turning_files.write_files(turned, stage, args.format)
        if args.interactive:
            from . import interactive_page

            notes = [*notes, *interactive_page.write_page(drive, args.individual, stage)]
            written.append(interactive_page.PAGE)
    missing = [lacking(drive, what) for what in (TOLERANCES, CONTACT_FORCES)]
    show_notes([*notes, *(reason for reason in missing if reason)])
    if args.json:
        individual = {} if turned is None else {"individual": turning_individual.figures(turned)}
        summary = curve_summary(drive, curve, population, ratings)
        print_json(summary | individual | {"folder": str(folder), "files": written})
        return 0
    print(f"{drive.name}: {_population_text(drive, population)}\n")
    print(_twist_table(drive, curve))
    print()
    print(_motion(drive, curve))
    print()
    if ratings is None:
        print("\n".join(population.lines()))
    else:
        print("\n".join([*ratings.lines(), "", _elements(population)]))
    if turned is not None:
        print()
        print(turning_individual.summary(turned))
    print(f"\nwritten to {folder}: {', '.join(written)}")
    return 0


def _population_text(drive: AnyDrive, population: Population) -> str:
    if lacking(drive, TOLERANCES):
        return kind_of(drive).noun
    return f"{population.n_drives} virtual drives, seed {population.seed}"


def _twist_table(drive: AnyDrive, curve: TwistTorqueCurve) -> str:
    """The curve at some twists, with its band where the drives scatter."""
    step = max(1, (len(curve.twist) - 1) // (ROWS - 1))
    torques = {"torque": curve.torque}
    if not lacking(drive, TOLERANCES):
        torques = {"mean torque": curve.torque, "P10": curve.torque_p10, "P90": curve.torque_p90}
    columns = (curve.twist / ARCMIN, *torques.values(), curve.stiffness * ARCMIN)
    # Adding zero turns a rounded "-0.00" into "0.00".
    shown = sorted({*range(0, len(curve.twist), step), len(curve.twist) - 1})
    rows = [[f"{round(float(column[i]), 2) + 0.0:.2f}" for column in columns] for i in shown]
    return aligned_table(
        ["twist", *torques, "stiffness"],
        ["[arcmin]", *("[N.m]" for _ in torques), "[N.m/arcmin]"],
        rows,
    )


def _motion(drive: AnyDrive, curve: TwistTorqueCurve) -> str:
    full, width = curve.full_torque, play(drive, curve)
    lines = [
        f"lost motion  {curve.lost_motion() / ARCMIN:8.3f} arcmin  "
        f"(between +-{100 * LOST_MOTION_SHARE:g} % of {full:.4g} N.m)",
    ]
    if width is not None:
        carried = f"(carries less than {100 * BACKLASH_SHARE:g} % of {full:.4g} N.m)"
        lines.insert(0, f"play         {width / ARCMIN:8.3f} arcmin  {carried}")
    return "\n".join(lines)


def _remedy(population: Population) -> str:
    """The offset of the bores that gives a clearance of three sigma; empty where they have it, or 0.1 sigma less."""
    drive = population.drive
    offset = clearance_offset(drive.tolerances["cage"].window, drive.tolerances["element"])
    if drive.tolerances["cage"].offset > offset - 0.1 * drive.tolerances["cage"].sigma:
        return ""
    return (
        f";\n    bores with a mean radius {1e6 * offset:.3g} um above nominal (cage_offset, or a fit) clear all "
        "but 0.13 %"
    )


def _elements(population: Population) -> str:
    """How many elements carry load, have play or are left out, in words."""
    counts = population.status_counts
    cases = sum(counts.values())
    elements = population.n_drives * population.drive.elements
    carrying = counts["loaded"] + counts["iterated"]
    lines = [
        f"{elements} elements at {len(population.twist)} twists each:",
        f"  {100 * carrying / cases:5.1f} %  carry load",
        f"  {100 * counts['unloaded'] / cases:5.1f} %  have play",
        f"  {100 * counts['excluded'] / cases:5.1f} %  stand where the profile is cut away and carry nothing",
    ]
    larger = population.interference_count
    if larger:
        lines.append(
            f"  {larger} elements ({100 * larger / elements:.2g} %) are larger than their "
            f"bores and press both walls{_remedy(population)}"
        )
    if counts["not_converged"]:
        lines.append(f"  {counts['not_converged']} cases found no equilibrium and count as no force")
    if population.capped_count:
        lines.append(
            f"  {population.capped_count} elements lie closer in their bore than Hertz's theory reaches; "
            "their cage stiffness is capped"
        )
    return "\n".join(lines)
