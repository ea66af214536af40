"""Units of the FMU variables in SI base units, as FMI declares them (FMI 2.0.4, section 2.2.2)."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from stiffness_model.errors import expect, unknown_name

DIMENSIONS = ("kg", "m", "s", "A", "K", "mol", "cd", "rad")
"""The base units of FMI, in the order of the schema."""


@dataclass(frozen=True)
class BaseUnit:
    """value in base units = factor * value + offset; exponents: (base unit, exponent) of those that occur."""

    exponents: tuple[tuple[str, int], ...]
    factor: float = 1.0
    offset: float = 0.0


_ATOMS: dict[str, tuple[dict[str, int], float]] = {
    "1": ({}, 1.0),
    "%": ({}, 0.01),
    "m": ({"m": 1}, 1.0),
    "mm": ({"m": 1}, 1e-3),
    "um": ({"m": 1}, 1e-6),
    "s": ({"s": 1}, 1.0),
    "min": ({"s": 1}, 60.0),
    "h": ({"s": 1}, 3600.0),
    "kg": ({"kg": 1}, 1.0),
    "K": ({"K": 1}, 1.0),
    "rad": ({"rad": 1}, 1.0),
    "deg": ({"rad": 1}, math.pi / 180),
    "arcmin": ({"rad": 1}, math.pi / 10800),
    "rev": ({"rad": 1}, 2 * math.pi),
    "N": ({"kg": 1, "m": 1, "s": -2}, 1.0),
    "kN": ({"kg": 1, "m": 1, "s": -2}, 1e3),
    "Pa": ({"kg": 1, "m": -1, "s": -2}, 1.0),
    "Hz": ({"s": -1}, 1.0),
    "degC": ({"K": 1}, 1.0),
}
_OFFSETS = {"degC": 273.15}
_TOKEN = re.compile(r"(1|%|[A-Za-z]+)(-?\d+)?")


def base_unit(unit: str) -> BaseUnit:
    """The base units of a unit such as "N.m/rad" or "rad/(N.m)".

    Factors are joined by ".", all factors after the single "/" are in the denominator, and a number after a name is its
    exponent. Errors: `InputError` for a text of another form, `UnknownNameError` for an unknown name.

    >>> base_unit("N.m/rad").exponents
    (('kg', 1), ('m', 2), ('s', -2), ('rad', -1))
    >>> base_unit("degC").offset
    273.15
    """
    total: dict[str, int] = dict.fromkeys(DIMENSIONS, 0)
    factor = 1.0
    numerator, slash, denominator = unit.partition("/")
    expect(
        bool(numerator) and (not slash or bool(denominator)) and "/" not in denominator,
        "a unit such as 'N.m/rad'",
        unit,
        "unit",
    )
    for part, sign in ((numerator, 1), (denominator, -1)):
        for token in part.strip("()").split(".") if part else ():
            match = _TOKEN.fullmatch(token)
            if match is None or match[1] not in _ATOMS:
                raise unknown_name("unit", token, _ATOMS, f"unit {unit!r}")
            power = sign * int(match[2] or 1)
            exponents, scale = _ATOMS[match[1]]
            factor *= scale**power
            for name, exponent in exponents.items():
                total[name] += power * exponent
    occurring = tuple((name, total[name]) for name in DIMENSIONS if total[name])
    return BaseUnit(occurring, factor, _OFFSETS.get(unit, 0.0))
