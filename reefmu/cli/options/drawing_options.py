"""Options of the commands that take or make a drawing: demo, new, curve, compare, draw."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..argument_types import (
    MAX_DRIVES,
    add_command,
    add_drawing,
    add_format,
    add_json,
    add_seed,
    file_name,
    quantity,
    whole_number,
)

if TYPE_CHECKING:
    from ..argument_types import Commands


def add_demo(commands: Commands) -> None:
    """`reefmu demo`."""
    parser = add_command(
        commands,
        "",
        "demo",
        "all steps for the preset workshop, from the drawing to a joint under control",
        "Writes pictures, curve.csv and an FMU.",
    )
    parser.add_argument("--out", metavar="DIR", type=file_name, help="folder for the files (default reefmu-demo)")
    add_format(parser)


def add_curve(commands: Commands) -> None:
    """`reefmu curve`."""
    parser = add_command(
        commands,
        "drawings",
        "curve",
        "twist over torque, contact forces and load shares of a drawing",
        "Writes curve.csv and pictures of the curve and, where the drive has contacts, of forces and load shares.",
    )
    _add_population(parser, "curve")
    add_json(parser)
    parser.add_argument(
        "--individual",
        metavar="SEED",
        type=whole_number(0),
        help="one virtual drive turning, beside the population: torque over twist and angle, "
        "transmission error, order spectra; writes tables and pictures individual_*",
    )
    parser.add_argument(
        "--interactive",
        action="store_true",
        help="also write interactive.html, a page that runs the drive in a browser (needs the extra native)",
    )


def add_compare(commands: Commands) -> None:
    """`reefmu compare`."""
    parser = add_command(
        commands,
        "drawings",
        "compare",
        "a drive's stiffness beside published gears",
        "Writes compare.csv and a picture.",
    )
    _add_population(parser, "compare")
    parser.add_argument(
        "--catalog", metavar="FILE", help="TOML file with further gears, in the form of the included catalog.toml"
    )


def add_new(commands: Commands) -> None:
    """`reefmu new`."""
    parser = add_command(
        commands,
        "drawings",
        "new",
        "a new drawing to edit, every field in it with its meaning, unit and default",
        "The drawing has the values of an example of its kind and runs at once: reefmu curve FILE.toml.",
    )
    parser.add_argument("file", metavar="FILE.toml", type=file_name, help="the drawing to write")
    parser.add_argument(
        "--kind",
        metavar="KIND",
        default="rolling element eccentric",
        help='kind of the drive: "rolling element eccentric" (default), cycloidal or catalogue (a data sheet)',
    )
    parser.add_argument("--force", action="store_true", help="replace a file that exists")


def add_draw(commands: Commands) -> None:
    """`reefmu draw`."""
    parser = add_command(
        commands,
        "drawings",
        "draw",
        "a drawing to scale: the drive, its contact forces, a turn, a DXF for the workshop",
        "Writes pictures of the drive and of its forces; turn.gif and profile.dxf where asked for.",
    )
    add_drawing(parser, "draw")
    add_format(parser)
    parser.add_argument(
        "--twist",
        metavar="ARCMIN",
        type=quantity("angle", "arcmin"),
        help="twist at the output under which the forces are drawn (default the drawing's max_twist)",
    )
    parser.add_argument(
        "--angle",
        metavar="DEG",
        type=quantity("angle", "deg"),
        default=0.0,
        help="angle of the first eccentric (default 0)",
    )
    parser.add_argument(
        "--individual",
        metavar="SEED",
        type=whole_number(0),
        help="forces of one virtual drive, that of `curve --individual SEED` (default: a drive without deviations)",
    )
    parser.add_argument(
        "--exaggerate",
        metavar="N",
        type=float,
        default=1.0,
        help="in the picture of the forces, draw deviations and displacements N times as large (default 1: to scale)",
    )
    parser.add_argument("--animate", action="store_true", help="write turn.gif: one period of the motion")
    parser.add_argument("--dxf", action="store_true", help="write profile.dxf: gear profile and bores in mm")
    parser.add_argument(
        "--chord",
        metavar="UM",
        type=quantity("length", "um"),
        default=0.1,
        help="greatest distance of the DXF's polyline from the profile, um (default 0.1)",
    )


def _add_population(parser: argparse.ArgumentParser, command: str) -> None:
    """Options of the commands that simulate a population of one drive."""
    add_drawing(parser, command)
    add_format(parser)
    parser.add_argument(
        "--drives", metavar="N", type=whole_number(1, MAX_DRIVES), default=1000, help="virtual drives (default 1000)"
    )
    add_seed(parser)
