"""Torque at the output from a torque that was not measured there, and the motor's torque beside one that was.

A motor torque T_m, positive in the direction of the crank's angle, gives without losses

    T = ratio (T_m - (J + m l^2) d2phi/dt2 - m g l sin(phi - phi_0))

at the output, with the inertia J of everything that turns with the crank and, where one hangs on the crank, a pendulum
(mass m, length l, hanging angle phi_0). Friction, cogging and stiction of motor and crank stay in it. A pendulum on the
output loads the drive with T = m g l sin(q - q_0) + m l^2 d2q/dt2, which is a torque at the output.

Where both are known, the torque at the output is the record's, and the bracket is the torque on the crank. What it
exceeds T/ratio by are the losses.
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
MOTOR_COLUMNS = ("referred_motor_torque", "motor_torque", "motor_current")
"""Columns that state the motor's torque."""
ON_OUTPUT = "a pendulum on the output"
"""The torque at the output that a pendulum states in place of a column."""


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


@dataclass(frozen=True)
class MeasuredTorques:
    """output: (n,) N.m at the output; side: at which it was measured; crank: (n,) N.m of the motor on the crank, less
    what accelerates masses there, None where the torque at the output was not measured beside it."""

    output: Array
    side: TorqueSide
    crank: Array | None = None


def torque_sources(columns: Collection[str], constants: TorqueConstants, where: str) -> tuple[str | None, str | None]:
    """What states the torque at the output (its column or `ON_OUTPUT`), and the column that states the motor's.

    Raises `InputError` where nothing does, and for two statements of the same torque.
    """
    at_output = ["output_torque"] if "output_torque" in columns else []
    if constants.pendulum is not None and constants.pendulum.shaft == "output":
        at_output.append(ON_OUTPUT)
    at_motor = [name for name in MOTOR_COLUMNS if name in columns]
    if not at_output and not at_motor:
        raise InputError(f"{where}: expected a column 'output_torque' or another torque, got {sorted(columns)}")
    for stated, shaft in ((at_output, "at the output"), (at_motor, "of the motor")):
        expect(len(stated) <= 1, f"one statement of the torque {shaft}", " and ".join(stated), where)
    return next(iter(at_output), None), next(iter(at_motor), None)


def measured_torques(
    values: Mapping[str, Array], time: Array, run: NDArray[Any], constants: TorqueConstants, where: str
) -> MeasuredTorques:
    """The torques that a record states.

    values: (n,) by canonical column, in SI units; time: (n,) s; run: (n,). Raises `InputError` as `torque_sources`
    does, and for constants that are missing or have no use.
    """
    at_output, at_motor = torque_sources(values, constants, where)
    _check_constants(at_output, at_motor, values, constants, where)
    crank = None if at_motor is None else _torque_at_crank(at_motor, values, time, run, constants)
    if at_output is None:
        assert at_motor is not None
        assert crank is not None
        # A referred torque without inertia needs no ratio, and keeps its digits.
        as_stated = at_motor == "referred_motor_torque" and not _moves_masses(constants)
        return MeasuredTorques(values[at_motor] if as_stated else (constants.ratio or 1.0) * crank, "motor")
    if at_output == "output_torque":
        return MeasuredTorques(values[at_output], "output", crank)
    hanging, angle = constants.pendulum, values["output_angle"]
    assert hanging is not None
    return MeasuredTorques(hanging.torque(angle, acceleration(angle, time, run)), "output", crank)


def _torque_at_crank(
    source: str, values: Mapping[str, Array], time: Array, run: NDArray[Any], constants: TorqueConstants
) -> Array:
    """Torque (n,), N.m, of the motor on the crank, less what accelerates masses and lifts a pendulum there."""
    factor = constants.torque_constant or 1.0
    at_motor = (
        values[source] / (constants.ratio or 1.0) if source == "referred_motor_torque" else values[source] * factor
    )
    if not _moves_masses(constants):
        return at_motor
    crank = values["crank_angle"]
    speeding_up = acceleration(crank, time, run)
    at_motor = at_motor - (constants.motor_inertia or 0.0) * speeding_up
    if constants.pendulum is not None and constants.pendulum.shaft == "crank":
        at_motor = at_motor - constants.pendulum.torque(crank, speeding_up)
    return at_motor


def _moves_masses(constants: TorqueConstants) -> bool:
    """Whether the motor's torque also moves masses on the crank that are known."""
    hanging = constants.pendulum
    return constants.motor_inertia is not None or (hanging is not None and hanging.shaft == "crank")


def _check_constants(
    at_output: str | None, at_motor: str | None, values: Mapping[str, Array], constants: TorqueConstants, where: str
) -> None:
    """Raise `InputError` for constants that the sources of the torque lack, or that have no use beside them."""
    moving = at_motor is not None and _moves_masses(constants)
    source = at_motor or at_output
    needed = {
        # Beside the torque at the output the motor's torque stays at the crank.
        "ratio": at_motor == "referred_motor_torque"
        if at_output is not None
        else at_motor in ("motor_torque", "motor_current") or moving,
        "torque_constant": at_motor == "motor_current",
    }
    useful = {"ratio": at_motor is not None, "torque_constant": needed["torque_constant"]}
    useful |= {"motor_inertia": at_motor is not None, "pendulum": at_motor is not None or at_output == ON_OUTPUT}
    examples = {
        "ratio": "ratio = -29, or name the drive with --drive",
        "torque_constant": 'torque_constant = "95 mN.m/A"',
    }
    for key, is_needed in needed.items():
        if is_needed and getattr(constants, key) is None:
            raise InputError(
                f"{where}: expected {key} for {source}; state it in the file of --columns: {examples[key]}"
            )
    for key, is_useful in useful.items():
        if getattr(constants, key) is not None and not is_useful:
            raise InputError(f"{where}: expected no {key} beside {source}, which needs none; remove it")
    shafts = {"output_angle": at_output == ON_OUTPUT, "crank_angle": moving}
    for shaft, is_needed in shafts.items():
        if is_needed and shaft not in values:
            what = "motor_inertia" if moving and constants.motor_inertia is not None else "the pendulum"
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
