"""Measured data: CSV with `name [unit]` headers becomes a `Record` in SI units."""

from __future__ import annotations

import csv
import functools
import gzip
import io
import os
import re
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stiffness_model.display import dataframe, html_table
from stiffness_model.errors import InputError, expect, unknown_name
from stiffness_model.numerics.arrays import Array
from stiffness_model.units import ARCMIN, REFERENCE_TEMPERATURE

if TYPE_CHECKING:
    from matplotlib.axes import Axes

COLUMNS: dict[str, str] = {
    "time": "s",
    "run": "",
    "crank_angle": "rad",
    "output_angle": "rad",
    "twist": "rad",
    "output_torque": "N.m",
    "temperature": "degC",
}
"""Canonical columns and the unit that each is converted to."""
ANGLE_LIMIT = 1e-6 / float(np.finfo(float).eps)
"""rad, 4.5e9: beyond it double precision no longer resolves 1 urad, of which the twist of a gear needs hundreds. A
crank at 3000 rpm takes 166 days to get there."""
RANGES: dict[str, tuple[float, float]] = {
    # Stamps count from the year 1 at the earliest: 6.4e10 s.
    "time": (-1e11, 1e11),
    # Whole numbers that double precision holds.
    "run": (-(2.0**53), 2.0**53),
    "crank_angle": (-ANGLE_LIMIT, ANGLE_LIMIT),
    "output_angle": (-ANGLE_LIMIT, ANGLE_LIMIT),
    "twist": (-ANGLE_LIMIT, ANGLE_LIMIT),
    # A hundred times the main gears of the largest wind turbines, which carry some 1e7 N.m.
    "output_torque": (-1e9, 1e9),
    # From absolute zero to where iron melts.
    "temperature": (-273.15, 1538.0),
}
"""What a column can hold, in its canonical unit. Far inside of what floating point can square and sum, so that no
later step need look for overflow."""


@dataclass(frozen=True)
class Record:
    """A measured record, all arrays (n,).

    time: s, not falling within a run; run: whole numbers, a new one is a new test; crank_angle, output_angle:
    rad; output_torque: N.m exerted by the drive on the output; temperature: degC. missing: canonical columns
    the file did not have (the crank is then locked at 0, the temperature 20 degC). speeds: (n, 2) rad/s of crank and
    output, where they are known better than as differences of the angles.
    """

    time: Array
    run: NDArray[np.int64]
    crank_angle: Array
    output_angle: Array
    output_torque: Array
    temperature: Array
    missing: tuple[str, ...] = ()
    source: str = ""
    speeds: Array | None = None

    def __len__(self) -> int:
        return len(self.time)

    def __repr__(self) -> str:
        """One line: the source, samples, runs and duration.

        >>> make_record({"time": [0, 1, 2], "twist": [0, 1e-3, 2e-3], "output_torque": [0, 5, 20]}, "loop.csv")
        Record('loop.csv', 3 samples, 1 run, 2 s, 20 N.m)
        """
        runs = len(self.starts)
        return (
            f"Record({self.source!r}, {len(self)} samples, {runs} run{'s' if runs != 1 else ''}, "
            f"{np.ptp(self.time):.4g} s, {np.abs(self.output_torque).max():.4g} N.m)"
        )

    def _repr_html_(self) -> str:
        rows = {
            "samples": len(self),
            "runs": len(self.starts),
            "time [s]": f"{self.time.min():.4g} ... {self.time.max():.4g}",
            "output_torque [N.m]": f"{self.output_torque.min():.4g} ... {self.output_torque.max():.4g}",
            "temperature [degC]": f"{self.temperature.min():.4g} ... {self.temperature.max():.4g}",
            "missing columns": ", ".join(self.missing) or "none",
        }
        return html_table(self.source or "record", rows)

    def plot(self, ax: Axes | None = None, ratio: float | None = None) -> Axes:
        """Output torque over the twist, run by run, on `ax` or on new axes, which are returned.

        ratio: signed, crank to output; without it a record with a crank angle is drawn over time, since its twist is
        not known.
        """
        from stiffness_model.plotting.style import DRIVES, format_axes, new_axes

        ax = new_axes() if ax is None else ax
        over_twist = ratio is not None or "crank_angle" in self.missing
        x = self.twist(ratio or 1.0) / ARCMIN if over_twist else self.time
        for k, run in enumerate(np.split(np.arange(len(self)), self.starts[1:])):
            ax.plot(x[run], self.output_torque[run], color=DRIVES[k % len(DRIVES)].colour, linewidth=1.0)
        return format_axes(ax, "twist [arcmin]" if over_twist else "time [s]", "torque at the output [N.m]")

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with the canonical columns, as `read_record` takes them from a file. Raises `InputError`
        without pandas.
        """
        units = {name: f"{name} [{unit}]" if unit else name for name, unit in COLUMNS.items() if name != "twist"}
        return dataframe({header: getattr(self, name) for name, header in units.items()})

    @property
    def starts(self) -> NDArray[np.intp]:
        """Indices at which runs start."""
        return np.flatnonzero(np.concatenate([[True], np.diff(self.run) != 0]))

    def twist(self, ratio: float) -> Array:
        """crank_angle/ratio - output_angle, rad."""
        return self.crank_angle / ratio - self.output_angle


def with_output_locked(record: Record, ratio: float = 1.0) -> Record:
    """A record of a twist alone, on a rig that locks the output: then the crank turns, and the output does not.

    ratio: signed, crank to output; 1 where it is not known. The crank's own angle stays unknown, up to a constant.
    Raises `InputError` for a record that has a crank angle, and so says itself what moves.
    """
    expect(
        "crank_angle" in record.missing,
        "a record of a twist without a crank angle where the output is locked",
        "a crank angle",
        record.source or "record",
    )
    return replace(record, crank_angle=-record.output_angle * ratio, output_angle=np.zeros(len(record)))


def read_record(path: str | os.PathLike[str], columns: Mapping[str, str] | None = None) -> Record:
    """Read a record from a .csv or .csv.gz file.

    columns: canonical name (or "name [unit]") by the file's header, for foreign files: {"TORQUE": "output_torque
    [N.m]"}; other columns are then ignored. A `twist` column serves instead of the two angles: the crank is
    locked at 0 and the output turns by minus the twist.

    Raises `InputError` for a file that cannot be read, unknown or missing columns or units, values that are no
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


def make_record(data: Mapping[str, Any], where: str = "record") -> Record:
    """A record from arrays in SI units (degC for the temperature) by canonical column name, checked."""
    for name in data:
        if name not in COLUMNS:
            raise unknown_name("column", name, COLUMNS, where)
    for name in ("time", "output_torque"):
        expect(name in data, f"a column {name!r}", sorted(data), where)
    expect("twist" in data or "output_angle" in data, "a column 'twist' or 'output_angle'", sorted(data), where)
    values = {name: np.asarray(v, float) for name, v in data.items()}
    n = len(values["time"])
    expect(n >= 2, "at least two samples", n, where)
    for name, value in values.items():
        expect(value.shape == (n,), f"{n} values in column {name!r}", value.shape, where)
        bad = np.flatnonzero(~np.isfinite(value))
        if bad.size:
            raise InputError(
                f"{where}: expected finite numbers in column {name!r}, got {value[bad[0]]} in data row {bad[0] + 1}"
            )
        check_range(name, value, where)
    run = values.get("run", np.zeros(n))
    expect(bool((run == np.round(run)).all()), "whole numbers in column 'run'", run[run != np.round(run)][:1], where)
    back = np.flatnonzero((np.diff(values["time"]) < 0) & (np.diff(run) == 0))
    if back.size:
        raise InputError(
            f"{where}: expected time that does not run backwards within a run, got a step back "
            f"at data row {back[0] + 2}"
        )
    crank = values.get("crank_angle", np.zeros(n))
    if "twist" in values:
        expect(
            "output_angle" not in values and "crank_angle" not in values,
            "either 'twist' or the angles",
            sorted(values),
            where,
        )
        output = -values["twist"]
    else:
        output = values["output_angle"]
    missing = tuple(name for name in ("run", "crank_angle", "temperature") if name not in values)
    return Record(
        values["time"],
        run.astype(np.int64),
        crank,
        output,
        values["output_torque"],
        values.get("temperature", np.full(n, REFERENCE_TEMPERATURE)),
        missing,
        where,
    )


def check_range(name: str, values: Array, where: str) -> None:
    """Raise `InputError` for the first of the values (n,) of a canonical column that is outside its range.

    >>> check_range("output_torque", np.array([0.0, 1e200]), "record.csv")
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: record.csv: expected column 'output_torque' within -1e+09 ... 1e+09 N.m, got \
1e+200 in data row 2; check its unit
    """
    low, high = RANGES[name]
    outside = np.flatnonzero((values < low) | (values > high))
    if outside.size:
        raise InputError(
            f"{where}: expected column {name!r} within {low:.4g} ... {high:.4g} {COLUMNS[name]}".rstrip()
            + f", got {values[outside[0]]:.4g} in data row {outside[0] + 1}; check its unit"
        )


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


_POWER = r"(?<=[^\W\d_])\s*(?:\*\*|\^)\s*-?\d(?![\w.]|\s*(?:\*\*|\^))"
"""A power of a unit, m**2. Others are never read: 9**9**9**9 would keep the machine busy for ever."""


@functools.cache
def _registry() -> Any:
    import pint

    registry = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    registry.define("rev = turn")
    return registry


def convert_units(values: Array, unit: str, name: str, where: str) -> Array:
    if name == "run" or unit == COLUMNS[name]:
        return values  # nothing to convert, and the registry takes a second to read
    # "N.m" is a product; pint reads the point as the start of a number.
    text = re.sub(r"(?<=[A-Za-z])\.(?=[A-Za-z])", "*", unit)
    target = COLUMNS[name].replace(".", "*")
    powers, registry = re.sub(_POWER, "", text), _registry()
    try:
        expect("**" not in powers and "^" not in powers, "powers of a digit", unit, where)
        with np.errstate(over="ignore"):  # what overflows is infinite, and refused as such
            return np.asarray(registry.Quantity(values, text).to(target).magnitude, float)
    except Exception:  # the registry parses texts as expressions, and meets with every error that Python has
        raise InputError(f"{where}: expected a unit of {name} such as [{COLUMNS[name]}], got [{unit}]") from None


def join_records(records: Sequence[Record]) -> Record:
    """Several files as one record: runs keep their order and get new numbers, time goes on.

    A file whose clock starts anew is shifted behind the one before. Columns missing in one count as missing in all.
    """
    expect(len(records) > 0, "at least one record", "none", "records")
    parts: list[list[Array]] = []
    runs: list[NDArray[np.int64]] = []
    last_time, last_run = -np.inf, -1
    for record in records:
        run = np.cumsum(np.diff(record.run, prepend=record.run[0]) != 0) + last_run + 1
        shift = 0.0 if record.time[0] >= last_time else last_time - record.time[0]
        parts.append(
            [record.time + shift, record.crank_angle, record.output_angle, record.output_torque, record.temperature]
        )
        runs.append(run.astype(np.int64))
        last_time, last_run = float(parts[-1][0].max()), int(run[-1])
    time, crank, output, torque, temperature = (np.concatenate([p[k] for p in parts]) for k in range(5))
    missing = tuple(name for name in COLUMNS if any(name in r.missing for r in records) and name != "run")
    return Record(
        time, np.concatenate(runs), crank, output, torque, temperature, missing, ", ".join(r.source for r in records)
    )
