"""The columns of a record: names, units, and the range of values that each can hold."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from stiffness_model.errors import InputError
from stiffness_model.frozen_mapping import FrozenMapping
from stiffness_model.numerics.arrays import Array

COLUMNS: Mapping[str, str] = FrozenMapping(
    {
        "time": "s",
        "run": "",
        "crank_angle": "rad",
        "output_angle": "rad",
        "twist": "rad",
        "output_torque": "N.m",
        "referred_motor_torque": "N.m",
        "motor_torque": "N.m",
        "motor_current": "A",
        "temperature": "degC",
    }
)
"""Canonical columns and the unit that each is converted to."""
REPLACED_BY: Mapping[str, str] = FrozenMapping(
    {
        "twist": "output_angle",
        "referred_motor_torque": "output_torque",
        "motor_torque": "output_torque",
        "motor_current": "output_torque",
    }
)
"""Columns that a file may state instead of another: the column of a `Record` that they become."""
ANGLE_LIMIT = 1e-6 / float(np.finfo(float).eps)
"""rad, 4.5e9: beyond it double precision no longer resolves 1 urad, and a twist is hundreds of these. A crank at
3000 rpm takes 166 days to get there."""
RANGES: Mapping[str, tuple[float, float]] = FrozenMapping(
    {
        # Time stamps count from the year 1 at the earliest: 6.4e10 s.
        "time": (-1e11, 1e11),
        # Integers that double precision represents exactly.
        "run": (-(2.0**53), 2.0**53),
        "crank_angle": (-ANGLE_LIMIT, ANGLE_LIMIT),
        "output_angle": (-ANGLE_LIMIT, ANGLE_LIMIT),
        "twist": (-ANGLE_LIMIT, ANGLE_LIMIT),
        # A hundred times the main gears of the largest wind turbines, which carry some 1e7 N.m.
        "output_torque": (-1e9, 1e9),
        "referred_motor_torque": (-1e9, 1e9),
        "motor_torque": (-1e9, 1e9),
        # Far beyond the currents of the largest motors.
        "motor_current": (-1e6, 1e6),
        # From absolute zero to the melting point of iron.
        "temperature": (-273.15, 1538.0),
    }
)
"""Range of every column in its canonical unit. Squares and sums of such values do not overflow, so that no later step
has to check for it."""


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
