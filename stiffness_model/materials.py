"""Elastic materials of the drive's parts."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

from .errors import expect, expect_number, unknown_name


@dataclass(frozen=True)
class Material:
    """A linear elastic, isotropic material.

    youngs_modulus in Pa (positive), poisson_ratio in (-1, 0.5), density in kg/m3 (positive).
    """

    name: str
    youngs_modulus: float
    poisson_ratio: float
    density: float

    def __post_init__(self) -> None:
        where = f"material {self.name!r}"
        expect(isinstance(self.name, str), "a text for the material's name", self.name, "material")
        for field, expected, low, high in (("youngs_modulus", "a positive Young's modulus in Pa", 0, math.inf),
                                           ("poisson_ratio", "a Poisson's ratio between -1 and 0.5", -1, 0.5),
                                           ("density", "a positive density in kg/m3", 0, math.inf)):
            number = expect_number(getattr(self, field), expected, where, low=low, high=high)
            object.__setattr__(self, field, number)

    @property
    def compliance(self) -> float:
        """(1 - nu^2)/E in 1/Pa, the material's share in a contact's compliance (eq. 23).

        >>> f"{STEEL_100CR6.compliance:.3e}"
        '4.375e-12'
        """
        return (1 - self.poisson_ratio**2) / self.youngs_modulus


STEEL_100CR6 = Material("100Cr6", 208e9, 0.30, 7810.0)
"""Hardened bearing steel: E and nu as in section IV of the paper (Schaeffler Technical Pocket Guide)."""
PLA = Material("PLA", 3e9, 0.33, 1240.0)
"""3D printed polylactide: E and nu as in section IV of the paper."""

MATERIALS = {m.name: m for m in (STEEL_100CR6, PLA)}


def find_material(name: str, own: dict[str, Material], where: str = "") -> Material:
    """The material of that name, from the drawing's own ones first."""
    known = {**MATERIALS, **own}
    if name not in known:
        raise unknown_name("material", name, known, where)
    return known[name]


def labelled(materials: Iterable[Material]) -> dict[Material, str]:
    """What a drawing calls each material: its name, and a label of its own where two of them share one.

    >>> list(labelled([Material("100Cr6", 104e9, 0.3, 7800.0), STEEL_100CR6]).values())
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
