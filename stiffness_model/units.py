"""Units in drawings, rig files and command lines: "41 mm" becomes 0.041 and back. Internally, everything is in SI.

The table is short on purpose: these are the units of gear drawings and test rigs. Measured records, which come in any
unit, are converted with a units library (`reefmu.record`).
"""

from __future__ import annotations

import math
import numbers
import re
from typing import Any

from .errors import InputError, unknown_name

ARCMIN = math.pi / (180 * 60)
"""One arc minute in rad."""
MICROMETRE = 1e-6
REFERENCE_TEMPERATURE = 20.0
"""Temperature, degC, to which drawn sizes refer (ISO 1)."""

UNITS: dict[str, dict[str, float]] = {
    "length": {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "um": 1e-6, "µm": 1e-6, "μm": 1e-6, "nm": 1e-9},
    "pressure": {"Pa": 1.0, "kPa": 1e3, "MPa": 1e6, "GPa": 1e9, "N/mm2": 1e6},
    "angle": {"rad": 1.0, "mrad": 1e-3, "deg": math.pi / 180, "arcmin": ARCMIN, "'": ARCMIN},
    "density": {"kg/m3": 1.0, "g/cm3": 1e3},
    "torque": {"N.m": 1.0, "Nm": 1.0, "kN.m": 1e3, "kNm": 1e3},
    "torsional stiffness": {
        "N.m/rad": 1.0,
        "Nm/rad": 1.0,
        "kN.m/rad": 1e3,
        "kNm/rad": 1e3,
        "N.m/arcmin": 1 / ARCMIN,
        "Nm/arcmin": 1 / ARCMIN,
    },
    "rotational damping": {"N.m.s/rad": 1.0, "Nm.s/rad": 1.0, "Nms/rad": 1.0},
    "moment of inertia": {"kg.m2": 1.0, "kg.cm2": 1e-4},
    "stiffness": {"N/m": 1.0, "N/mm": 1e3, "kN/mm": 1e6, "N/um": 1e6, "N/µm": 1e6, "N/μm": 1e6},
    "speed": {"rad/s": 1.0, "rpm": math.pi / 30, "1/min": math.pi / 30},
    "force": {"N": 1.0, "kN": 1e3},
    "time": {"s": 1.0, "ms": 1e-3, "min": 60.0, "h": 3600.0},
    "frequency": {"Hz": 1.0, "kHz": 1e3},
    "temperature": {"degC": 1.0},
    "heating rate": {"K/s": 1.0, "K/min": 1 / 60, "K/h": 1 / 3600},
}
_SI = {
    "length": "m",
    "pressure": "Pa",
    "angle": "rad",
    "density": "kg/m3",
    "torque": "N.m",
    "torsional stiffness": "N.m/rad",
    "rotational damping": "N.m.s/rad",
    "moment of inertia": "kg.m2",
    "stiffness": "N/m",
    "speed": "rad/s",
    "force": "N",
    "time": "s",
    "frequency": "Hz",
    "temperature": "degC",
    "heating rate": "K/s",
}
"""The SI unit of each quantity, whose factor is 1; temperatures are in degC."""
_PREFERRED = {
    "length": ("mm", "um"),
    "pressure": ("GPa",),
    "angle": ("arcmin",),
    "density": ("kg/m3",),
    "torque": ("N.m",),
    "torsional stiffness": ("kN.m/rad",),
    "rotational damping": ("N.m.s/rad",),
    "moment of inertia": ("kg.cm2",),
    "stiffness": ("N/um",),
    "speed": ("rpm",),
    "force": ("N",),
    "time": ("s",),
    "frequency": ("Hz",),
    "temperature": ("degC",),
    "heating rate": ("K/min",),
}
_ALTERNATIVE = {"torsional stiffness": "N.m/arcmin"}
"""A second unit of drawings, which is written where it gives the shorter text."""
DISPLAY_UNITS: dict[str, tuple[float, str]] = {
    "m": (MICROMETRE, "um"),
    "rad": (ARCMIN, "arcmin"),
    "N.m/rad": (1 / ARCMIN, "N.m/arcmin"),
    "rad/(N.m)": (ARCMIN, "arcmin/(N.m)"),
    "rad/K": (ARCMIN, "arcmin/K"),
    "m/K": (MICROMETRE, "um/K"),
    "m/rad": (1e-9, "nm/rad"),
}
"""The unit in which outputs show a value in SI, by the SI unit, with its size in SI; other units are shown as they are.
The variables of an FMU stay in SI."""
LARGE_ANGLE = math.radians(5)
"""Angle, rad, beyond which outputs show deg instead of arcmin: phases and turns, not twists; chosen by judgement."""
_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(\S*)\s*")


def si_unit(quantity: str) -> str:
    """The SI unit of a quantity of `UNITS`.

    >>> si_unit("torsional stiffness")
    'N.m/rad'
    """
    return _SI[quantity]


def quantity_of(unit: str) -> str | None:
    """The quantity of `UNITS` whose SI unit this is; None if there is none.

    >>> quantity_of("N.m"), quantity_of("rad/(N.m)")
    ('torque', None)
    """
    return next((quantity for quantity, si in _SI.items() if si == unit), None)


def parse_quantity(value: object, quantity: str, where: str) -> float:
    """The SI value of a text such as "41 mm"; a number is taken as SI.

    Quantities of a units library with `to(unit).magnitude`, such as pint's, are converted. Raises `InputError` for text
    without a number or a unit, for an unknown unit, and for a quantity of another kind.

    >>> parse_quantity("41 mm", "length", "crank_radius")
    0.041
    >>> parse_quantity("41", "length", "crank_radius")
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: crank_radius: expected a length with its unit, such as '1 mm', got '41'
    """
    if isinstance(value, numbers.Real) and not isinstance(value, bool):
        return float(value)
    example = f"such as '1 {_PREFERRED[quantity][0]}'"
    kind = f"{'an' if quantity[0] in 'aeiou' else 'a'} {quantity} with its unit, {example}"
    if hasattr(value, "to"):
        return _converted(value, _SI[quantity], kind, where)
    if not isinstance(value, str):
        raise InputError(f"{where}: expected {kind}, got {value!r}")
    match = _QUANTITY.fullmatch(value)
    if match is None or not match[2]:
        pointed = value.replace(",", ".", 1)
        remedy = f"; with a decimal point it is {pointed!r}" if "," in value and _QUANTITY.fullmatch(pointed) else ""
        raise InputError(f"{where}: expected {kind}, got {value!r}{remedy}")
    number, unit = match.groups()
    if unit not in UNITS[quantity]:
        raise unknown_name(f"unit of {quantity}", unit, UNITS[quantity], where)
    return float(number) * UNITS[quantity][unit]


def _converted(value: Any, unit: str, kind: str, where: str) -> float:
    """The magnitude in the SI unit, converted by the quantity itself."""
    try:
        # Units libraries write products and powers as Python does.
        return float(value.to(unit.replace(".", "*").replace("m3", "m**3")).magnitude)
    except (TypeError, ValueError, AttributeError):
        raise InputError(f"{where}: expected {kind}, got {value!r}") from None


def format_quantity(value: float, quantity: str) -> str:
    """The shortest text that reads back as `value`, in the units of a drawing.

    >>> format_quantity(0.041, "length"), format_quantity(13e-6, "length")
    ('41 mm', '13 um')
    """
    unit = _drawing_unit(value, quantity)
    text = _shortest(value, UNITS[quantity][unit])
    other = _ALTERNATIVE.get(quantity, "")
    if other:
        shorter = _shortest(value, UNITS[quantity][other])
        if shorter and (not text or len(shorter) < len(text)):
            text, unit = shorter, other
    if not text:
        # No decimal number of the preferred unit gives exactly this value; in SI every value has one.
        text, unit = repr(float(value)), _SI[quantity]
    return f"{text} {unit}"


def limit_text(limit: float, quantity: str, digits: int = 4) -> str:
    """An upper limit in the units of a drawing, rounded down so that every value below the text is below the limit.

    >>> limit_text(1.9047619047619047e-3, "length"), limit_text(12e-3, "length")
    ('1.904 mm', '12 mm')
    """
    unit = _drawing_unit(limit, quantity)
    value = limit / UNITS[quantity][unit]
    step = 10.0 ** (math.floor(math.log10(abs(value))) + 1 - digits) if value else 1.0
    # Without the small share a limit of few digits would lose its last one to the division's rounding.
    return f"{math.floor(value / step + 1e-9) * step:.{digits}g} {unit}"


def _drawing_unit(value: float, quantity: str) -> str:
    """The unit of drawings that suits a value of this magnitude."""
    names = _PREFERRED[quantity]
    small = len(names) > 1 and value != 0 and abs(value) < 0.1 * UNITS[quantity][names[0]]
    return names[-1] if small else names[0]


def displayed(value: float, unit: str) -> tuple[float, str]:
    """A value in SI in the unit in which outputs show it, and that unit's name.

    >>> displayed(100e3, "N.m/rad")[1], displayed(5.0, "N.m")
    ('N.m/arcmin', (5.0, 'N.m'))
    """
    size, name = _display_unit(unit, value)
    return value / size, name


def _display_unit(unit: str, value: float) -> tuple[float, str]:
    """Size and name of the unit for a value of this magnitude."""
    if unit == "rad" and abs(value) > LARGE_ANGLE:
        return math.pi / 180, "deg"
    return DISPLAY_UNITS.get(unit, (1.0, unit))


def quantity_text(value: float, unit: str, digits: int = 4) -> str:
    """A value in SI as text in the unit in which outputs show it, with so many significant digits.

    >>> quantity_text(1.25e-6, "m"), quantity_text(0.059, "1"), quantity_text(100e3, "N.m/rad", 3)
    ('1.25 um', '0.059', '29.1 N.m/arcmin')
    """
    shown, name = displayed(value, unit)
    return f"{shown:.{digits}g}" + ("" if name == "1" else f" {name}")


def interval_text(low: float, high: float, unit: str, digits: int = 4) -> str:
    """An interval in SI as text in the unit in which outputs show it.

    >>> interval_text(1e-6, 2e-6, "m"), interval_text(-0.01, 1.57, "rad", 2)
    ('1 ... 2 um', '-0.57 ... 90 deg')
    """
    size, name = _display_unit(unit, max(low, high, key=abs))
    return f"{low / size:.{digits}g} ... {high / size:.{digits}g}" + ("" if name == "1" else f" {name}")


def _shortest(value: float, factor: float) -> str:
    """The shortest number that gives exactly `value` when multiplied by the factor of a unit; empty if none does."""
    for digits in range(6, 18):
        text = f"{value / factor:.{digits}g}"
        if float(text) * factor == value:
            return text
    return ""
