"""Names of records in tables and of their folders, and the options with which they are read."""

from __future__ import annotations

import argparse
import os
from pathlib import Path


def record_stem(record: str | os.PathLike[str]) -> str:
    """The name of a record's file without its extensions.

    >>> record_stem("loops/cold.csv.gz")
    'cold'
    """
    name = Path(record).name.removesuffix(".gz")
    return name.rpartition(".")[0] or name


def reading_options(args: argparse.Namespace) -> tuple[str, ...]:
    """The options of a command with which another record of the same rig is read."""
    words = [] if args.columns is None else ["--columns", args.columns]
    for foreign, name in args.column:
        words += ["--column", f"{foreign}={name}"]
    return (*words, *([] if args.locked == "crank" else ["--locked", args.locked]))
