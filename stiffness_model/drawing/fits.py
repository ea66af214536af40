"""Tolerance zones as a workshop writes them: a fit ("14 H7"), limits ("0/-15 um") or a width ("13 um", "IT5").

A fit and limits state the position of the zone and so the mean offset of a radius too; a width or a grade is centred on
the nominal size, as the paper takes every window. Fundamental deviations after ISO 286-1:2010, tables 2 to 5.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from ..errors import InputError, expect, unknown_name
from ..units import MICROMETRE, UNITS, format_quantity
from .tolerances import ISO_286_SIZES, SIZE_ROUNDING, Tolerance, iso_286, read_offset, read_window

# ISO 286-1:2010, tables 4 and 5: fundamental deviations of shafts, um, over the steps of `ISO_286_SIZES`: upper limit
# es for d to h, lower limit ei for k to p. Tables 2 and 3 for holes follow from them (`_hole`).
_SHAFTS: dict[str, tuple[float, ...]] = {
    "d": (-20, -30, -40, -50, -65, -80, -100, -120, -145, -170, -190, -210, -230),
    "e": (-14, -20, -25, -32, -40, -50, -60, -72, -85, -100, -110, -125, -135),
    "f": (-6, -10, -13, -16, -20, -25, -30, -36, -43, -50, -56, -62, -68),
    "g": (-2, -4, -5, -6, -7, -9, -10, -12, -14, -15, -17, -18, -20),
    "h": (0,) * 13,
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
}
_UPPER = "defgh"
"""Letters of shafts below the nominal size, whose tabulated deviation is the upper limit es."""
LETTERS = (*_SHAFTS, "js")
"""Letters of shafts; those of holes are the same in capitals."""

_FIT = re.compile(r"(?:(?P<size>\d+(?:\.\d+)?) ?(?:mm)? )?(?P<letter>[A-Za-z]{1,2}) ?(?P<grade>\d{1,2})")
_LIMITS = re.compile(r"(?P<one>[+-]?\d+(?:\.\d+)?) ?/ ?(?P<two>[+-]?\d+(?:\.\d+)?) ?(?P<unit>\S+)")


@dataclass(frozen=True)
class ToleranceZone:
    """Tolerance zone of a diameter. window: width, m; offset: mean deviation of the *radius*, m, None if not stated."""

    window: float
    offset: float | None = None


def lower_limit_deviation(letter: str, grade: int, size: float, where: str = "tolerance") -> float:
    """Lower limit deviation of a diameter with the fit `letter` and `grade` at a nominal `size` in m, m.

    A capital letter stands for a hole. Raises `InputError` for letters and grades that are not in the tables.

    >>> [round(1e6 * lower_limit_deviation(letter, 7, 14e-3)) for letter in ("H", "h", "K", "p")]
    [0, -18, -12, 18]
    """
    width = iso_286(grade, size, where) / MICROMETRE
    small = letter.lower()
    if small not in LETTERS or letter not in (small, small.upper()):
        raise unknown_name("fit", letter, (*LETTERS, *(name.upper() for name in LETTERS)), where)
    if small == "js":
        return -width / 2 * MICROMETRE
    row = next(i for i, limit in enumerate(ISO_286_SIZES[1:]) if size * 1e3 <= limit * SIZE_ROUNDING)
    low = _shaft(small, grade, width, row) if letter == small else _hole(small, grade, width, size, row, where)
    return low * MICROMETRE


def _shaft(letter: str, grade: int, width: float, row: int) -> float:
    if letter in _UPPER:
        return _SHAFTS[letter][row] - width
    # Table 5: k has a deviation in the grades 4 to 7 only.
    return 0.0 if letter == "k" and not 4 <= grade <= 7 else _SHAFTS[letter][row]


def _hole(letter: str, grade: int, width: float, size: float, row: int, where: str) -> float:
    deviation = _SHAFTS[letter][row]
    if letter in _UPPER:
        return -deviation
    # Table 3: up to IT8 (P: IT7) the upper limit is raised by the difference to the next finer grade.
    if grade > (7 if letter == "p" else 8):
        expect(letter != "k" or row == 0, "K up to IT8, as ISO 286-1's table 3 has it", f"K{grade}", where)
        return (0.0 if letter == "n" and row else -deviation) - width
    name = letter.upper()
    expect(grade >= 3, f"{name} from IT3 on, as ISO 286-1's table 3 has it", f"{name}{grade}", where)
    raised = 0.0 if row == 0 else width - iso_286(grade - 1, size, where) / MICROMETRE
    # A note of table 3: M6 above 250 and up to 315 mm has -9 um instead of -11.
    upper = -9.0 if (letter, grade, row) == ("m", 6, 10) else raised - deviation
    return upper - width


def read_zone(value: object, size: float, hole: bool, where: str) -> ToleranceZone:
    """The tolerance zone of a diameter from a drawing's text, for the nominal `size`, m, of a hole or of a shaft.

    "14 H7" or "H7": a fit of ISO 286; "0/-15 um", "+21/0 um": limits; "ISO 492 Normal": 0/-w, a bearing's outer ring.
    "IT5", "13 um", "ISO 3290 G10" or a number in m state only the width ("G10" is the fit of a hole, but the grade of
    a ball). Raises `InputError`, also for a fit of another size than the part's and for a shaft's letter on a hole.

    >>> zone = read_zone("14 H7", 14e-3, True, "cage_tolerance")
    >>> f"{1e6 * zone.window:g} um, mean radius {1e6 * zone.offset:+g} um"
    '18 um, mean radius +4.5 um'
    >>> read_zone("0/-13 um", 80e-3, False, "crank_tolerance").offset
    -3.25e-06
    >>> read_zone("IT5", 96e-3, True, "gear_tolerance").offset is None
    True
    """
    if not isinstance(value, str):
        return ToleranceZone(read_window(value, size, where))
    text = " ".join(value.split())
    if match := _LIMITS.fullmatch(text):
        return _limits(match, where)
    match = _FIT.fullmatch(text)
    ball_grade = match is not None and match["letter"] == "G" and match["size"] is None and not hole
    if match and match["letter"] != "IT" and not ball_grade:
        return _fit(match, size, hole, value, where)
    window = read_window(value, size, where)
    return ToleranceZone(window, -window / 4 if text.upper().startswith("ISO 492") else None)


def _limits(match: re.Match[str], where: str) -> ToleranceZone:
    if match["unit"] not in UNITS["length"]:
        raise unknown_name("unit of length", match["unit"], UNITS["length"], where)
    high, low = sorted((float(match["one"]), float(match["two"])), reverse=True)
    unit = UNITS["length"][match["unit"]]
    return ToleranceZone((high - low) * unit, (high + low) / 4 * unit)


def _fit(match: re.Match[str], size: float, hole: bool, value: str, where: str) -> ToleranceZone:
    letter, grade = match["letter"], int(match["grade"])
    low = lower_limit_deviation(letter, grade, size, where)
    expect(
        hole == letter.isupper(),
        "a hole's fit in a capital letter, such as 'H7'" if hole else "a shaft's fit in a small letter, such as 'h6'",
        value,
        where,
    )
    if match["size"] is not None and abs(float(match["size"]) * 1e-3 - size) > 1e-9 * size:
        raise InputError(
            f"{where}: expected a fit for the drawn {format_quantity(size, 'length')}, such as "
            f"'{1e3 * size:.6g} {letter}{grade}' or '{letter}{grade}', got {value!r}"
        )
    window = iso_286(grade, size, where)
    return ToleranceZone(window, (low + window / 2) / 2)


def tolerance_from_zone(
    zone: ToleranceZone, offset: object, value: object, where: str, default: float = 0.0
) -> Tolerance:
    """The tolerance of a radius from its zone and the offset stated beside it.

    value: what the drawing wrote for the zone; offset: m or a text as `read_offset` takes it, None if not stated;
    default: m, if neither states one; where: "FILE: PART". Raises `InputError` if the zone and `offset` state
    different offsets.

    >>> tolerance_from_zone(ToleranceZone(18e-6), "3 sigma", "IT7", "drawing: cage").offset
    4.5e-06
    """
    text = value if isinstance(value, str) else ""
    stated = None if offset is None else read_offset(offset, Tolerance(zone.window).sigma, f"{where}_offset")
    if zone.offset is None:
        return Tolerance(zone.window, default if stated is None else stated, text)
    if stated is not None and abs(stated - zone.offset) > 1e-12:
        raise InputError(
            f"{where}_offset: expected none beside the tolerance {value!r}, which puts the mean radius "
            f"{_signed(zone.offset)} off, got {offset!r}; leave it out, or give the width alone, "
            f"{format_quantity(zone.window, 'length')!r}, with the offset"
        )
    return Tolerance(zone.window, zone.offset, text)


def zone_text(tolerance: Tolerance, size: float, hole: bool) -> tuple[str, bool]:
    """The tolerance zone as a drawing writes it, and whether that states the offset too.

    It is the text that the tolerance was read from, if that still means the same at this nominal size, m; else the
    width.

    >>> drawn = Tolerance(iso_286(5, 10e-3), 0.0, "IT5")
    >>> zone_text(drawn, 10e-3, True), zone_text(drawn, 96e-3, True)
    (('IT5', False), ('6 um', False))
    """
    if tolerance.text:
        try:
            zone = read_zone(tolerance.text, size, hole, "tolerance")
        except InputError:
            zone = None
        if zone is not None and zone.window == tolerance.window and zone.offset in (None, tolerance.offset):
            return tolerance.text, zone.offset is not None
    return format_quantity(tolerance.window, "length"), False


def _signed(length: float) -> str:
    return ("+" if length > 0 else "") + format_quantity(length, "length")
