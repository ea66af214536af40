"""A drive's main sizes and its parts, as tables that a notebook shows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..units import MICROMETRE, format_quantity
from .fields import PARTS

if TYPE_CHECKING:
    from .drive import Drive


def one_line(drive: Drive) -> str:
    """The drive in one line; `drive_to_dict` has every field.

    >>> from stiffness_model import load_drive
    >>> load_drive("workshop")
    Drive('workshop', 3 x 25 balls of 10 mm, 26 lobes, ratio -25)
    """
    return (
        f"Drive({drive.name!r}, {drive.eccentrics} x {drive.elements_per_row} {drive.element}s of "
        f"{format_quantity(2 * drive.element_radius, 'length')}, {drive.lobes} lobes, ratio {drive.ratio:g})"
    )


def main_sizes(drive: Drive) -> dict[str, object]:
    """The sizes that a designer asks for first, with their units, by name."""
    return {
        "ratio": f"{drive.ratio:+g}",
        "lobes": drive.lobes,
        "elements": f"{drive.elements} {drive.element}s on {drive.eccentrics} eccentrics",
        "element radius": format_quantity(drive.element_radius, "length"),
        "crank radius": format_quantity(drive.crank_radius, "length"),
        "eccentricity": format_quantity(drive.eccentricity, "length"),
        "max. twist": format_quantity(drive.max_twist, "angle"),
    }


def part_columns(drive: Drive) -> dict[str, list[str] | list[float]]:
    """Nominal size, tolerance and material of every part, columns by their headers."""
    tolerances = [drive.tolerances[part] for part in PARTS]
    materials = [drive.materials[part] for part in PARTS]
    return {
        "part": list(PARTS),
        "diameter [mm]": [1e3 * drive.size(part) for part in PARTS],
        "offset [um]": [tolerance.offset / MICROMETRE for tolerance in tolerances],
        "sigma [um]": [tolerance.sigma / MICROMETRE for tolerance in tolerances],
        "material": [material.name for material in materials],
        "youngs_modulus [GPa]": [material.youngs_modulus / 1e9 for material in materials],
    }
