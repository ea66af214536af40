"""Records from CSV files with `name [unit]` headers, and from other tables with a column map."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from stiffness_model.errors import InputError, expect
from stiffness_model.numerics.arrays import Array

from .column_map import (
    ColumnMap,
    canonical_name,
    make_column_map,
    mapped_name,
    missing_title,
    split_title,
    unknown_column,
    with_drive_ratio,
)
from .columns import COLUMNS
from .file_text import read_text_file
from .number_format import decimal_mark, parse_numbers
from .record import Record, make_record
from .table_layout import Table, find_table
from .unit_conversion import convert_units, plain_unit

Columns = ColumnMap | Mapping[str, Any]
"""A column map, or the table of which `make_column_map` makes one."""


@dataclass(frozen=True)
class ColumnReading:
    """How one column was read: title in the file, canonical name, unit as stated and where ("header", "units row",
    "column map"), sign, and value in the canonical unit = offset + scale x value in the file."""

    title: str
    name: str
    unit: str
    stated_in: str
    sign: float
    scale: float
    offset: float


@dataclass(frozen=True)
class FileReading:
    """A record, and how its file was read: encoding, decimal mark, layout without its rows, columns, the titles that
    were ignored, and the column map with the drive's ratio where it was taken from there."""

    record: Record
    encoding: str
    decimal: str
    layout: Table
    columns: tuple[ColumnReading, ...]
    ignored: tuple[str, ...]
    column_map: ColumnMap


def read_record(
    path: str | os.PathLike[str], columns: Columns | None = None, drive_ratio: float | None = None
) -> Record:
    """The record in a CSV file with `name [unit]` headers.

    path: of a .csv or .csv.gz file. columns: for foreign files, canonical name (or "name [unit]") by the file's header:
    {"TORQUE": "output_torque [N.m]"}; all other columns are then ignored. Constants such as "torque_constant" are keys
    of the same map (see `column_map`). drive_ratio: signed, crank to output, of the drive if it is known, for a torque
    of the motor where the map states no ratio. A `twist` column may replace the two angles: the crank is then locked at
    0 and the output turns by minus the twist.

    Raises `InputError` for a file that cannot be read, unknown or missing columns or units, values that are not
    numbers, time that runs backwards within a run, and a map with another ratio than the drive's.
    """
    return read_file(path, columns, drive_ratio).record


def read_file(
    path: str | os.PathLike[str], columns: Columns | None = None, drive_ratio: float | None = None
) -> FileReading:
    """The record in a file and how it was read. Arguments and errors are those of `read_record`."""
    where = str(path)
    chosen = columns if isinstance(columns, ColumnMap) else make_column_map(columns or {})
    text, encoding = read_text_file(Path(path), where)
    table = find_table(text, where, chosen.separator)
    wanted = _wanted(table, chosen, where)
    texts = [table.column(index) for index in wanted]
    mark = chosen.decimal or decimal_mark(texts, where)
    data: dict[str, Array] = {}
    readings: list[ColumnReading] = []
    for (index, reading), fields in zip(wanted.items(), texts, strict=True):
        if reading.name in data:
            raise InputError(f"{where}: expected each column once, got {reading.name!r} twice")
        values = parse_numbers(fields, mark, table.titles[index], table.lines, where)
        # Two more values show scale and offset of the conversion.
        converted = convert_units(np.concatenate([values, [0.0, 1.0]]), reading.unit, reading.name, where)
        offset, scale = float(converted[-2]), float(converted[-1] - converted[-2])
        data[reading.name] = reading.sign * converted[:-2]
        readings.append(
            ColumnReading(reading.title, reading.name, reading.unit, reading.stated_in, reading.sign, scale, offset)
        )
    chosen = with_drive_ratio(chosen, drive_ratio, data, where)
    record = make_record(data, where, chosen.constants)
    ignored = tuple(title for index, title in enumerate(table.titles) if index not in wanted)
    return FileReading(record, encoding, mark, table, tuple(readings), ignored, chosen)


def _wanted(table: Table, chosen: ColumnMap, where: str) -> dict[int, ColumnReading]:
    """The columns to read by their index in the table; their conversions are not known yet."""
    titles = table.titles
    wanted: dict[int, tuple[str, str, str, float]] = {}
    if chosen.columns is None:
        for index, title in enumerate(titles):
            name = canonical_name(split_title(title)[0])
            if name is None:
                raise unknown_column(title, table.units[index], titles, where)
            wanted[index] = (name, "", "", 1.0)
    else:
        names = [split_title(title)[0] for title in titles]
        for title, value in chosen.columns.items():
            found = [k for k, t in enumerate(titles) if t == title] or [k for k, n in enumerate(names) if n == title]
            if not found:
                raise missing_title(title, titles, where)
            expect(len(found) == 1, f"one column {title!r}", f"{len(found)}", where)
            name, unit, sign = mapped_name(value, f"{chosen.where}: {title}")
            wanted[found[0]] = (name, unit, "column map", sign)
    readings: dict[int, ColumnReading] = {}
    for index, (name, unit, source, sign) in sorted(wanted.items()):
        stated = [(unit, source), (split_title(titles[index])[1], "header"), (table.units[index], "units row")]
        _, header, row = (text for text, _ in stated)
        if not unit and header and row and plain_unit(header, COLUMNS[name]) != plain_unit(row, COLUMNS[name]):
            raise InputError(
                f"{where}: expected one unit of {titles[index]!r}, got [{row}] in the row below the header; correct "
                f"one of them, or state the unit with --column '{titles[index]}={name} [{header}]'"
            )
        unit, source = next(((u, s) for u, s in stated if u), ("", ""))
        if unit == "" and name != "run":
            example = f"{name} [{COLUMNS[name]}]"
            raise InputError(
                f"{where}: expected a unit in the header, such as '{example}', or in a row below it, got "
                f"{titles[index]!r}; or state it with --column '{titles[index]}={example}'"
            )
        readings[index] = ColumnReading(titles[index], name, unit, source, sign, 1.0, 0.0)
    return readings
