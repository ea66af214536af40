"""Elastic materials of the drive's parts."""

from __future__ import annotations

from dataclasses import dataclass

from .errors import expect_number, unknown_name


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
        expect_number(self.youngs_modulus, "a positive Young's modulus in Pa", where, low=0)
        expect_number(self.poisson_ratio, "a Poisson's ratio between -1 and 0.5", where, low=-1, high=0.5)
        expect_number(self.density, "a positive density in kg/m3", where, low=0)

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
