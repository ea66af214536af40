"""Elastic materials of the drive's parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from ..errors import expect
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
    description: Annotated[
        str, Field(TEXT, MATERIAL_TABLE, "What the material is, in a few words.", "bronze, cast", default="")
    ] = ""
    source: Annotated[
        str, Field(TEXT, MATERIAL_TABLE, "Standard, handbook or data sheet of the other values.", "EN 1561", default="")
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

        >>> f"{Material('100Cr6', 208e9, 0.30, 7810.0).compliance:.3e}"
        '4.375e-12'
        """
        return (1 - self.poisson_ratio**2) / self.youngs_modulus

    def allowable(self, element: str) -> float | None:
        """Allowable pressure, Pa, against an element, "ball" or "roller"; None if unknown.

        >>> Material("PLA", 3e9, 0.33, 1240.0).allowable("ball") is None
        True
        """
        line = self.allowable_line_pressure if element == "roller" else None
        return self.allowable_pressure if line is None else line
