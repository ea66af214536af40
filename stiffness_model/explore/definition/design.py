"""From the parameter values of a design to its drive, and how many elements fit in a row."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from typing import Any

from ...drawing.drive import Drive
from ...drawing.fields import COUNT, fields_of
from ...errors import InputError
from ...geometry.ball_path import max_elements_on_circle
from ...io.ree_drawing import read_drawing
from ...kinds import SCALE_PICTURES, kind_of_table
from .parameters import FIELDS, FILL, Value

BESIDE, SEATS = "beside", "seats"
PACKING = (BESIDE, SEATS)


@dataclass(frozen=True)
class Packing:
    """The condition for the elements of a row to fit.

    rule: "beside": evenly spaced, side by side (`max_elements_on_circle`); "seats": at the places that the gear
    allows, |i| per turn, or at every k-th where elements are wider than the places are apart (`seats.Seats`); "": no
    condition, they may overlap. web: least wall of the cage between two elements, m.
    """

    rule: str = ""
    web: float = 0.0

    def most_per_row(self, drive: Drive) -> int:
        """The greatest number of elements that fit in a row of the drive, at least 1 and at most |i|.

        >>> from stiffness_model import load_drive
        >>> [Packing(rule).most_per_row(load_drive("drive_1")) for rule in PACKING]
        [21, 14]
        """
        if self.rule == SEATS:
            return drive.seats.max_elements(self.web)
        return max(
            1,
            min(
                drive.seats.seats,
                max_elements_on_circle(drive.path.centre_distance, drive.element_radius + self.web / 2),
            ),
        )

    def fits(self, drive: Drive) -> bool:
        """Whether the elements fit in their rows; always so without a rule."""
        return self.rule == "" or drive.elements_per_row <= self.most_per_row(drive)


_KNOWN = {field.attribute for field in fields_of(Drive).values()} | {"where"}
"""Attributes of a drive that a study's sweep takes into account."""


def base_drive(table: Mapping[str, Any], where: str) -> Drive:
    """The base drawing as a drive. Raises `InputError`, also for physics that `sweep.sweep` leaves out."""
    kind = kind_of_table(table, where)
    if SCALE_PICTURES in kind.lacks:
        raise InputError(f"{where}: {kind.noun} is without {SCALE_PICTURES}: {kind.lacks[SCALE_PICTURES]}")
    drive = read_drawing(table, where)
    require_plain_model(drive, where)
    return drive


def require_plain_model(drive: Drive, where: str) -> None:
    """Raise `InputError` if the drive switches on more than the plain contact model.

    An attribute that the sweep does not take into account must have its default, or state by `is_plain` that it has
    no effect on the equilibrium. So a study never ignores silently what the drawing states.
    """
    for f in fields(drive):
        value = getattr(drive, f.name)
        if f.name not in _KNOWN and value != f.default and not getattr(value, "is_plain", False):
            raise InputError(
                f"{where}: expected a drawing of the plain contact model, the only one of design studies, got "
                f"{f.name} = {value!r}"
            )


def design_drive(
    table: Mapping[str, Any], values: Mapping[str, Value], packing: Packing, where: str, check: bool = True
) -> Drive:
    """The drive of the base drawing `table` with `values` for some of its fields.

    The ratio follows from the lobes, so that a base drive that reverses (lobes above the ratio) remains one; the
    elements follow from the rows. check=False: leave "fill" at one element a row, to check single values. Raises
    `InputError` if the values make no drive.

    >>> from stiffness_model.io.drawing_toml import read_table
    >>> table, _ = read_table("drive_1")
    >>> drive = design_drive(table, {"lobes": 25, "elements_per_row": "fill", "eccentrics": 2}, Packing("beside"), "")
    >>> drive.ratio, drive.elements, drive.elements_per_row
    (-24, 42, 21)
    """
    geometry = table["geometry"]
    lobes = values.get("lobes", geometry["lobes"])
    rows = values.get("eccentrics", geometry.get("eccentrics", 1))
    per_row = values.get("elements_per_row", geometry["elements"] // geometry.get("eccentrics", 1))
    assert isinstance(lobes, int)
    assert isinstance(rows, int)
    ratio = lobes - (geometry["lobes"] - geometry["transmission_ratio"])
    # One element in a row until the sizes are read, which determine how many fit.
    first = rows if per_row == FILL else rows * int(per_row)
    plain = {name: value for name, value in values.items() if FIELDS[name].quantity != COUNT}
    drive = read_drawing(table, where, **plain, lobes=lobes, eccentrics=rows, transmission_ratio=ratio, elements=first)
    return replace(drive, elements=rows * packing.most_per_row(drive)) if per_row == FILL and check else drive
