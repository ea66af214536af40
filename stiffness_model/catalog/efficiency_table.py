"""The efficiency of a gear over speed and load, as a data sheet tabulates it."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from ..errors import InputError, expect, refuse_unknown
from ..numerics.arrays import Array
from ..units import format_quantity, parse_quantity

_KEYS = ("speed", "torque", "value")


@dataclass(frozen=True)
class EfficiencyTable:
    """Efficiency over the speed of the crank, (n,) rad/s, and the torque at the output, (m,) N.m.

    value: n rows of m numbers, 0 to 1. One speed or one torque means that the sheet states no influence of it.
    """

    speed: tuple[float, ...]
    torque: tuple[float, ...]
    value: tuple[tuple[float, ...], ...]

    def at(self, speed: ArrayLike, torque: ArrayLike) -> Array:
        """Efficiency at speeds, rad/s, and torques, N.m, which broadcast, of any shape; bilinear, held at the ends.

        >>> table = EfficiencyTable((50.0, 100.0), (10.0, 20.0), ((0.6, 0.8), (0.5, 0.7)))
        >>> float(table.at(-75.0, 15.0).round(3))
        0.65
        """
        n, m = np.broadcast_arrays(np.abs(np.asarray(speed, float)), np.abs(np.asarray(torque, float)))
        rows = np.stack([np.interp(m, self.torque, row) for row in self.value])
        place = np.interp(n, self.speed, np.arange(len(self.speed)))
        low = np.floor(place).astype(int)
        high = np.minimum(low + 1, len(self.speed) - 1)
        first, second = (np.take_along_axis(rows, k[None], axis=0)[0] for k in (low, high))
        return first + (place - low) * (second - first)


def read_efficiency(table: object, where: str) -> EfficiencyTable:
    """The table [efficiency] of a drawing: speed and torque as lists of texts with units, value as rows of numbers.

    Raises `InputError` for other keys and for lists that do not fit together.
    """
    expect(isinstance(table, Mapping), "a table [efficiency]", table, where)
    assert isinstance(table, Mapping)
    refuse_unknown("field", table, _KEYS, where)
    for key in _KEYS:
        expect(isinstance(table.get(key), list), f"a list {key!r}", table.get(key), where)
    speed, torque = (quantities(table[key], key, f"{where}: {key}") for key in ("speed", "torque"))
    try:
        value = np.array(table["value"], float)
    except (TypeError, ValueError):
        raise InputError(f"{where}: value: expected rows of numbers, got {table['value']!r}") from None
    shape = (len(speed), len(torque))
    expect(value.shape == shape, f"{shape[0]} rows of {shape[1]} numbers", value.shape, f"{where}: value")
    expect(bool(((value > 0) & (value <= 1)).all()), "efficiencies above 0, at most 1", table["value"], where)
    return EfficiencyTable(speed, torque, tuple(tuple(row) for row in value.tolist()))


def write_efficiency(table: EfficiencyTable) -> dict[str, Any]:
    """The table as TOML has it, which `read_efficiency` reads back."""
    return {
        "speed": [format_quantity(speed, "speed") for speed in table.speed],
        "torque": [format_quantity(torque, "torque") for torque in table.torque],
        "value": [list(row) for row in table.value],
    }


def quantities(values: object, quantity: str, where: str) -> tuple[float, ...]:
    """SI values of a list of texts with units, increasing. Raises `InputError`."""
    expect(isinstance(values, list) and len(values) > 0, "a list of texts with units", values, where)
    assert isinstance(values, list)
    for value in values:
        expect(isinstance(value, str) or value == 0, f"a {quantity} with its unit in every entry", value, where)
    read = tuple(parse_quantity(value, quantity, where) for value in values)
    expect(all(np.isfinite(read)), "finite values", values, where)
    increasing = all(a < b for a, b in itertools.pairwise(read))
    expect(increasing, "values that increase", values, where)
    return read
