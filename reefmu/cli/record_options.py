"""Options of the commands that take measured records: diagnose, record."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from .argument_types import add_command, assignment, file_name

if TYPE_CHECKING:
    from .argument_types import Commands


def add_diagnose(commands: Commands) -> None:
    """`reefmu diagnose`."""
    parser = add_command(
        commands,
        "records",
        "diagnose",
        "what is missing in the model of a drive, from a measured record",
        "Names and fits the missing effects, or says that the record does not decide. Writes diagnosis.json, "
        "report.html and model.toml.",
    )
    parser.add_argument(
        "records",
        metavar="RECORD",
        nargs="+",
        help="measured records, .csv or .csv.gz with `name [unit]` headers; several give a table of their effects",
    )
    base = parser.add_mutually_exclusive_group(required=True)
    base.add_argument("--drive", metavar="DRIVE", help="the drive: a preset, a gear of `reefmu gears` or a TOML file")
    base.add_argument("--curve", metavar="CURVE.csv", help="a twist-torque curve, for a gear without a drawing")
    base.add_argument("--power-law", action="store_true", help="for a gear without either: fit a power law")
    parser.add_argument(
        "--exponent",
        metavar="X|shared",
        help="exponent of the power law, which then has a dead band: a number, or the one within 1 ... 2 that all "
        "records share (default: fitted to each record)",
    )
    _add_locked(parser)
    parser.add_argument("--out", metavar="DIR", type=file_name, required=True, help="folder for the results")
    _add_columns(parser)


def add_record(commands: Commands) -> None:
    """`reefmu record`."""
    parser = add_command(
        commands,
        "records",
        "record",
        "what a measured record holds, and what can be diagnosed from it",
        "Prints columns with their units and conversions, runs, sampling, ranges, repeats, the effects that the record "
        "can show, and the diagnosis to run next.",
    )
    parser.add_argument("record", metavar="RECORD", help="a measured record, .csv or .csv.gz")
    parser.add_argument("--drive", metavar="DRIVE", help="the drive's drawing, which states the ratio")
    _add_locked(parser)
    _add_columns(parser)
    parser.add_argument("--json", action="store_true", help="print the same as JSON")


def _add_locked(parser: argparse.ArgumentParser) -> None:
    """`--locked`, for rigs that lock one shaft."""
    parser.add_argument(
        "--locked",
        choices=("crank", "output"),
        default="crank",
        help="the shaft that the rig locks, for records that state the twist alone (default crank)",
    )


def _add_columns(parser: argparse.ArgumentParser) -> None:
    """`--columns` and `--column`, for files with other column names."""
    parser.add_argument(
        "--columns",
        metavar="MAP.toml",
        help='TOML file that maps other column names: TIME = "time [s]"; also ratio, torque_constant, motor_inertia',
    )
    parser.add_argument(
        "--column",
        metavar="FOREIGN=NAME",
        type=assignment,
        action="append",
        default=[],
        help="one entry of that map: --column 'TIME=time [s]'",
    )
