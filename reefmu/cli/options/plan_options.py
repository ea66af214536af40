"""Options of the commands that plan tests: plan."""

from __future__ import annotations

import argparse
from typing import TYPE_CHECKING

from ..argument_types import add_command, add_fields, file_name

if TYPE_CHECKING:
    from ..argument_types import Commands


def add_plan(commands: Commands) -> None:
    """`reefmu plan`."""
    parser = add_command(
        commands,
        "plans",
        "plan",
        "the shortest test that separates the effects of interest on a rig",
        "Writes protocol.csv, plan.json and plan.html: the set points, the predicted probability of every name, the "
        "detection limits, and what the rig cannot tell.",
    )
    parser.add_argument(
        "drive", metavar="DRIVE", help="a preset (drive_1, drive_2, drive_3, workshop) or a TOML drawing"
    )
    add_fields(parser)
    parser.add_argument(
        "--rig", metavar="RIG.toml", help="what the rig can do (default: a usual rig, docs/reference/plan.md)"
    )
    parser.add_argument(
        "--effects", metavar="A,B", type=names, help="effects of interest (default: all that the rig can show)"
    )
    parser.add_argument("--minutes", metavar="M", type=minutes, help="greatest duration (default: the rig's)")
    parser.add_argument("--out", metavar="DIR", type=file_name, required=True, help="folder for the files")


def names(text: str) -> list[str]:
    """Names separated by commas.

    >>> names("backlash, creep")
    ['backlash', 'creep']
    """
    found = [name.strip() for name in text.split(",")]
    if not all(found):
        raise argparse.ArgumentTypeError(f"expected names separated by commas, got {text!r}")
    return found


def minutes(text: str) -> float:
    """A number; its range is checked by the command."""
    try:
        return float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"expected a number of minutes, got {text!r}") from None
