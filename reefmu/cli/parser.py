"""The parser of all commands."""

from __future__ import annotations

import argparse
from typing import NoReturn

from .argument_types import add_verbosity
from .exit_status import WRONG_INPUT, report_error
from .options.drawing_options import add_compare, add_curve, add_demo, add_draw, add_new
from .options.fmu_options import add_check, add_export
from .options.plan_options import add_plan
from .options.record_options import add_diagnose, add_record
from .options.reference_options import add_effects, add_gears, add_materials
from .options.study_options import add_explore


def build_parser() -> argparse.ArgumentParser:
    """The parser of the program; each command leaves its function `(args) -> exit status` in `args.run`."""
    parser = OneLineParser(
        prog="reefmu",
        description="Stiffness of rolling element eccentric drives: from a drawing to a "
        "curve, an FMU and a joint under control.",
    )
    parser.add_argument("--version", action=PrintVersion, nargs=0, help="print the version and exit")
    add_verbosity(parser, "normal")
    commands = parser.add_subparsers(dest="command", metavar="COMMAND", required=True)
    for add in (
        add_demo,
        add_new,
        add_curve,
        add_compare,
        add_export,
        add_check,
        add_diagnose,
        add_record,
        add_plan,
        add_draw,
        add_explore,
        add_effects,
        add_materials,
        add_gears,
    ):
        add(commands)
    return parser


class OneLineParser(argparse.ArgumentParser):
    """Says in one line what is wrong with a call, without the usage before it."""

    def error(self, message: str) -> NoReturn:
        command = self.prog.removeprefix("reefmu").strip()
        self.exit(report_error((f"{command}: " if command else "") + message, WRONG_INPUT))


class PrintVersion(argparse.Action):
    """Prints the version, which is looked up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from reefmu import __version__

        print(f"reefmu {__version__}")
        parser.exit()
