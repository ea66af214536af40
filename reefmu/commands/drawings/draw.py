"""`reefmu draw`: the drive to scale, its contact forces, a turn of the crank, the profile as DXF."""

from __future__ import annotations

import argparse
import math

import numpy as np

from stiffness_model import rotation
from stiffness_model.drawing import sampling
from stiffness_model.drawing.drive import Drive
from stiffness_model.drawing.twist_limits import expect_crank_angle, expect_twists
from stiffness_model.errors import expect, expect_number
from stiffness_model.io.atomic_files import staged_folder
from stiffness_model.kinds import SCALE_PICTURES
from stiffness_model.montecarlo.population import Population
from stiffness_model.plotting.cross_section.animation import write_animation
from stiffness_model.plotting.cross_section.drive_figures import drawing_figure, forces_figure
from stiffness_model.plotting.cross_section.dxf import write_dxf
from stiffness_model.plotting.cross_section.element_forces import ElementForces, solve_element_forces
from stiffness_model.plotting.cross_section.layout import period_turns
from stiffness_model.plotting.cross_section.row_outlines import max_exaggeration
from stiffness_model.units import ARCMIN, MICROMETRE

from ..terminal.drawing_input import output_folder, ree_drawing_with_fields
from ..terminal.notes import show_notes


def run(args: argparse.Namespace) -> int:
    """Draw, print the sizes and the forces, and write the files that were asked for."""
    drive, notes = ree_drawing_with_fields(args.drive, args.fields, "draw", SCALE_PICTURES)
    twist = drive.max_twist
    if args.twist is not None:
        twist = float(expect_twists(drive, args.twist * ARCMIN, "--twist", in_rad=False)[0])
    angle = math.radians(expect_number(args.angle, "a finite angle", "--angle"))
    expect_crank_angle(drive, angle, "--angle")
    exaggeration = expect_number(args.exaggerate, "a factor of at least 1", "--exaggerate", low=1 - 1e-12)
    chord = expect_number(args.chord, "a positive chord error", "--chord", low=0) * MICROMETRE
    folder = output_folder(args, "draw")
    deviations, start, weight = sampling.nominal(drive), 0.0, None
    if args.individual is not None:
        individual = rotation.draw_individual(drive, args.individual)
        # The crank stands at ratio times the output angle.
        start, (deviations, weight) = individual.start, rotation.elements_at(individual, angle / drive.ratio)
    who = "" if args.individual is None else f"individual {args.individual}"
    lines: list[str] = []
    with staged_folder(folder) as stage:
        loads = solve_element_forces(drive, deviations, twist, angle, start, weight)
        maximum = max_exaggeration(drive, loads)
        expect(
            exaggeration <= max(maximum, 1.0),
            f"a factor of at most {maximum:.3g}, where deviations and displacements are drawn as large as an element",
            exaggeration,
            "--exaggerate",
        )
        at_rest = solve_element_forces(drive, sampling.nominal(drive), 0.0, angle)
        drawing_figure(drive, at_rest).savefig(stage / f"drive.{args.format}")
        forces_figure(drive, loads, exaggeration, who).savefig(stage / f"forces.{args.format}")
        if args.dxf:
            profile = write_dxf(drive, stage / "profile.dxf", chord)
            lines.append(
                f"profile.dxf: {len(profile.points)} points, off the profile by at most "
                f"{profile.error / MICROMETRE:.2g} um; mm"
            )
        if args.animate:
            count = write_animation(drive, stage / "turn.gif", twist)
            lines.append(f"turn.gif: {count} pictures, nominal drive; turns of the crank: {period_turns(drive)}")
        names = sorted(file.name for file in stage.iterdir())
    show_notes([*notes, *_uneven(drive)])
    print(_sizes(drive))
    print(_forces(loads))
    for line in lines:
        print(line)
    print(f"\nwritten to {folder}: {', '.join(names)}")
    return 0


def _sizes(drive: Drive) -> str:
    width = drive.seats.wall
    cage = f"cage bars of {1e3 * width:.3g} mm" if width > 0 else f"bores overlap by {-1e3 * width:.3g} mm"
    return (
        f"{drive.name}: {drive.lobes} lobes, ratio {drive.ratio:+g}, {drive.elements_per_row} elements on each of "
        f"{drive.eccentrics} eccentrics; {cage}; profile up to {np.degrees(drive.usable_limit):.1f} deg of 180"
    )


def _uneven(drive: Drive) -> list[str]:
    """A note where the drawn bores differ from those that the other commands assume."""
    count, places = drive.elements_per_row, round(drive.transmission_ratio)
    if places % count == 0:
        return []
    return [
        f"{count} elements occupy {count} of the {places} places that the ratio gives, unevenly; the other "
        "commands assume even spacing (eq. 20), so that their torque differs a little"
    ]


def _forces(loads: ElementForces) -> str:
    forces, lost = loads.significant, loads.not_converged
    # A negative twist loads the other wall of each bore.
    contacts = (0, 1, 2, 3) if loads.twist >= 0 else (0, 1, 3, 2)
    named = zip(Population.contact_names, contacts, strict=True)
    greatest = ", ".join(f"{name} {forces[..., k].max():.4g} N" for name, k in named)
    return (
        f"at {loads.twist / ARCMIN:g} arcmin {loads.torque.sum():.4g} N.m; greatest forces: {greatest}; "
        f"{int(forces.any(axis=-1).sum())} of {forces[..., 0].size} elements carry"
        + (f"; {lost} found no equilibrium and count as no force" if lost else "")
    )
