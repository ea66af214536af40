"""Records from CSV files with `name [unit]` headers."""

from __future__ import annotations

import csv
import gzip
import io
import os
import re
import zlib
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from stiffness_model.errors import InputError, expect, unknown_name
from stiffness_model.numerics.arrays import Array

from .columns import COLUMNS, convert_units
from .record import Record, make_record


def read_record(path: str | os.PathLike[str], columns: Mapping[str, str] | None = None) -> Record:
    """The record in a CSV file with `name [unit]` headers.

    path: of a .csv or .csv.gz file. columns: for foreign files, canonical name (or "name [unit]") by the file's header:
    {"TORQUE": "output_torque [N.m]"}; all other columns are then ignored. A `twist` column may replace the two angles:
    the crank is then locked at 0 and the output turns by minus the twist.

    Raises `InputError` for a file that cannot be read, unknown or missing columns or units, values that are not
    numbers, and time that runs backwards within a run.
    """
    where = str(path)
    header, rows = _read_table(Path(path), where)
    data: dict[str, Array] = {}
    for index, title in enumerate(header):
        if columns is not None:
            if title not in columns:
                continue
            title = columns[title]
        name, unit = _split_title(title, where)
        if name in data:
            raise InputError(f"{where}: expected each column once, got {name!r} twice")
        data[name] = convert_units(_numbers(rows, index, title, where), unit, name, where)
    return make_record(data, where)


def _read_table(path: Path, where: str) -> tuple[list[str], list[list[str]]]:
    try:
        raw = path.read_bytes()
        text = (gzip.decompress(raw) if raw[:2] == b"\x1f\x8b" else raw).decode("utf-8-sig")
        rows = [row for row in csv.reader(io.StringIO(text)) if row]
    except (OSError, EOFError, UnicodeDecodeError, zlib.error, csv.Error) as error:
        raise InputError(f"{where}: expected a readable CSV file, got {error}") from None
    expect(len(rows) >= 3, "a header and at least two rows of numbers", f"{len(rows)} rows", where)
    header = [title.strip() for title in rows[0]]
    for line, row in enumerate(rows, start=1):
        if len(row) != len(header):
            raise InputError(f"{where}: expected {len(header)} values in every row, got {len(row)} in line {line}")
    return header, rows[1:]


def _numbers(rows: list[list[str]], index: int, title: str, where: str) -> Array:
    try:
        return np.array([row[index] for row in rows], dtype=float)
    except ValueError as error:
        raise InputError(f"{where}: expected numbers in column {title!r}, got {error}") from None


def _split_title(title: str, where: str) -> tuple[str, str]:
    match = re.fullmatch(r"(\w+)\s*(?:\[(.*)\])?", title)
    if match is None or match[1] not in COLUMNS:
        raise unknown_name("column", title if match is None else match[1], COLUMNS, where)
    name, unit = match[1], (match[2] or "").strip()
    expect(name == "run" or unit != "", f"a unit in the header, such as '{name} [{COLUMNS[name]}]'", title, where)
    return name, unit
