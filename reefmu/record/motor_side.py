"""Torque at the output from a torque that was not measured there: the motor's, or a pendulum's gravity.

A motor torque T_m, positive in the direction of the crank's angle, gives without losses

    T = ratio (T_m - (J + m l^2) d2phi/dt2 - m g l sin(phi - phi_0))

at the output, with the inertia J of everything that turns with the crank and, where one hangs on the crank, a pendulum
(mass m, length l, hanging angle phi_0). Friction, cogging and stiction of motor and crank stay in it. A pendulum on the
output loads the drive with T = m g l sin(q - q_0) + m l^2 d2q/dt2, which is a torque at the output.
"""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from stiffness_model.errors import InputError, expect, refuse_unknown
from stiffness_model.numerics.arrays import Array

from .unit_conversion import parse_constant

GRAVITY = 9.80665
"""m/s^2, standard acceleration of gravity (ISO 80000-3)."""
WINDOW = 0.1
"""s, over which a parabola is fitted to an angle for its acceleration. Chosen by judgement: short against a slow ramp,
long against the samples of a rig."""
MIN_WINDOW = 5
"""Least number of samples of that window."""
TorqueSide = Literal["output", "motor"]
TORQUE_SIDES: Mapping[TorqueSide, str] = {
    "output": "the torque is that at the output",
    "motor": "the torque is the motor's, referred to the output (times the ratio): friction, cogging and stiction of "
    "motor, crank and drive are in it, and the torque at the output is smaller or larger by them",
}
"""What a record's torque contains, by the side at which it was measured."""
TORQUE_COLUMNS = ("output_torque", "referred_motor_torque", "motor_torque", "motor_current")


@dataclass(frozen=True)
class Pendulum:
    """mass: kg; length: m, from the axis to the centre of mass; shaft: "output" or "crank"; zero: rad, angle of this
    shaft at which the pendulum hangs."""

    mass: float
    length: float
    shaft: str = "output"
    zero: float = 0.0

    def torque(self, angle: Array, acceleration: Array) -> Array:
        """Torque (n,), N.m, that moves the pendulum; angle: (n,) rad; acceleration: (n,) rad/s^2."""
        moment = self.mass * self.length
        return moment * GRAVITY * np.sin(angle - self.zero) + moment * self.length * acceleration


@dataclass(frozen=True)
class TorqueConstants:
    """What turns a measured current or motor torque into a torque at the output; None where it is not stated.

    ratio: signed, crank to output; torque_constant: N.m/A; motor_inertia: kg.m2, at the crank; pendulum: on a shaft.
    """

    ratio: float | None = None
    torque_constant: float | None = None
    motor_inertia: float | None = None
    pendulum: Pendulum | None = None


CONSTANTS = {"ratio": "", "torque_constant": "N.m/A", "motor_inertia": "kg.m2"}
"""Keys of a column map that hold constants, with their units."""


def read_constants(table: Mapping[str, Any], where: str) -> TorqueConstants:
    """The constants among the keys of a column map. Raises `InputError` for values that are none."""
    found: dict[str, Any] = {
        key: parse_constant(table[key], unit, f"{where}: {key}") for key, unit in CONSTANTS.items() if key in table
    }
    for key, value in found.items():
        expect(value > 0 or (key == "ratio" and value != 0), "a positive number", table[key], f"{where}: {key}")
    if "pendulum" in table:
        found["pendulum"] = _read_pendulum(table["pendulum"], f"{where}: pendulum")
    return TorqueConstants(**found)


def _read_pendulum(table: object, where: str) -> Pendulum:
    if not isinstance(table, dict):
        raise InputError(f"{where}: expected a table with mass and length, got {table!r}")
    units = {"mass": "kg", "length": "m", "zero": "rad"}
    refuse_unknown("key", table, [*units, "shaft"], where)
    for key in ("mass", "length"):
        expect(key in table, f"a {key}", sorted(table), where)
    shaft = table.get("shaft", "output")
    expect(shaft in ("output", "crank"), "shaft = 'output' or 'crank'", shaft, where)
    values = {key: parse_constant(table[key], unit, f"{where}: {key}") for key, unit in units.items() if key in table}
    for key in ("mass", "length"):
        expect(values[key] > 0, f"a positive {key}", table[key], where)
    return Pendulum(shaft=shaft, **values)


def torque_source(columns: Collection[str], constants: TorqueConstants, where: str) -> str:
    """What states the torque: one of the columns, or a pendulum on the output. Raises `InputError` unless exactly one
    does."""
    stated = [name for name in TORQUE_COLUMNS if name in columns]
    if constants.pendulum is not None and constants.pendulum.shaft == "output":
        stated.append("a pendulum on the output")
    if not stated:
        raise InputError(f"{where}: expected a column 'output_torque' or another torque, got {sorted(columns)}")
    expect(len(stated) == 1, "one statement of the torque", " and ".join(stated), where)
    return stated[0]


def torque_at_output(
    values: Mapping[str, Array], time: Array, run: NDArray[Any], constants: TorqueConstants, where: str
) -> tuple[Array, TorqueSide]:
    """Torque (n,) at the output, N.m, and the side at which it was measured.

    values: (n,) by canonical column, in SI units; time: (n,) s; run: (n,). Raises `InputError` as `torque_source` does,
    and for constants that are missing or have no use.
    """
    hanging = constants.pendulum
    source = torque_source(values, constants, where)
    _check_constants(source, values, constants, where)
    if source == "output_torque":
        return values[source], "output"
    if hanging is not None and hanging.shaft == "output":
        angle = values["output_angle"]
        return hanging.torque(angle, acceleration(angle, time, run)), "output"
    torque = values[source]
    ratio = 1.0 if constants.ratio is None else constants.ratio
    at_motor = torque / ratio if source == "referred_motor_torque" else torque * (constants.torque_constant or 1.0)
    if constants.motor_inertia is None and hanging is None:
        return torque if source == "referred_motor_torque" else ratio * at_motor, "motor"
    crank = values["crank_angle"]
    speeding_up = acceleration(crank, time, run)
    at_motor = at_motor - (constants.motor_inertia or 0.0) * speeding_up
    if hanging is not None:
        at_motor = at_motor - hanging.torque(crank, speeding_up)
    return ratio * at_motor, "motor"


def _check_constants(source: str, values: Mapping[str, Array], constants: TorqueConstants, where: str) -> None:
    """Raise `InputError` for constants that the source of the torque lacks, or that have no use beside it."""
    at_motor = source in TORQUE_COLUMNS and source != "output_torque"
    moving = constants.motor_inertia is not None or (constants.pendulum is not None and at_motor)
    needed = {
        "ratio": source in ("motor_torque", "motor_current") or (at_motor and moving),
        "torque_constant": source == "motor_current",
    }
    useful = {"ratio": at_motor, "torque_constant": needed["torque_constant"], "motor_inertia": at_motor}
    useful["pendulum"] = at_motor or source not in TORQUE_COLUMNS
    examples = {"ratio": "ratio = -29", "torque_constant": 'torque_constant = "95 mN.m/A"'}
    for key, is_needed in needed.items():
        if is_needed and getattr(constants, key) is None:
            raise InputError(
                f"{where}: expected {key} for {source}; state it in the file of --columns: {examples[key]}"
            )
    for key, is_useful in useful.items():
        if getattr(constants, key) is not None and not is_useful:
            raise InputError(f"{where}: expected no {key} beside {source}, which needs none; remove it")
    shaft = "output_angle" if source not in TORQUE_COLUMNS else "crank_angle" if moving else None
    if shaft is not None and shaft not in values:
        what = "motor_inertia" if constants.motor_inertia is not None else "the pendulum"
        raise InputError(f"{where}: expected a column {shaft!r} for {what}, got {', '.join(sorted(values))}")


def acceleration(angle: Array, time: Array, run: NDArray[Any]) -> Array:
    """Acceleration (n,), rad/s^2, of an angle (n,), rad: parabolas over `WINDOW` within the runs.

    time: (n,) s; where most samples share their stamp with another, as of a coarse clock, samples count as evenly
    spaced in a run. run: (n,). Zero in runs of fewer than `MIN_WINDOW` stamps.
    """
    from scipy.signal import savgol_filter

    edges = [0, *(np.flatnonzero(np.diff(run)) + 1).tolist(), len(time)]
    found = np.zeros(len(time))
    for a, b in itertools.pairwise(edges):
        stamps, index = np.unique(time[a:b], return_inverse=True)
        if len(stamps) < MIN_WINDOW:
            continue
        coarse = 2 * len(stamps) < b - a
        # Evenly spaced values allow one filter for the run.
        even = np.linspace(stamps[0], stamps[-1], b - a if coarse else len(stamps))
        mean = np.bincount(index, angle[a:b]) / np.bincount(index)
        values = angle[a:b] if coarse else np.interp(even, stamps, mean)
        step = float(even[1] - even[0])
        window = min(max(MIN_WINDOW, 2 * round(WINDOW / step / 2) + 1), len(even) - 1 + len(even) % 2)
        second = np.asarray(savgol_filter(values, window, 2, deriv=2, delta=step), float)
        found[a:b] = second if coarse else np.interp(time[a:b], even, second)
    return found
