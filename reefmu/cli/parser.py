"""The parser of all commands."""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any, NoReturn

from .argument_types import actions_of, add_verbosity
from .exit_status import DONE, WRONG_INPUT, report_error
from .options.drawing_options import add_compare, add_curve, add_demo, add_draw, add_new
from .options.fmu_options import add_check, add_export
from .options.plan_options import add_plan
from .options.record_options import add_diagnose, add_record
from .options.reference_options import add_effects, add_gears, add_materials
from .options.study_options import add_explore

if TYPE_CHECKING:
    from .argument_types import Commands

SIMILARITY = 0.7
"""Least similarity (difflib) of a word and the command or option that may have been meant; chosen by judgement."""
FIRST_STEPS = """\
reefmu computes the stiffness of robot gears and provides it as FMUs and control systems. Begin with what you have:

  nothing yet     reefmu demo                             one drive, from its drawing to a joint under control
  a drawing       reefmu new mine.toml                    a drawing to edit, every field of it explained
                  reefmu curve mine.toml                  twist over torque, contact forces, load shares
                  reefmu export mine.toml -o mine.fmu     the drive as an FMU
  a data sheet    reefmu new gear.toml --kind catalogue   a gear by the numbers of its maker, to edit
                  reefmu gears                            those that come with the package
  a record        reefmu record record.csv                what it holds, and the diagnosis to run next

`reefmu --help` lists all commands, `reefmu COMMAND --help` the options of one."""
"""What to do first; each call stands between two spaces and more."""


def build_parser() -> argparse.ArgumentParser:
    """The parser of the program; each command leaves its function `(args) -> exit status` in `args.run`."""
    parser = OneLineParser(
        prog="reefmu",
        description="Stiffness of rolling element eccentric drives: from a drawing to a "
        "curve, an FMU and a joint under control.",
    )
    parser.add_argument("--version", action=PrintVersion, nargs=0, help="print the version and exit")
    add_verbosity(parser, "normal")
    parser.set_defaults(run=print_first_steps)
    commands = parser.add_subparsers(dest="command", metavar="COMMAND")
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
    _add_completion(commands, parser)
    parser.commands = commands.choices
    return parser


def print_first_steps(_: argparse.Namespace) -> int:
    """What the program prints without a command."""
    print(FIRST_STEPS)
    return DONE


def _add_completion(commands: Commands, program: argparse.ArgumentParser) -> None:
    """`reefmu completion`, which reads the parser of the program itself."""
    summary = "a script that completes commands, options and names in a shell"
    parser = commands.add_parser(
        "completion", help=summary, description=f'Prints {summary}: eval "$(reefmu completion bash)".'
    )
    add_verbosity(parser, argparse.SUPPRESS)
    parser.add_argument("shell", choices=("bash", "zsh", "fish"), help="the shell that reads the script")

    def run(args: argparse.Namespace) -> int:
        from .completion.scripts import completion_script

        print(completion_script(program, args.shell), end="")
        return DONE

    parser.set_defaults(run=run)


class OneLineParser(argparse.ArgumentParser):
    """Says in one line what is wrong with a call, with the closest words, without the usage before it."""

    def __init__(self, *args: Any, **keywords: Any) -> None:
        super().__init__(*args, **keywords)
        self.commands: Mapping[str, argparse.ArgumentParser] = {}

    def parse_args(self, args: Sequence[str] | None = None, namespace: Any = None) -> Any:  # type: ignore[override]
        """As that of argparse; an unknown command or option is answered with those that are spelt like it."""
        words = list(sys.argv[1:] if args is None else args)
        command = next((word for word in words if not word.startswith("-")), None)
        if self.commands and command is not None and command not in self.commands:
            hint = _closest(command, self.commands) or f"expected one of {', '.join(self.commands)}"
            self.error(f"unknown command {command!r}; {hint}")
        found, unknown = self.parse_known_args(words, namespace)
        if unknown:
            actions = actions_of(self.commands.get(found.command, self))
            flags = [flag for action in actions for flag in action.option_strings]
            hint = _closest(unknown[0].partition("=")[0], flags) if unknown[0].startswith("--") else ""
            self.error(f"unrecognized arguments: {' '.join(unknown)}" + (f"; {hint}" if hint else ""))
        return found

    def error(self, message: str) -> NoReturn:
        command = self.prog.removeprefix("reefmu").strip()
        self.exit(report_error((f"{command}: " if command else "") + message, WRONG_INPUT))


def _closest(word: str, known: Iterable[str]) -> str:
    """The known words that are spelt like a word, as the end of a message; empty if there is none."""
    from difflib import get_close_matches

    close = get_close_matches(word, list(known), n=2, cutoff=SIMILARITY)
    return f"did you mean {' or '.join(close)}?" if close else ""


class PrintVersion(argparse.Action):
    """Prints the version, which is looked up only when it is asked for."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> NoReturn:
        from reefmu import __version__

        print(f"reefmu {__version__}")
        parser.exit()
