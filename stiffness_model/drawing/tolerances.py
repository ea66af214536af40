"""Tolerance windows of ISO 286, ISO 492 and ISO 3290, and the distribution of a radius that follows from them.

A window is the width of the tolerance zone of a *diameter*. Deviations of radii are normally distributed with the
limits at three standard deviations (section III of the paper), so sigma of the radius is window / 12.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, field

from ..errors import InputError, expect, expect_number
from ..units import MICROMETRE, parse_quantity

# ISO 286-1:2010, table 1. Nominal sizes above the first and up to and including the second, mm.
ISO_286_SIZES = (0, 3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
_ISO_286_UM: dict[int, tuple[float, ...]] = {
    1: (0.8, 1, 1, 1.2, 1.5, 1.5, 2, 2.5, 3.5, 4.5, 6, 7, 8),
    2: (1.2, 1.5, 1.5, 2, 2.5, 2.5, 3, 4, 5, 7, 8, 9, 10),
    3: (2, 2.5, 2.5, 3, 4, 4, 5, 6, 8, 10, 12, 13, 15),
    4: (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20),
    5: (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    6: (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    7: (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    8: (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    9: (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    10: (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    11: (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
    12: (100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630),
    13: (140, 180, 220, 270, 330, 390, 460, 540, 630, 720, 810, 890, 970),
    14: (250, 300, 360, 430, 520, 620, 740, 870, 1000, 1150, 1300, 1400, 1550),
    15: (400, 480, 580, 700, 840, 1000, 1200, 1400, 1600, 1850, 2100, 2300, 2500),
    16: (600, 750, 900, 1100, 1300, 1600, 1900, 2200, 2500, 2900, 3200, 3600, 4000),
}
SIZE_ROUNDING = 1 + 1e-12
"""Relative rounding error by which a size may exceed a step: 0.08 m belongs to the step that ends at 80 mm."""
# ISO 492, radial bearings, class Normal, outer ring: deviation of the mean outside diameter, width of the zone.
_ISO_492_SIZES = (6, 18, 30, 50, 80, 120, 150, 180, 250, 315, 400, 500)
_ISO_492_UM = (8, 9, 11, 13, 15, 18, 25, 30, 35, 40, 45)
# ISO 3290-1, balls: greatest lot diameter variation.
_ISO_3290_UM = {3: 0.13, 5: 0.25, 10: 0.5, 16: 0.8, 20: 1.0, 24: 1.2, 28: 1.4, 40: 2.0, 60: 3.0, 100: 5.0, 200: 10.0}

SIGMAS_IN_WINDOW = 6.0
"""Standard deviations of the diameter between the limits (section III of the paper: +-3 sigma)."""


@dataclass(frozen=True)
class Tolerance:
    """The deviation of a radius: normally distributed with standard deviation `sigma`, m, about `offset`, m.

    window: width of the diameter's tolerance zone, m; text: as the drawing wrote it. The text does not take part in
    comparisons, and `fits.zone_text` writes it only if it still means these numbers.
    """

    window: float
    offset: float = 0.0
    text: str = field(default="", compare=False)

    def __post_init__(self) -> None:
        window = expect_number(self.window, "a tolerance window that is not negative", "tolerance", low=-1e-300)
        object.__setattr__(self, "window", window)
        object.__setattr__(self, "offset", expect_number(self.offset, "a finite mean offset", "tolerance"))

    @property
    def sigma(self) -> float:
        """Standard deviation of the radius, m.

        >>> f"{1e6 * Tolerance(13e-6).sigma:.2f} um"
        '1.08 um'
        """
        return self.window / 2 / SIGMAS_IN_WINDOW


def diameters(element_radius: float, crank_radius: float) -> dict[str, float]:
    """Nominal diameters, m, of the parts' tolerances, from radii in m; the gear's is the elements' pitch circle.

    >>> diameters(7e-3, 41e-3)["gear"]
    0.096
    """
    return {
        "element": 2 * element_radius,
        "crank": 2 * crank_radius,
        "cage": 2 * element_radius,
        "gear": 2 * (crank_radius + element_radius),
    }


def iso_286(grade: int, size: float, where: str = "tolerance") -> float:
    """Window, m, of the ISO 286-1 grade IT`grade` (1 to 16) for a nominal size in m (up to 0.5).

    Raises `InputError` for other grades and sizes.

    >>> [round(1e6 * iso_286(g, 96e-3)) for g in (5, 9, 11)], [round(1e6 * iso_286(g, 14e-3)) for g in (4, 6, 13)]
    ([15, 87, 220], [5, 11, 270])
    """
    expect(grade in _ISO_286_UM, "an ISO 286 grade from IT1 to IT16", f"IT{grade}", where)
    return _step(ISO_286_SIZES, _ISO_286_UM[grade], size, "ISO 286", where)


def iso_492_normal(size: float, where: str = "tolerance") -> float:
    """Window, m, of the outside diameter of a bearing's outer ring, ISO 492 class Normal, for a size in m.

    Raises `InputError` for sizes beyond the table. The paper uses 13 um for its 82 mm, the step of 50 to 80 mm; the
    standard's step of 80 to 120 mm gives 15.

    >>> round(1e6 * iso_492_normal(82e-3)), round(1e6 * iso_492_normal(80e-3))
    (15, 13)
    """
    return _step(_ISO_492_SIZES, _ISO_492_UM, size, "ISO 492", where)


def iso_3290(grade: int, where: str = "tolerance") -> float:
    """Lot diameter variation, m, of ISO 3290-1 balls of grade G`grade`. Raises `InputError` for other grades.

    >>> f"{1e6 * iso_3290(10):.2f}"
    '0.50'
    """
    known = ", ".join(f"G{g}" for g in _ISO_3290_UM)
    expect(grade in _ISO_3290_UM, f"a ball grade of ISO 3290 ({known})", f"G{grade}", where)
    return _ISO_3290_UM[grade] * MICROMETRE


def _step(sizes: tuple[float, ...], widths: tuple[float, ...], size: float, standard: str, where: str) -> float:
    size_mm = size * 1e3
    if not sizes[0] < size_mm <= sizes[-1] * SIZE_ROUNDING:
        raise InputError(
            f"{where}: expected a nominal size in {standard}'s range, above {sizes[0]} and up to "
            f"{sizes[-1]} mm, got {size_mm:g} mm"
        )
    row = next(i for i, limit in enumerate(sizes[1:]) if size_mm <= limit * SIZE_ROUNDING)
    return widths[row] * MICROMETRE


def read_window(value: object, size: float, where: str) -> float:
    """Window, m, from a drawing's text: a width ("13 um"), or a grade for the nominal `size` in m. Raises `InputError`.

    >>> [f"{1e6 * read_window(t, 14e-3, 'cage'):.3g}" for t in ("13 um", "IT4", "ISO 492 Normal", "ISO 3290 G10")]
    ['13', '5', '8', '0.5']
    """
    if isinstance(value, str):
        text = " ".join(value.split())
        if match := re.fullmatch(r"(?:ISO 286 )?IT ?(\d+)", text):
            return iso_286(int(match[1]), size, where)
        if re.fullmatch(r"ISO 492(?: Normal)?", text, re.IGNORECASE):
            return iso_492_normal(size, where)
        if match := re.fullmatch(r"(?:ISO 3290 )?G(\d+)", text):
            return iso_3290(int(match[1]), where)
        if not text[:1].isdigit() and text[:1] not in "+-.":
            raise InputError(
                f"{where}: expected a diameter window such as '13 um', a grade such as 'IT5', "
                "'ISO 492 Normal' or 'ISO 3290 G10', a fit such as 'H7' or limits such as '0/-15 um', "
                f"got {value!r}"
            )
    return expect_number(parse_quantity(value, "length", where), "a window that is not negative", where, low=-1e-300)


def read_offset(value: object, sigma: float, where: str) -> float:
    """Mean deviation of a radius, m, from "5 um" or from "3 sigma", with the `sigma`, m, of the same radius.

    Raises `InputError`.

    >>> f"{1e6 * read_offset('3 sigma', 0.4e-6, 'cage_offset'):.1f}"
    '1.2'
    """
    if isinstance(value, str) and value.split()[1:] == ["sigma"]:
        try:
            return float(value.split()[0]) * sigma
        except ValueError:
            raise InputError(f"{where}: expected an offset such as '3 sigma' or '5 um', got {value!r}") from None
    return expect_number(parse_quantity(value, "length", where), "a finite offset", where)


def clearance_offset(window: float, element: Tolerance) -> float:
    """Mean offset, m, of the radius of bores with a `window`, m, which all but 0.13 % of the elements clear.

    The variance of the clearance is the sum of those of bore and element; its mean is three standard deviations.

    >>> f"{1e6 * clearance_offset(5e-6, Tolerance(0.5e-6)):.3f} um"
    '1.256 um'
    """
    return element.offset + SIGMAS_IN_WINDOW / 2 * math.hypot(Tolerance(window).sigma, element.sigma)
