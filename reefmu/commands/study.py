"""What the commands share that simulate a population of one drive."""

from __future__ import annotations

import argparse
import contextlib
import sys
import warnings
from collections.abc import Generator, Sequence
from concurrent.futures import Executor
from pathlib import Path

import numpy as np

from reefmu.progress import CountingExecutor
from stiffness_model.drawing.drive import FIELDS, Drive
from stiffness_model.errors import expect
from stiffness_model.io.drawing_toml import load_drive
from stiffness_model.montecarlo.population import Population, simulate
from stiffness_model.units import format_quantity

from . import workers

TWISTS = 61
"""Twists from zero to the drawing's max_twist."""


def load(source: str, fields: Sequence[tuple[str, str]]) -> tuple[Drive, list[str]]:
    """The drawing with the fields of `--set`, and notes on it, such as that its elements do not fit."""
    return read_drawing(source, **{name: FIELDS[name].parse(text) if name in FIELDS else text for name, text in fields})


def read_drawing(source: str, **fields: object) -> tuple[Drive, list[str]]:
    """The drawing, and as notes what `load_drive` warns of."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        drive = load_drive(source, **fields)
    return drive, list(dict.fromkeys(str(warning.message) for warning in caught))


def show_notes(notes: Sequence[str]) -> None:
    """Notes in plain lines on stderr."""
    for note in notes:
        print(f"note: {note}", file=sys.stderr)


def run_population(drive: Drive, args: argparse.Namespace) -> Population:
    """The virtual drives that `--drives` and `--seed` ask for, over the drawing's range of twists.

    Raises `InputError` if they carry nothing: then the range ends within the play.
    """
    twist = np.linspace(0.0, drive.max_twist, TWISTS)
    executor = CountingExecutor(f"simulating {args.drives} virtual drives")
    population = simulate(drive, twist, args.drives, args.seed, executor=executor)
    expect(
        bool((population.torque > 0).any()),
        "a max_twist at which the drive carries torque",
        f"{format_quantity(drive.max_twist, 'angle')}, all of it play",
        drive.name,
    )
    return population


@contextlib.contextmanager
def all_cores(what: str) -> Generator[Executor]:
    """An executor over all cores that shows its progress. No process starts before there is work."""
    with workers.pool() as pool:
        yield CountingExecutor(what, pool)


def out_folder(args: argparse.Namespace, command: str) -> Path:
    """`--out`, or a folder named after the drive and the command."""
    return Path(f"{Path(args.drive).stem}-{command}" if args.out is None else args.out)


def table(heads: Sequence[str], units: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns aligned to the right under a line of names and a line of units.

    >>> print(table(["twist", "mean"], ["[arcmin]", "[N.m]"], [["0.0", "1.25"], ["10.0", "3.50"]]))
         twist   mean
      [arcmin]  [N.m]
           0.0   1.25
          10.0   3.50
    """
    lines = [heads, units, *rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(heads))]
    return "\n".join(
        "  " + "  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)) for line in lines
    )
