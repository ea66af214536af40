"""What a test rig can do, from RIG.toml: motion, temperature, sampling and sensors; every value with its unit."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from stiffness_model.errors import expect, expect_number, refuse_unknown
from stiffness_model.io.toml_files import parse_toml, read_text
from stiffness_model.numerics.arrays import Array
from stiffness_model.units import ARCMIN, REFERENCE_TEMPERATURE, parse_quantity

CRANKS = ("turns", "angles", "locked")
"""Cranks of a rig: one that turns under load, one that is locked at any angle, one that is locked at a single angle."""
TORQUE_NOISE_SHARE = 0.003
"""Noise of the torque sensor over the drive's full torque where the rig file states none. Chosen by judgement: a strain
gauge shaft of class 0.1 whose range exceeds the drive's torque."""


@dataclass(frozen=True)
class Rig:
    """A test rig; SI units and degC.

    name: of the rig, for reports; minutes: greatest duration of a protocol; torque: N.m, the greatest at the output,
    None for the drive's full torque; crank: one of `CRANKS`; speed: rad/s, the greatest of the crank; shortest_loop: s,
    period of the fastest loop; lowest, highest: degC, and heating_rate: K/s; temperature_measured, crank_measured:
    whether records have these columns; sample_rate: Hz; torque_noise, N.m, output_noise, crank_noise, rad: standard
    deviations of one sample, torque_noise None for `TORQUE_NOISE_SHARE`; torque_resolution, N.m, output_resolution,
    crank_resolution, rad: smallest step of a reading, 0 for none; correlation_time: s, of the noise of the torque
    sensor, 0 for white noise.
    """

    name: str = "rig"
    minutes: float = 30.0
    torque: float | None = None
    crank: str = "turns"
    speed: float = 100.0
    shortest_loop: float = 0.6
    lowest: float = REFERENCE_TEMPERATURE
    highest: float = 60.0
    heating_rate: float = 2 / 60
    temperature_measured: bool = True
    crank_measured: bool = True
    sample_rate: float = 100.0
    torque_noise: float | None = None
    torque_resolution: float = 0.0
    correlation_time: float = 0.0
    output_noise: float = 0.02 * ARCMIN
    output_resolution: float = 0.0
    crank_noise: float = 0.3 * ARCMIN
    crank_resolution: float = 0.0

    def for_drive(self, full_torque: float) -> Rig:
        """The same with torque and torque noise stated, for a drive. full_torque: of the drive, N.m."""
        torque = full_torque if self.torque is None else min(self.torque, full_torque)
        noise = TORQUE_NOISE_SHARE * full_torque if self.torque_noise is None else self.torque_noise
        return replace(self, torque=torque, torque_noise=noise)

    @property
    def can_turn(self) -> bool:
        """Whether the crank turns under load."""
        return self.crank == "turns" and self.speed > 0

    @property
    def can_set_angles(self) -> bool:
        """Whether the crank can be locked at different angles."""
        return self.crank != "locked"

    @property
    def can_heat(self) -> bool:
        """Whether the temperature can be changed and is measured."""
        return self.temperature_measured and self.highest > self.lowest and self.heating_rate > 0

    @property
    def missing(self) -> tuple[str, ...]:
        """Canonical columns that records of this rig lack."""
        return tuple(
            name
            for name, measured in (
                ("crank_angle", self.crank_measured and self.can_set_angles),
                ("temperature", self.temperature_measured),
            )
            if not measured
        )


@dataclass(frozen=True)
class RigNoise:
    """Standard deviations of single samples: torque, N.m; twist, rad; correlation: of successive samples of torque."""

    torque: float
    twist: float
    correlation: float

    def variances(self, slope: Array) -> tuple[Array, Array]:
        """(n,) (N.m)^2 each, of torque and of twist times the stiffness `slope` (n,), N.m/rad, for white noise that
        gives sums over many samples the same variance."""
        inflation = (1 + self.correlation) / (1 - self.correlation)
        return np.full(len(slope), inflation * self.torque**2), (self.twist * slope) ** 2


def rig_noise(rig: Rig, ratio: float) -> RigNoise:
    """The noise of single samples, with the rounding errors of the readings, of a gear with this ratio."""
    assert rig.torque_noise is not None

    def both(noise: float, resolution: float) -> float:
        return noise**2 + resolution**2 / 12  # variance of a uniformly distributed rounding error

    crank = both(rig.crank_noise, rig.crank_resolution) if rig.can_set_angles else 0.0
    correlation = float(np.exp(-1 / (rig.sample_rate * rig.correlation_time))) if rig.correlation_time > 0 else 0.0
    return RigNoise(
        both(rig.torque_noise, rig.torque_resolution) ** 0.5,
        (both(rig.output_noise, rig.output_resolution) + crank / ratio**2) ** 0.5,
        correlation,
    )


class _Field(NamedTuple):
    """Where a value of RIG.toml goes: its attribute, quantity of `units.UNITS`, lowest and highest value."""

    attribute: str
    quantity: str
    low: float = 0.0
    high: float = math.inf


KEYS: Mapping[str, Mapping[str, _Field | str]] = {
    "motion": {
        "crank": "choice",
        "torque": _Field("torque", "torque", 1e-6, 1e9),
        "speed": _Field("speed", "speed", 0.0, 1e5),
        "shortest_loop": _Field("shortest_loop", "time", 1e-3, 60.0),
    },
    "temperature": {
        "lowest": _Field("lowest", "temperature", -273.15, 1538.0),
        "highest": _Field("highest", "temperature", -273.15, 1538.0),
        "rate": _Field("heating_rate", "heating rate"),
        "measured": "temperature_measured",
    },
    "sampling": {"rate": _Field("sample_rate", "frequency", 1.0, 1e7)},
    "torque_sensor": {
        "noise": _Field("torque_noise", "torque", 1e-9),
        "resolution": _Field("torque_resolution", "torque"),
        "correlation_time": _Field("correlation_time", "time"),
    },
    "output_encoder": {
        "noise": _Field("output_noise", "angle"),
        "resolution": _Field("output_resolution", "angle"),
    },
    "crank_encoder": {
        "noise": _Field("crank_noise", "angle"),
        "resolution": _Field("crank_resolution", "angle"),
        "measured": "crank_measured",
    },
}
"""Keys of RIG.toml by section. A text instead of a field is the attribute of a yes-or-no value, or the choice of the
crank. The ranges refuse slips of the keyboard and were chosen by judgement."""


def load_rig(path: str | os.PathLike[str]) -> Rig:
    """The rig in a TOML file. Raises `InputError` with the file, the key, what was expected and what was given."""
    return rig_from_dict(parse_toml(read_text(Path(path), "TOML rig"), str(path), "a TOML rig"), str(path))


def rig_from_dict(table: Mapping[str, Any], where: str = "rig") -> Rig:
    """The rig in nested tables, as TOML gives them. Raises `InputError`.

    >>> rig_from_dict({"motion": {"crank": "locked", "torque": "120 N.m"}}).torque
    120.0
    >>> rig_from_dict({"motion": {"torqe": "120 N.m"}})
    Traceback (most recent call last):
    ...
    stiffness_model.errors.UnknownNameError: rig [motion]: unknown key 'torqe'; did you mean 'torque'?
    """
    refuse_unknown("section or key", table, ("name", "minutes", *KEYS), where)
    name = table.get("name", Path(where).stem)
    expect(isinstance(name, str), "a text", name, f"{where}: name")
    values: dict[str, Any] = {"name": name}
    if "minutes" in table:
        values["minutes"] = expect_minutes(table["minutes"], f"{where}: minutes")
    for section, keys in KEYS.items():
        given = table.get(section, {})
        expect(isinstance(given, Mapping), f"a table [{section}]", given, where)
        refuse_unknown("key", given, keys, f"{where} [{section}]")
        for key, value in given.items():
            attribute, parsed = _parse(keys[key], value, f"{where} [{section}] {key}")
            values[attribute] = parsed
    rig = Rig(**values)
    expect(rig.lowest <= rig.highest, "lowest at most highest", f"{rig.lowest:g} > {rig.highest:g} degC", where)
    return rig


def expect_minutes(value: object, where: str) -> float:
    """The value as a duration in minutes, between a second and a year. Raises `InputError` for others."""
    return expect_number(value, "a number of minutes from 0.02 to 500000", where, low=0.016, high=500_000.5)


def _parse(field: _Field | str, value: object, where: str) -> tuple[str, Any]:
    """Attribute of a key and its value."""
    if field == "choice":
        expect(value in CRANKS, " or ".join(repr(c) for c in CRANKS), value, where)
        return "crank", value
    if isinstance(field, str):
        expect(isinstance(value, bool), "true or false", value, where)
        return field, value
    example = {"torque": "200 N.m", "speed": "50 rad/s", "time": "1 s", "temperature": "60 degC", "angle": "0.1 arcmin"}
    example |= {"heating rate": "2 K/min", "frequency": "100 Hz"}
    expect(isinstance(value, str), f"a text with a unit, such as '{example[field.quantity]}'", value, where)
    number = parse_quantity(value, field.quantity, where)
    limits = f"a {field.quantity} of {field.low:g} or more" + (
        f", at most {field.high:g}" if field.high < math.inf else ""
    )
    expect(math.isfinite(number) and field.low <= number <= field.high, limits + " (SI, degC)", value, where)
    return field.attribute, number
