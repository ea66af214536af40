"""Elastic materials of the drive's parts."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Annotated

from ..errors import expect, unknown_name
from .fields import NUMBER, TEXT, Field, check_attributes, number_between, optional, positive

MATERIAL_TABLE = "material.NAME"
"""The TOML tables in which a drawing states materials of its own."""


_PRESSURE = optional(positive("a positive allowable pressure in Pa"))


@dataclass(frozen=True)
class Material:
    """A linear elastic, isotropic material; a `Field` beside each attribute states its meaning. SI.

    Raises `InputError`, also for an allowable pressure without its source.
    """

    name: Annotated[
        str, Field(TEXT, MATERIAL_TABLE, "Name of the material; by default that of its table.", "POM", default="")
    ]
    youngs_modulus: Annotated[
        float,
        Field("pressure", MATERIAL_TABLE, "Young's modulus.", "208 GPa", positive("a positive Young's modulus in Pa")),
    ]
    poisson_ratio: Annotated[
        float,
        Field(
            NUMBER,
            MATERIAL_TABLE,
            "Poisson's ratio.",
            "0.3",
            number_between(-1.0, 0.5, "a Poisson's ratio between -1 and 0.5"),
        ),
    ]
    density: Annotated[
        float,
        Field(
            "density",
            MATERIAL_TABLE,
            "Density, for the elements' forces of inertia.",
            "7810 kg/m3",
            positive("a positive density in kg/m3"),
            default=7800.0,
        ),
    ]
    allowable_pressure: Annotated[
        float | None,
        Field(
            "pressure",
            MATERIAL_TABLE,
            "Greatest contact pressure that the material bears at standstill.",
            "90 MPa",
            _PRESSURE,
        ),
    ] = None
    allowable_line_pressure: Annotated[
        float | None,
        Field(
            "pressure", MATERIAL_TABLE, "The same in line contacts (rollers), where it differs.", "90 MPa", _PRESSURE
        ),
    ] = None
    allowable_source: Annotated[
        str,
        Field(
            TEXT,
            MATERIAL_TABLE,
            "Standard or data sheet that states the allowable pressure; needed with either.",
            "ISO 76",
        ),
    ] = ""

    def __post_init__(self) -> None:
        check_attributes(self, Material, f"material {self.name!r}")
        stated = self.allowable_pressure is not None or self.allowable_line_pressure is not None
        expect(
            not stated or bool(self.allowable_source.strip()),
            "allowable_source, a text that says where the allowable pressure is from",
            self.allowable_source,
            f"material {self.name!r}",
        )

    @property
    def compliance(self) -> float:
        """(1 - nu^2)/E, 1/Pa: the material's part of a contact's compliance (eq. 23).

        >>> f"{STEEL_100CR6.compliance:.3e}"
        '4.375e-12'
        """
        return (1 - self.poisson_ratio**2) / self.youngs_modulus

    def allowable(self, element: str) -> float | None:
        """Allowable pressure, Pa, against an element, "ball" or "roller"; None if unknown.

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
"""3D printed polylactide: E and nu as in section IV of the paper. No allowable pressure is stated, for no standard
rates its contacts, and its strength depends on the print, the temperature and the time under load."""

MATERIALS = {m.name: m for m in (STEEL_100CR6, PLA)}


def find_material(name: str, own: Mapping[str, Material], where: str = "") -> Material:
    """The material of that name; `own` materials of the drawing take precedence. Raises `UnknownNameError`."""
    known = {**MATERIALS, **own}
    if name not in known:
        raise unknown_name("material", name, known, where)
    return known[name]


def material_labels(materials: Iterable[Material]) -> dict[Material, str]:
    """Label of each material in a drawing: its name, with a number where two materials share one.

    >>> list(material_labels([Material("100Cr6", 104e9, 0.3, 7800.0), STEEL_100CR6]).values())
    ['100Cr6', '100Cr6 2']
    """
    labels: dict[Material, str] = {}
    # Materials of the package come first and keep their names, for no table of the drawing could state another label.
    for material in sorted(dict.fromkeys(materials), key=lambda m: MATERIALS.get(m.name) != m):
        label, number = material.name, 1
        while label in labels.values():
            number += 1
            label = f"{material.name} {number}"
        labels[material] = label
    return labels
