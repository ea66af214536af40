"""Elastic materials of the drive's parts."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from ..errors import expect, expect_number, unknown_name


@dataclass(frozen=True)
class Material:
    """A linear elastic, isotropic material.

    youngs_modulus in Pa (positive), poisson_ratio in (-1, 0.5), density in kg/m3 (positive). allowable_pressure:
    greatest contact pressure, Pa, that it bears standing still, None where none is known;
    allowable_line_pressure: the same in line contacts (rollers) where it differs; allowable_source: the standard or
    data sheet that says so, needed with either.
    """

    name: str
    youngs_modulus: float
    poisson_ratio: float
    density: float
    allowable_pressure: float | None = None
    allowable_line_pressure: float | None = None
    allowable_source: str = ""

    def __post_init__(self) -> None:
        where = f"material {self.name!r}"
        expect(isinstance(self.name, str), "a text for the material's name", self.name, "material")
        for field, expected, low, high in (
            ("youngs_modulus", "a positive Young's modulus in Pa", 0, math.inf),
            ("poisson_ratio", "a Poisson's ratio between -1 and 0.5", -1, 0.5),
            ("density", "a positive density in kg/m3", 0, math.inf),
        ):
            number = expect_number(getattr(self, field), expected, where, low=low, high=high)
            object.__setattr__(self, field, number)
        stated = [f for f in ("allowable_pressure", "allowable_line_pressure") if getattr(self, f) is not None]
        for field in stated:
            number = expect_number(getattr(self, field), "a positive allowable pressure in Pa", where, low=0)
            object.__setattr__(self, field, number)
        sourced = isinstance(self.allowable_source, str) and (bool(self.allowable_source.strip()) or not stated)
        expect(
            sourced,
            "allowable_source, a text that says where the allowable pressure is from",
            self.allowable_source,
            where,
        )

    @property
    def compliance(self) -> float:
        """(1 - nu^2)/E in 1/Pa, the material's share in a contact's compliance (eq. 23).

        >>> f"{STEEL_100CR6.compliance:.3e}"
        '4.375e-12'
        """
        return (1 - self.poisson_ratio**2) / self.youngs_modulus

    def allowable(self, element: str) -> float | None:
        """Allowable pressure, Pa, against an element, "ball" or "roller"; None where none is known.

        >>> STEEL_100CR6.allowable("roller"), PLA.allowable("ball")
        (4000000000.0, None)
        """
        line = self.allowable_line_pressure if element == "roller" else None
        return self.allowable_pressure if line is None else line


STEEL_100CR6 = Material(
    "100Cr6",
    208e9,
    0.30,
    7810.0,
    allowable_pressure=4200e6,
    allowable_line_pressure=4000e6,
    allowable_source="ISO 76:2006, static load ratings: 4200 MPa for balls, 4000 MPa for rollers",
)
"""Hardened bearing steel: E and nu as in section IV of the paper (Schaeffler Technical Pocket Guide)."""
PLA = Material("PLA", 3e9, 0.33, 1240.0)
"""3D printed polylactide: E and nu as in section IV of the paper. No allowable pressure: no standard rates its
contacts, and what it bears depends on the print, the temperature and the time under load."""

MATERIALS = {m.name: m for m in (STEEL_100CR6, PLA)}


def find_material(name: str, own: dict[str, Material], where: str = "") -> Material:
    """The material of that name, from the drawing's own ones first."""
    known = {**MATERIALS, **own}
    if name not in known:
        raise unknown_name("material", name, known, where)
    return known[name]


def material_labels(materials: Iterable[Material]) -> dict[Material, str]:
    """What a drawing calls each material: its name, and a label of its own where two of them share one.

    >>> list(material_labels([Material("100Cr6", 104e9, 0.3, 7800.0), STEEL_100CR6]).values())
    ['100Cr6', '100Cr6 2']
    """
    labels: dict[Material, str] = {}
    # Those that come with the package first: a drawing has no table for them that could tell another label.
    for material in sorted(dict.fromkeys(materials), key=lambda m: MATERIALS.get(m.name) != m):
        label, number = material.name, 1
        while label in labels.values():
            number += 1
            label = f"{material.name} {number}"
        labels[material] = label
    return labels
