"""Options of the commands that list what comes with the package: effects, materials, gears."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..argument_types import add_command, add_json

if TYPE_CHECKING:
    from ..argument_types import Commands


def add_effects(commands: Commands) -> None:
    """`reefmu effects`."""
    parser = add_command(
        commands,
        "reference",
        "effects",
        "the effects that a model can contain and a diagnosis can name",
        "Without NAME one line for each effect, by its place along the drive; with NAME its meaning and sign, "
        "equation, parameters, the test that shows it, what it may be confused with, and an example.",
    )
    parser.add_argument("name", metavar="NAME", nargs="?", help="an effect, such as hysteresis")
    add_json(parser)


def add_materials(commands: Commands) -> None:
    """`reefmu materials`."""
    parser = add_command(
        commands,
        "reference",
        "materials",
        "the materials that come with the package, with their sources",
        "Young's modulus, Poisson's ratio, density and, where a standard states it, the allowable contact pressure. A "
        "drawing defines others in a table [material.NAME].",
    )
    add_json(parser)


def add_gears(commands: Commands) -> None:
    """`reefmu gears`."""
    parser = add_command(
        commands,
        "reference",
        "gears",
        "the gears whose data sheets come with the package, with their sources",
        "Every command that takes a DRIVE takes their names.",
    )
    add_json(parser)
