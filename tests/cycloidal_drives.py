"""A cycloidal drive for tests, close to the printed one."""

from __future__ import annotations

from typing import Any

from stiffness_model.cycloidal.cycloidal_drive import CycloidalDrive
from stiffness_model.drawing.material_library import STEEL_100CR6
from stiffness_model.drawing.materials import Material

POLYMER = Material("polymer", 2e9, 0.35, 1200.0)
TOLERANCES = {
    "pin_tolerance": 40e-6,
    "pin_position_tolerance": 60e-6,
    "profile_tolerance": 60e-6,
    "roller_tolerance": 10e-6,
    "roller_position_tolerance": 40e-6,
    "hole_tolerance": 60e-6,
    "hole_position_tolerance": 60e-6,
}


def cycloidal(**fields: Any) -> CycloidalDrive:
    """A drive with 14 pins and 8 rollers, without clearances and tolerances unless `fields` state them."""
    values: dict[str, Any] = {
        "name": "tested",
        "pins": 14,
        "pin_radius": 3.5e-3,
        "pin_circle_radius": 34e-3,
        "eccentricity": 1.5e-3,
        "disc_thickness": 25e-3,
        "output_rollers": 8,
        "roller_radius": 4.5e-3,
        "roller_circle_radius": 20e-3,
        "materials": {"disc": POLYMER, "ring": POLYMER, "roller": STEEL_100CR6},
        "max_twist": 20e-3,
    }
    return CycloidalDrive(**{**values, **fields})
