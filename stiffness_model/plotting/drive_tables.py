"""A drive's main sizes and its parts, as tables that a notebook shows."""

from __future__ import annotations

from ..drawing.drive import Drive
from ..drawing.fields import PARTS
from ..units import MICROMETRE, format_quantity


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
