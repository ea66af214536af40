"""Drawings that commands take, with overridden fields, and the folder that the results go to."""

from __future__ import annotations

import argparse
import warnings
from collections.abc import Sequence
from pathlib import Path

from stiffness_model.drawing.drive import FIELDS, Drive
from stiffness_model.io.drawing_toml import load_drive


def drawing_with_fields(source: str, fields: Sequence[tuple[str, str]]) -> tuple[Drive, list[str]]:
    """The drawing with the fields of `--set`, and notes on it, such as that its elements do not fit."""
    return read_drawing(source, **{name: FIELDS[name].parse(text) if name in FIELDS else text for name, text in fields})


def read_drawing(source: str, **fields: object) -> tuple[Drive, list[str]]:
    """The drawing, and the warnings of `load_drive` as notes."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        drive = load_drive(source, **fields)
    return drive, list(dict.fromkeys(str(warning.message) for warning in caught))


def output_folder(args: argparse.Namespace, command: str) -> Path:
    """`--out`, or a folder named after the drive and the command."""
    return Path(f"{Path(args.drive).stem}-{command}" if args.out is None else args.out)
