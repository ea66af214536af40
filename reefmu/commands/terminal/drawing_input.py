"""Drawings that commands take, with overridden fields, and the folder that the results go to."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from stiffness_model.drawing.drive import Drive
from stiffness_model.io.drawing_toml import as_drive, load_drive, read_table
from stiffness_model.kinds import expect_has, kind_of_table

from .notes import WarningText


def drawing_with_fields(source: str, fields: Sequence[tuple[str, str]]) -> tuple[Any, list[str]]:
    """The drive of any kind with the fields of `--set`, and notes on it, such as that its elements do not fit."""
    known = kind_of_table(*read_table(source)).fields if fields else {}
    return read_drawing(source, **{name: known[name].parse(text) if name in known else text for name, text in fields})


def ree_drawing_with_fields(
    source: str, fields: Sequence[tuple[str, str]], command: str, needs: str
) -> tuple[Drive, list[str]]:
    """The same for a command that serves rolling element eccentric drives only.

    needs: what of `stiffness_model.kinds` the command needs of the drive. Raises `InputError` for a drive of another
    kind.
    """
    drive, notes = drawing_with_fields(source, fields)
    expect_has(drive, needs, command)
    return as_drive(drive, command), notes


def read_drawing(source: str, **fields: object) -> tuple[Any, list[str]]:
    """The drive of any kind, and the warnings of `load_drive` as texts for `show_notes`."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        drive = load_drive(source, **fields)
    return drive, [WarningText(text) for text in dict.fromkeys(str(warning.message) for warning in caught)]


def output_folder(args: argparse.Namespace, command: str) -> Path:
    """`--out`, or a folder named after the drive and the command."""
    return Path(f"{Path(args.drive).stem}-{command}" if args.out is None else args.out)
