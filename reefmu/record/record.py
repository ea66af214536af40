"""A measured record in SI units, made from arrays or joined from several."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from stiffness_model.display import dataframe, html_table
from stiffness_model.errors import InputError, expect, unknown_name
from stiffness_model.numerics.arrays import Array, ArrayValue
from stiffness_model.units import ARCMIN, REFERENCE_TEMPERATURE

from .columns import COLUMNS, REPLACED_BY, check_range
from .motor_side import TorqueConstants, TorqueSide, measured_torques, torque_sources

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_TORQUE_LABELS: dict[TorqueSide, str] = {
    "output": "torque at the output [N.m]",
    "motor": "motor torque, referred to the output [N.m]",
}


@dataclass(frozen=True, eq=False, repr=False)
class Record(ArrayValue):
    """A measured record, all arrays (n,).

    time: s, not decreasing within a run; run: integers, where a new number is a new test; crank_angle, output_angle:
    rad; output_torque: N.m exerted by the drive on the output; temperature: degC. missing: canonical columns that
    were not measured (the crank is then locked at 0, the temperature 20 degC). speeds: (n, 2) rad/s of crank and
    output, where they are known more accurately than as differences of the angles. torque_side: where the torque was
    measured; "motor" says that output_torque is the motor's, referred to the output, with the friction of motor and
    crank in it (see `motor_side`). crank_torque: N.m that the motor exerts on the crank, where it was measured beside
    the torque at the output; it exceeds output_torque/ratio by the losses.
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
    torque_side: TorqueSide = "output"
    crank_torque: Array | None = None

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
            f"{self._torque_column} [N.m]": f"{self.output_torque.min():.4g} ... {self.output_torque.max():.4g}",
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
        x = self.twist(ratio) / ARCMIN if over_twist else self.time
        for k, run in enumerate(np.split(np.arange(len(self)), self.starts[1:])):
            ax.plot(x[run], self.output_torque[run], color=DRIVES[k % len(DRIVES)].colour, linewidth=1.0)
        return format_axes(ax, "twist [arcmin]" if over_twist else "time [s]", _TORQUE_LABELS[self.torque_side])

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` with the canonical columns, as `read_record` takes them from a file. Raises `InputError`
        without pandas.
        """
        columns = {"output_torque": self._torque_column}
        units = {n: f"{columns.get(n, n)} [{u}]" if u else n for n, u in COLUMNS.items() if n not in REPLACED_BY}
        both = {} if self.crank_torque is None else {f"motor_torque [{COLUMNS['motor_torque']}]": self.crank_torque}
        return dataframe({header: getattr(self, name) for name, header in units.items()} | both)

    @property
    def _torque_column(self) -> str:
        """The column in which a file states this torque."""
        return "output_torque" if self.torque_side == "output" else "referred_motor_torque"

    @property
    def starts(self) -> NDArray[np.intp]:
        """Indices at which runs start."""
        return np.flatnonzero(np.concatenate([[True], np.diff(self.run) != 0]))

    def twist(self, ratio: float | None) -> Array:
        """crank_angle/ratio - output_angle, rad.

        ratio: signed, crank to output; None where it is not known, because the crank stands still or its angle is
        referred to the output (`with_output_locked`).
        """
        return (self.crank_angle if ratio is None else self.crank_angle / ratio) - self.output_angle

    @property
    def is_output_locked(self) -> bool:
        """Whether the crank turns while the output stands still."""
        return float(np.ptp(self.output_angle)) == 0 and float(np.ptp(self.crank_angle)) > 0


def with_output_locked(record: Record, ratio: float | None = None) -> Record:
    """A record of a twist without angles, read as one of a rig that locks the output and turns the crank.

    ratio: signed, crank to output; where it is None, the crank's angle is referred to the output. It remains unknown up
    to a constant. Raises `InputError` for a record with a crank angle, which already tells what moves.
    """
    expect(
        "crank_angle" in record.missing,
        "a record of a twist without a crank angle where the output is locked",
        "a crank angle",
        record.source or "record",
    )
    factor = 1.0 if ratio is None else ratio
    return replace(record, crank_angle=-record.output_angle * factor, output_angle=np.zeros(len(record)))


def with_twist_zero(record: Record, zero: float) -> Record:
    """The same record with a twist that is less by `zero`, rad, at every sample; the output's angle takes it up.

    A diagnosis finds the zero and writes it to model.toml (`DriveModel.twist_zero`), because that of encoders is
    arbitrary. Simulated over the record that this returns, its model gives the gap that the diagnosis states for the
    angles as measured.
    """
    return replace(record, output_angle=record.output_angle + zero)


def make_record(data: Mapping[str, Any], where: str = "record", constants: TorqueConstants | None = None) -> Record:
    """A record from arrays (n,) in SI units, temperature in degC, by canonical column name.

    where: source of the data, for errors. constants: for a torque that was not measured at the output (see
    `motor_side`). Raises `InputError` for unknown, missing or contradictory columns, for values that are not finite or
    out of range, and for time that decreases within a run.
    """
    for name in data:
        if name not in COLUMNS:
            raise unknown_name("column", name, COLUMNS, where)
    expect("time" in data, "a column 'time'", sorted(data), where)
    constants = constants or TorqueConstants()
    torque_sources(data, constants, where)
    expect("twist" in data or "output_angle" in data, "a column 'twist' or 'output_angle'", sorted(data), where)
    if "twist" in data:
        angles = "output_angle" in data or "crank_angle" in data
        expect(not angles, "either 'twist' or the angles", sorted(data), where)
    values = _checked_values(data, where)
    n = len(values["time"])
    run = values.get("run", np.zeros(n))
    expect(bool((run == np.round(run)).all()), "whole numbers in column 'run'", run[run != np.round(run)][:1], where)
    back = np.flatnonzero((np.diff(values["time"]) < 0) & (np.diff(run) == 0))
    if back.size:
        raise InputError(
            f"{where}: expected time that does not run backwards within a run, got a step back "
            f"at data row {back[0] + 2}"
        )
    torques = measured_torques(values, values["time"], run, constants, where)
    check_range("output_torque", torques.output, where)
    return Record(
        values["time"],
        run.astype(np.int64),
        values.get("crank_angle", np.zeros(n)),
        -values["twist"] if "twist" in values else values["output_angle"],
        torques.output,
        values.get("temperature", np.full(n, REFERENCE_TEMPERATURE)),
        tuple(name for name in ("run", "crank_angle", "temperature") if name not in values),
        where,
        torque_side=torques.side,
        crank_torque=torques.crank,
    )


def _checked_values(data: Mapping[str, Any], where: str) -> dict[str, Array]:
    """The columns as arrays of one length, finite and within their ranges."""
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
    return values


def join_records(records: Sequence[Record]) -> Record:
    """Several records as one: runs keep their order and are renumbered.

    The time of a record whose clock starts again is shifted to follow the one before. A column missing in one record,
    such as the motor's torque, counts as missing in all. Raises `InputError` for no records, and for torques that were
    measured at different sides.
    """
    expect(len(records) > 0, "at least one record", "none", "records")
    sides = {record.torque_side for record in records}
    expect(len(sides) == 1, "torques measured at one side", " and ".join(sorted(sides)), "records")
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
    at_crank = [record.crank_torque for record in records if record.crank_torque is not None]
    source = ", ".join(record.source for record in records)
    return Record(
        time,
        np.concatenate(runs),
        crank,
        output,
        torque,
        temperature,
        missing,
        source,
        torque_side=records[0].torque_side,
        crank_torque=np.concatenate(at_crank) if len(at_crank) == len(records) else None,
    )
