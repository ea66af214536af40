"""Column maps: which columns of a foreign file hold what, and constants that a file does not state."""

from __future__ import annotations

import difflib
import os
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from stiffness_model.errors import InputError, UnknownNameError, expect, unknown_name
from stiffness_model.io.toml_files import parse_toml

from .columns import COLUMNS
from .motor_side import CONSTANTS, MOTOR_COLUMNS, TorqueConstants, read_constants
from .table_layout import SEPARATORS
from .unit_conversion import quantity_of

FORMAT_KEYS = {"decimal": (".", ","), "separator": tuple(SEPARATORS)}
"""Keys of a column map that state how the file writes numbers, with their values."""
_RESERVED = (*CONSTANTS, "pendulum", *FORMAT_KEYS, "columns")
_TITLE = re.compile(r"(.*?)\s*(?:\[(.*)\]|\((.*)\)|\s(?:/|in)\s+(\S+))?\s*", re.DOTALL)
_USUAL = {
    "time": "time t timestamp zeit",
    "run": "run test test_nr test_no cycle trial",
    "crank_angle": "crank motor_position motor_angle input_angle theta_motor motorwinkel",
    "output_angle": "output link_position load_angle output_position angle theta_load winkel",
    "twist": "twist position pos torsion deflection windup verdrehung verdrehwinkel",
    "output_torque": "torque load_torque moment drehmoment tau",
    "motor_current": "current q_current iq i_q motor_i strom",
    "motor_torque": "tau_motor torque_motor",
    "temperature": "temp temperature t_oil oil_temperature temperatur",
}
"""Usual names of columns, for suggestions only: no column is taken because of its name here."""


@dataclass(frozen=True)
class ColumnMap:
    """columns: canonical name, or "name [unit]", by the title in the file, or None for a file with canonical titles;
    a minus sign before the name reverses the sign. constants: of the torque. decimal, separator: as the file writes
    them, None to find them. where: source, for errors."""

    columns: Mapping[str, str] | None = None
    constants: TorqueConstants = field(default_factory=TorqueConstants)
    decimal: str | None = None
    separator: str | None = None
    where: str = "columns"


def read_column_map(path: str | os.PathLike[str] | None, entries: Mapping[str, str] | None = None) -> ColumnMap:
    """The column map in a TOML file, with further entries, which come first. Raises `InputError`."""
    table: dict[str, Any] = {}
    if path is not None:
        try:
            text = Path(path).read_text("utf-8-sig")
        except (OSError, UnicodeDecodeError) as error:
            raise InputError(f"{path}: expected a column map in TOML, got {error}") from None
        table = parse_toml(text, str(path), "a column map in TOML")
    return make_column_map({**table, **(entries or {})}, str(path or "--column"))


def make_column_map(table: Mapping[str, Any], where: str = "columns") -> ColumnMap:
    """The column map in a table: `TITLE = "name [unit]"` for each column, in the table or in its `columns`.

    Other keys: `ratio`, `torque_constant`, `motor_inertia` and `pendulum` (see `motor_side`), `decimal`, `separator`.
    Raises `InputError` for other values.
    """
    inner = table.get("columns", {})
    expect(isinstance(inner, Mapping), 'a table [columns] with texts such as TIME = "time [s]"', inner, where)
    columns: dict[str, str] = {}
    for title, name in {**inner, **{k: v for k, v in table.items() if k not in _RESERVED}}.items():
        expect(isinstance(name, str), 'a text such as TIME = "time [s]"', name, f"{where}: {title}")
        columns[title] = name
    for key, allowed in FORMAT_KEYS.items():
        if key in table:
            expect(table[key] in allowed, f"{key} = " + " or ".join(map(repr, allowed)), table[key], where)
    return ColumnMap(columns or None, read_constants(table, where), table.get("decimal"), table.get("separator"), where)


def with_drive_ratio(chosen: ColumnMap, ratio: float | None, columns: Collection[str], where: str) -> ColumnMap:
    """The column map with the ratio of a drive where it states none and the columns have a torque of the motor.

    ratio: signed, crank to output; None without a drive. columns: canonical names. Raises `InputError` for a map that
    states another ratio for a torque at the crank, because angles would then have one ratio and torques the other. A
    referred torque was multiplied by whatever its map states.
    """
    stated = chosen.constants.ratio
    at_motor = [name for name in MOTOR_COLUMNS if name in columns]
    if ratio is None or not at_motor:
        return chosen
    if stated is None:
        return replace(chosen, constants=replace(chosen.constants, ratio=ratio))
    if "referred_motor_torque" not in at_motor and stated != ratio:
        raise InputError(
            f"{where}: expected the ratio of the drive, {ratio:g}, in the column map, got {stated:g}; remove it there, "
            "or name another drive"
        )
    return chosen


def split_title(title: str) -> tuple[str, str]:
    """Name and unit of a title, "" where it states none.

    >>> split_title("Torque [Nm]"), split_title("time (s)"), split_title("M in Nm"), split_title("twist")
    (('Torque', 'Nm'), ('time', 's'), ('M', 'Nm'), ('twist', ''))
    """
    match = _TITLE.fullmatch(title.strip())
    assert match is not None  # every text fits
    return match[1].strip(), (match[2] or match[3] or match[4] or "").strip()


def canonical_name(name: str) -> str | None:
    """The canonical column that a name denotes, in any case and with spaces or hyphens, or None.

    >>> canonical_name("Output Torque"), canonical_name("TORQUE")
    ('output_torque', None)
    """
    plain = re.sub(r"[\s\-]+", "_", name.strip()).lower()
    return plain if plain in COLUMNS else None


def mapped_name(value: str, where: str) -> tuple[str, str, float]:
    """Canonical name, unit and sign of a value of a column map. Raises `InputError` for an unknown name."""
    text = value.strip()
    sign = -1.0 if text.startswith("-") else 1.0
    name, unit = split_title(text.removeprefix("-"))
    canonical = canonical_name(name)
    if canonical is None:
        raise unknown_name("column", name, COLUMNS, where)
    return canonical, unit, sign


def unknown_column(title: str, unit: str, titles: Sequence[str], where: str) -> InputError:
    """An error for a title that denotes no canonical column, with a suggestion and how to map it.

    unit: that of a row of units, or "". The suggestion keeps the unit of the file, which a map would replace; that of
    the title, of the row, or at the end of a name such as "torque_Nm".
    """
    name, stated = split_title(title)
    ending = name.rpartition("_")[2] if "_" in name else ""
    unit = stated or next((text for text in (unit, ending) if text and quantity_of(text)), "")
    plain = re.sub(r"[\s\-]+", "_", name).lower()
    close = difflib.get_close_matches(plain, COLUMNS, n=3, cutoff=0.6)
    usual = [canonical for canonical, names in _USUAL.items() if plain in names.split()]
    known = {canonical_name(split_title(other)[0]) for other in titles}
    by_unit = [found] if unit and (found := quantity_of(unit)) else []
    guesses = [guess for guess in dict.fromkeys(usual + close) if guess not in known] or close
    if by_unit:
        guesses = [guess for guess in guesses if COLUMNS[guess] == COLUMNS[by_unit[0]]] or by_unit
    hint = "did you mean " + " or ".join(map(repr, guesses)) + "? " if guesses else ""
    target = guesses[0] if guesses else "output_torque"
    of_unit = f" [{unit or COLUMNS[target]}]" if target != "run" else ""
    return UnknownNameError(
        f"{where}: unknown column {name!r}; {hint}map the columns to use with --column '{name}={target}{of_unit}' or "
        f"in a TOML file with --columns (others are then ignored); known are {', '.join(COLUMNS)}"
    )


def missing_title(title: str, titles: Sequence[str], where: str) -> InputError:
    """An error for a title of a column map that the file does not have."""
    by_lower = {known.lower(): known for known in titles}
    close = [by_lower[name] for name in difflib.get_close_matches(title.lower(), by_lower, n=3, cutoff=0.6)]
    hint = "did you mean " + " or ".join(map(repr, close)) + "?" if close else "it has " + ", ".join(titles)
    return UnknownNameError(f"{where}: the column map names {title!r}, which the file does not have; {hint}")
