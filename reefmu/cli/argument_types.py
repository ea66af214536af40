"""What the commands' options have in common: the types of arguments, and options that several commands take."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    # In the type checker only: at run time the classes are private to argparse.
    Commands = argparse._SubParsersAction[Any]  # pyright: ignore[reportPrivateUsage]
    ExclusiveOptions = argparse._MutuallyExclusiveGroup  # pyright: ignore[reportPrivateUsage]

MAX_DRIVES = 10_000_000
"""Most virtual drives of one call; chosen by judgement, to refuse a slip of the keyboard."""


def add_command(commands: Commands, room: str, name: str, summary: str, writes: str) -> argparse.ArgumentParser:
    """A parser whose `args.run` imports the command's module and calls its `run`.

    commands: the subparsers of the program. room: the package below `reefmu.commands` of the module, which is called
    `name`; empty for a module of `reefmu.commands` itself. summary: one line for the list of commands. writes: further
    sentences of the description, about files and exit status.
    """
    parser = commands.add_parser(name, help=summary, description=f"{summary[0].upper()}{summary[1:]}. {writes}")
    add_verbosity(parser, argparse.SUPPRESS)
    module_name = ".".join(part for part in ("reefmu.commands", room, name) if part)

    def run(args: argparse.Namespace) -> int:
        from importlib import import_module

        levels = import_module("reefmu.verbosity")
        with levels.verbosity_set(levels.Verbosity[args.verbosity.upper()]):
            return import_module("reefmu.commands.terminal.call").call_command(module_name, args)

    parser.set_defaults(run=run)
    return parser


def add_drawing(parser: argparse.ArgumentParser, command: str) -> None:
    """Options of the commands that work on one drawing: DRIVE, `--set` and `--out`."""
    parser.add_argument(
        "drive",
        metavar="DRIVE",
        help="a preset (drive_1 ... drive_3, workshop, printed_cycloidal), a gear of `reefmu gears`, or a TOML drawing",
    )
    add_fields(parser)
    parser.add_argument("--out", metavar="DIR", type=file_name, help=f"folder for the files (default DRIVE-{command})")


def add_fields(parser: argparse.ArgumentParser) -> None:
    """`--set`, which overrides fields of the drawing."""
    parser.add_argument(
        "--set",
        metavar="FIELD=VALUE",
        dest="fields",
        type=assignment,
        action="append",
        default=[],
        help="override a field of the drawing: --set lobes=28 --set crank_radius='41 mm'",
    )


def add_seed(parser: argparse.ArgumentParser) -> None:
    """`--seed` of the virtual drives."""
    parser.add_argument(
        "--seed", metavar="S", type=whole_number(0), default=0, help="seed of the tolerances (default 0)"
    )


def actions_of(parser: argparse.ArgumentParser) -> list[argparse.Action]:
    """The options and arguments of a parser, which argparse keeps in a private attribute."""
    return list(parser._actions)  # pyright: ignore[reportPrivateUsage]


def add_verbosity(parser: argparse.ArgumentParser, default: str) -> None:
    """`-v` and `-q`, which stand before or after the command. default: `argparse.SUPPRESS` after it."""
    group = parser.add_mutually_exclusive_group()
    for short, long, value, text in (
        ("-v", "--verbose", "verbose", "say more on stderr: durations, and which tables come from the cache"),
        ("-q", "--quiet", "quiet", "print results and errors only, without notes, warnings and progress"),
    ):
        group.add_argument(short, long, dest="verbosity", action="store_const", const=value, default=default, help=text)


def add_format(parser: argparse.ArgumentParser) -> None:
    """`--format` of the pictures."""
    parser.add_argument(
        "--format", choices=("png", "svg", "pdf"), default="png", help="format of the pictures (default png)"
    )


def add_json(parser: argparse.ArgumentParser) -> None:
    """`--json`, for programs that read what a command prints."""
    parser.add_argument("--json", action="store_true", help="print the same as JSON")


def whole_number(low: int, high: int | None = None) -> Callable[[str], int]:
    """The type of an argument that is a whole number from `low` to `high`, or without an upper limit."""
    span = f"of at least {low}" if high is None else f"from {low} to {high}"

    def parse(text: str) -> int:
        try:
            value = int(text)
        except ValueError:
            value = low - 1
        if value < low or (high is not None and value > high):
            raise argparse.ArgumentTypeError(f"expected a whole number {span}, got {text!r}")
        return value

    return parse


def quantity(kind: str, unit: str) -> Callable[[str], float]:
    """The type of an argument of a quantity of `stiffness_model.units`: a number in `unit`, or one with its unit.

    The value is in `unit`.

    >>> quantity("moment of inertia", "kg.m2")("1 kg.cm2"), quantity("moment of inertia", "kg.m2")("0.5")
    (0.0001, 0.5)
    """

    def parse(text: str) -> float:
        # At the first argument of this type, so that the program starts without it.
        from stiffness_model.errors import InputError
        from stiffness_model.units import UNITS, parse_quantity

        try:
            return float(text)
        except ValueError:
            pass
        try:
            return parse_quantity(text, kind, "") / UNITS[kind][unit]
        except InputError:
            units = ", ".join(name for name in UNITS[kind] if name.isascii())
            raise argparse.ArgumentTypeError(
                f"expected a number in {unit}, or one with its unit ({units}), got {text!r}"
            ) from None

    return parse


def file_name(text: str) -> str:
    """A name of a file or folder to write, not empty: an unset variable of the shell would mean the current folder."""
    if not text.strip():
        raise argparse.ArgumentTypeError(f"expected a name, got {text!r}")
    return text


def assignment(text: str) -> tuple[str, str]:
    """Name and value of `FIELD=VALUE`.

    >>> assignment("crank_radius = 41 mm")
    ('crank_radius', '41 mm')
    """
    name, equals, value = text.partition("=")
    if not (equals and name.strip() and value.strip()):
        raise argparse.ArgumentTypeError(f"expected FIELD=VALUE, such as lobes=28, got {text!r}")
    return name.strip(), value.strip()
