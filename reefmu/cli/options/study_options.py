"""Options of the commands that take a design study: explore."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..argument_types import add_command, add_format, file_name, whole_number

if TYPE_CHECKING:
    from ..argument_types import Commands


def add_explore(commands: Commands) -> None:
    """`reefmu explore`."""
    parser = add_command(
        commands,
        "studies",
        "explore",
        "a design study: from parameters with ranges to a Pareto front and a drawing",
        "Writes designs.parquet, pictures of the front, the trade-off and the main effects, and "
        "chosen.toml; the same command continues a study that was stopped. Exit status 1 if no design can be chosen.",
    )
    parser.add_argument(
        "study", metavar="STUDY.toml", help="a study, or one that is included: tolerance_field, geometry"
    )
    add_format(parser)
    where = parser.add_mutually_exclusive_group()
    where.add_argument("--workers", metavar="N", type=whole_number(1, 4096), help="processes (default: all cores)")
    where.add_argument("--scheduler", metavar="ADDRESS", help="address of a running dask scheduler, tcp://host:8786")
    parser.add_argument(
        "--out",
        metavar="DIR",
        type=file_name,
        required=True,
        help="folder for the results and for those of an unfinished study",
    )
