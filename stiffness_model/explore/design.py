"""From the values of a design to its drive."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from ..drawing_file import drive_from_dict
from ..drive import Drive
from .parameters import COUNTS, FILL, Value

BESIDE, SEATS = "beside", "seats"
PACKING = (BESIDE, SEATS)
"""When the elements of a row fit. beside: spread evenly, side by side (`Drive.most_per_row`). seats: on the seats
that the gear allows, |i| to a turn: where balls are thicker than the seats are apart, every k-th seat stays."""


def base_fields(table: Mapping[str, Any], where: str) -> Drive:
    """The base drawing as a drive; raises `InputError`."""
    return drive_from_dict(table, where)


def design_drive(table: Mapping[str, Any], values: Mapping[str, Value], packs: str, where: str,
                 check: bool = True) -> Drive:
    """The base drawing `table` with `values` in it; lobes bring their ratio, rows their elements.

    A base drive that reverses (lobes above the ratio) stays one that reverses. Raises `InputError` where no
    drive comes of it. check=False: for trying single names, which need not make a whole design.

    >>> from stiffness_model.drawing_file import read_table
    >>> table, _ = read_table("drive_1")
    >>> drive = design_drive(table, {"lobes": 25, "elements_per_row": "fill", "eccentrics": 2}, "beside", "")
    >>> drive.ratio, drive.elements, drive.elements_per_row
    (-24, 42, 21)
    """
    geometry = table["geometry"]
    lobes = values.get("lobes", geometry["lobes"])
    rows = values.get("eccentrics", geometry.get("eccentrics", 1))
    per_row = values.get("elements_per_row", geometry["elements"] // geometry.get("eccentrics", 1))
    assert isinstance(lobes, int) and isinstance(rows, int)
    ratio = lobes - (geometry["lobes"] - geometry["transmission_ratio"])
    # One element a row until the sizes are read and say how many fit.
    first = rows if per_row == FILL else rows * int(per_row)
    plain = {name: value for name, value in values.items() if name not in COUNTS}
    drive = drive_from_dict(table, where, **plain, lobes=lobes, eccentrics=rows, transmission_ratio=ratio,
                            elements=first)
    return replace(drive, elements=rows * most_per_row(drive, packs)) if per_row == FILL and check else drive


def most_per_row(drive: Drive, packs: str) -> int:
    """The most elements that a row of the drive takes, by the rule of `PACKING`; no more than |i|.

    The seats: with the crank at any angle, an element at the angle t of the cage stands on the path if
    i t = 0 (mod 2 pi), so seats are 2 pi/|i| apart. (The model spreads a row's elements evenly, eq. 20.)

    >>> from stiffness_model import load_drive
    >>> [most_per_row(load_drive("drive_1"), rule) for rule in PACKING]
    [21, 14]
    """
    seats = int(drive.transmission_ratio)
    if packs != SEATS:
        return max(1, min(seats, drive.most_per_row))
    # Half the angle that an element takes up, in seats.
    apart = math.asin(drive.element_radius / drive.path.centre_distance) / (math.pi / seats)
    return max(1, seats // max(1, math.ceil(apart - 1e-12)))


def packs_well(drive: Drive, packs: str) -> bool:
    """Whether the rows take their elements; always so without a rule."""
    return packs == "" or drive.elements_per_row <= most_per_row(drive, packs)
