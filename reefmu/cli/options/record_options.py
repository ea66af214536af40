"""Options of the commands that take measured records: diagnose, record."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..argument_types import add_command, add_json, assignment, file_name

if TYPE_CHECKING:
    from ..argument_types import Commands, ExclusiveOptions


def add_diagnose(commands: Commands) -> None:
    """`reefmu diagnose`."""
    parser = add_command(
        commands,
        "records",
        "diagnose",
        "what is missing in the model of a drive, from a measured record",
        "Names and fits the missing effects, or says that the record does not decide. Writes diagnosis.json, "
        "report.html and model.toml. With --compare: what changed between states of one drive; writes compare.json and "
        "compare.html.",
    )
    parser.add_argument(
        "records",
        metavar="RECORD",
        nargs="+",
        help="measured records, .csv or .csv.gz with `name [unit]` headers; several give a table of their effects; "
        "with --compare each is a state, as is NAME=FILE,FILE,... of several positions (patterns: 'cold=cold_*.csv')",
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
    parser.add_argument(
        "--priors",
        metavar="PRIORS.toml",
        help="what is known of the drive: [odds] of effects, 1 where none are given, and their typical [sizes]",
    )
    _add_locked(parser)
    parser.add_argument("--out", metavar="DIR", type=file_name, required=True, help="folder for the results")
    _add_columns(parser)
    _add_compare(parser, base)


def _add_compare(parser: argparse.ArgumentParser, base: ExclusiveOptions) -> None:
    """`--compare` and its options. base: options of the base curve, one of which is required without it."""

    class Compare(argparse.Action):
        """Stores True, and makes the base curve optional."""

        def __call__(self, _parser: object, namespace: argparse.Namespace, *_: object) -> None:
            namespace.compare = True
            base.required = False

    group = parser.add_argument_group("comparison of states")
    group.add_argument(
        "--compare", action=Compare, nargs=0, default=False, help="what changed between the states; needs no base curve"
    )
    group.add_argument(
        "--matched",
        action="store_true",
        help="the k-th file of every state is of the same position, whose own effect then cancels",
    )
    group.add_argument(
        "--spread-from",
        metavar="COMPARE.json",
        help="an earlier comparison of such drives at several positions: what positions of one state differ by",
    )


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
    add_json(parser)


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
