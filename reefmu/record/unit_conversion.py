"""Units as files write them, and their conversion."""

from __future__ import annotations

import functools
import math
import re
import unicodedata
from typing import Any

import numpy as np

from stiffness_model.errors import InputError, expect
from stiffness_model.numerics.arrays import Array

from .columns import COLUMNS

_POWER = r"(?<=[^\W\d_])\s*(?:\*\*|\^)\s*-?\d(?![\w.]|\s*(?:\*\*|\^))"
"""A power of a unit with one digit, such as m**2. Others are refused unread: evaluating 9**9**9**9 would never end."""
_SIGNS = str.maketrans(
    {"·": "*", "⋅": "*", "∙": "*", "×": "*", "−": "-", "²": "^2", "º": "°", "˚": "°", "µ": "u", "μ": "u"}
)
_TORQUE = re.compile(r"([kmMu]?N|lbf?|ozf?|kgf?)[\s.*-]*([cmk]?m|ft|in|inch)\.?(?=$|/)")
_LENGTH_FIRST = re.compile(r"(ft|in|inch)[\s.*-]+(lbf?|ozf?)")
_FORCES = {"lb": "lbf", "oz": "ozf", "kg": "kgf"}
_PURE_NUMBERS = ("dimensionless", "percent", "ppm", "count")
_ALIASES = {
    "angle": {
        **{word.upper(): word for word in ("deg", "rad", "rev", "arcmin", "arcsec")},
        **{word.title(): word for word in ("deg", "rad", "rev", "arcmin", "arcsec", "degrees")},
        "'": "arcmin",
        "′": "arcmin",
        "’": "arcmin",
        '"': "arcsec",
        "″": "arcsec",
        "”": "arcsec",
        "degree": "deg",
        "degrees": "deg",
        "revs": "rev",
        "revolutions": "rev",
        "turns": "rev",
        "U": "rev",
        "arc min": "arcmin",
        "arc-min": "arcmin",
        "mdeg": "millideg",
    },
    "temperature": {
        "C": "degC",
        "°C": "degC",
        "℃": "degC",
        "deg C": "degC",
        "Celsius": "degC",
        "F": "degF",
        "°F": "degF",
        "deg F": "degF",
        "k": "K",
    },
    "time": {
        **dict.fromkeys(("sec", "secs", "seconds", "S", "Sec", "SEC", "Seconds", "SECONDS"), "s"),
        "msec": "ms",
        "usec": "us",
    },
    "torque": {"NM": "N*m", "N.M": "N*m", "newton meter": "N*m", "Newton meter": "N*m", "Newton metre": "N*m"},
    "current": {"Amp": "A", "Amps": "A", "amp": "A", "amps": "A"},
}
"""Ways to write a unit, by quantity, that the library of units does not read, or reads as another unit."""
_AMBIGUOUS = {
    "grad": "which is a degree in German and the 400th part of a turn elsewhere; write [deg] or [gon]",
    "Grad": "which is a degree in German and the 400th part of a turn elsewhere; write [deg] or [gon]",
    "count": "which is a count of an encoder; write its resolution, such as [rev/4096]",
    "counts": "which is a count of an encoder; write its resolution, such as [rev/4096]",
    "cts": "which is a count of an encoder; write its resolution, such as [rev/4096]",
    "inc": "which is an increment of an encoder; write its resolution, such as [rev/4096]",
    "ticks": "which is a tick of an encoder; write its resolution, such as [rev/4096]",
    **dict.fromkeys(
        ("Arms", "A rms", "A_rms", "Aeff"),
        "which is an effective value of a phase; write [A], and state the torque_constant of effective amperes",
    ),
    "nm": "which is a nanometre; write [N.m]",
}
_QUANTITIES = {"s": "time", "rad": "angle", "degC": "temperature", "A": "current", "N.m": "torque"}
_CONSTANT = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(|\S.*?)\s*")


@functools.cache
def _registry() -> Any:
    import pint

    registry = pint.UnitRegistry(autoconvert_offset_to_baseunit=True)
    registry.define("rev = turn")
    return registry


def convert_units(values: Array, unit: str, name: str, where: str) -> Array:
    """Values (n,) of a canonical column in its canonical unit. Raises `InputError` for a unit of another quantity."""
    if name == "run":
        return values
    return convert(values, unit, COLUMNS[name], name, where)


def convert(values: Array, unit: str, target: str, name: str, where: str) -> Array:
    """Values (n,) of the quantity `name` from a unit into a target unit. Raises `InputError` for another quantity.

    >>> convert(np.array([1.0]), "Nm", "N.m", "torque", "record.csv")
    array([1.])
    >>> convert(np.array([4096.0]), "rev/4096", "rad", "twist", "record.csv").round(6)
    array([6.283185])
    """
    if unit == target or plain_unit(unit, target) == plain_unit(target, target):
        return values  # without the library of units, which takes a second to load
    expected = f"{where}: expected a unit of {name} such as [{target}], got [{unit}]"
    if (remark := _AMBIGUOUS.get(unit.strip())) is not None:
        raise InputError(f"{expected}, {remark}")
    text = plain_unit(unit, target)
    try:
        with np.errstate(over="ignore"):  # an overflow gives infinity, which the range check refuses
            return _converted(values, text, plain_unit(target, target))
    except Exception:  # pint parses the unit as an expression, which can raise any error
        remark = ""
        if target == COLUMNS["output_torque"] and quantity_of(unit) == "motor_current":
            remark = ", which is a current: map it to motor_current, with torque_constant and ratio"
        raise InputError(expected + remark) from None


def quantity_of(unit: str) -> str | None:
    """The first canonical column that takes a unit, or None.

    >>> quantity_of("deg"), quantity_of("mNm"), quantity_of("mA"), quantity_of("one")
    ('twist', 'output_torque', 'motor_current', None)
    """
    for name in ("time", "twist", "output_torque", "motor_current", "temperature"):
        target = COLUMNS[name]
        try:
            _converted(np.ones(1), plain_unit(unit, target), plain_unit(target, target))
        except Exception:  # as in `convert`
            continue
        return name
    return None


def _converted(values: Array, text: str, target: str) -> Array:
    powers = re.sub(_POWER, "", text)
    expect("**" not in powers and "^" not in powers, "powers of a digit", text, "unit")
    registry = _registry()
    one = registry.parse_expression(text)
    # Angles have no dimension in this library, so that it would take percent for an angle.
    if not hasattr(one, "units") or str(one.units) in _PURE_NUMBERS:
        raise InputError("no unit")
    magnitude = float(one.magnitude)
    if not math.isfinite(magnitude):
        raise InputError("no scale")
    # A scale such as in rev/4096 belongs to the numbers; a unit with an offset, such as degC, has none.
    scaled = values if magnitude == 1.0 else values * magnitude
    return np.asarray(registry.Quantity(scaled, one.units).to(registry.Unit(target)).magnitude, float)


def parse_constant(value: object, unit: str, where: str) -> float:
    """A finite constant in `unit`, from a number in this unit or a text with a unit of its own, such as "95 mN.m/A".

    >>> parse_constant("95 mN.m/A", "N.m/A", "torque_constant"), parse_constant("-29", "", "ratio")
    (0.095, -29.0)
    """
    example = f"a number or a text with its unit, such as '1 {unit}'" if unit else "a number, such as -29"
    if isinstance(value, int | float) and not isinstance(value, bool):
        expect(math.isfinite(value), example, value, where)
        return float(value)
    match = _CONSTANT.fullmatch(value) if isinstance(value, str) else None
    if match is None or (match[2] == "") != (unit == ""):
        raise InputError(f"{where}: expected {example}, got {value!r}")
    if unit == "":
        return float(match[1])
    found = float(convert(np.array([float(match[1])]), match[2], unit, where.rpartition(": ")[2], where)[0])
    expect(math.isfinite(found), example, value, where)
    return found


def plain_unit(unit: str, target: str) -> str:
    """A unit in the form that the library of units reads.

    target: unit of the same quantity, which decides what an abbreviation means.

    >>> [plain_unit(text, "N.m") for text in ("Nm", "N·m", "N m", "mNm", "in-lb", "Ncm")]
    ['N*m', 'N*m', 'N*m', 'mN*m', 'lbf*inch', 'N*cm']
    >>> plain_unit("C", "degC"), plain_unit("'", "rad")
    ('degC', 'arcmin')
    """
    text = unicodedata.normalize("NFC", unit).strip()
    aliases = _ALIASES.get(_QUANTITIES.get(target, ""), {})
    if text in aliases:
        return aliases[text]
    text = text.translate(_SIGNS)
    if target.startswith("N.m"):
        text = _LENGTH_FIRST.sub(r"\2*\1", text)
        text = _TORQUE.sub(lambda m: f"{_FORCES.get(m[1], m[1])}*{'inch' if m[2] == 'in' else m[2]}", text)
    text = re.sub(r"(?<=[A-Za-z])([23])(?!\w)", r"^\1", text)
    # "N.m" is a product, but pint reads the point as the start of a number.
    return re.sub(r"(?<=[A-Za-z0-9])\.(?=[A-Za-z])", "*", text)
