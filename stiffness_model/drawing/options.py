"""What a drawing switches on beyond the paper's contact model. The defaults switch everything off.

Quantities are SI inside (N/m, N.m/rad, rad/s, Pa, N); a drawing writes them with their units.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any

from .fields import CHOICE, NUMBER, Field, check_attributes, fields_of, number_between

RIGID = "rigid"
"""How a drawing writes an infinite stiffness."""
_FRICTION = number_between(-math.ulp(0.0), 1.0, "a coefficient of friction from 0 to below 1")
_PRESSURE_LIMIT = (
    "Greatest allowable pressure at the {}; 0: that of the materials in contact (`ratings.static_safety`)."
)


@dataclass(frozen=True)
class ModelOptions:
    """What a drawing switches on beyond the paper's model; the `Field` beside each attribute states its meaning.

    SI; `math.inf` for rigid bodies, 0 for a limit, speed or rating that is not stated. Raises `InputError`.
    """

    bearing_stiffness: Annotated[
        float,
        Field("stiffness", "bodies", "Radial stiffness of each eccentric's bearing.", "250 N/um", infinite=RIGID),
    ] = math.inf
    cage_wall_stiffness: Annotated[
        float, Field("stiffness", "bodies", "Stiffness of the wall beside each bore.", "100 N/um", infinite=RIGID)
    ] = math.inf
    ring_stiffness: Annotated[
        float,
        Field(
            "stiffness",
            "bodies",
            "Stiffness of the gear ring under each element, along the contact's normal.",
            "500 N/um",
            infinite=RIGID,
        ),
    ] = math.inf
    housing_stiffness: Annotated[
        float,
        Field(
            "torsional stiffness",
            "bodies",
            "Torsional stiffness, at the output, of all that lies between contacts and flanges.",
            "200 N.m/arcmin",
            infinite=RIGID,
        ),
    ] = math.inf
    gear_contact: Annotated[
        str,
        Field(
            CHOICE,
            "contacts",
            'Contact with the gear: "linear", the paper\'s fixed normal (eq. 8), or "exact", the true profile.',
            choices=("linear", "exact"),
        ),
    ] = "linear"
    cage_contact: Annotated[
        str,
        Field(
            CHOICE,
            "contacts",
            'Contact with the bore: "hertz", capped, or "lamina", conforming (`elasticity.conformal`).',
            choices=("hertz", "lamina"),
        ),
    ] = "hertz"
    inertia: Annotated[
        str,
        Field(
            CHOICE,
            "contacts",
            "Whether the inertia of the orbiting elements acts at the crank's speed (`contact.inertia`).",
            choices=("off", "on"),
        ),
    ] = "off"
    crank_speed: Annotated[
        float,
        Field(
            "speed",
            "operation",
            "Speed of the crank, for forces of inertia and for lives in hours.",
            "3000 rpm",
        ),
    ] = 0.0
    friction_coefficient: Annotated[
        float,
        Field(
            NUMBER,
            "contacts",
            "Coefficient of friction of the contacts, for losses (`ratings.efficiency`, `crank_friction`).",
            "0.05",
            _FRICTION,
        ),
    ] = 0.0
    gear_pressure_limit: Annotated[
        float,
        Field(
            "pressure",
            "contacts",
            _PRESSURE_LIMIT.format("gear"),
            "4.2 GPa",
        ),
    ] = 0.0
    crank_pressure_limit: Annotated[
        float,
        Field(
            "pressure",
            "contacts",
            _PRESSURE_LIMIT.format("crank"),
            "4.2 GPa",
        ),
    ] = 0.0
    cage_pressure_limit: Annotated[
        float,
        Field(
            "pressure",
            "contacts",
            _PRESSURE_LIMIT.format("cage"),
            "4.2 GPa",
        ),
    ] = 0.0
    bearing_capacity: Annotated[
        float,
        Field(
            "force",
            "bodies",
            "Dynamic load rating C of each crank bearing; 0: unknown, and no life is computed.",
            "30 kN",
        ),
    ] = 0.0
    bearing_type: Annotated[
        str,
        Field(CHOICE, "bodies", "Type of the crank bearings (`ratings.bearing_life`).", choices=("ball", "roller")),
    ] = "ball"

    def __post_init__(self) -> None:
        check_attributes(self, ModelOptions, "")

    @property
    def is_plain(self) -> bool:
        """Whether the equilibrium is that of the paper's model."""
        return (
            self.gear_contact == "linear"
            and self.cage_contact == "hertz"
            and not self.has_inertia_forces
            and all(getattr(self, name) == math.inf for name in STIFFNESSES)
        )

    @property
    def has_inertia_forces(self) -> bool:
        """Whether forces of inertia act on the elements."""
        return self.inertia == "on" and self.crank_speed > 0

    @property
    def couples_elements(self) -> bool:
        """Whether the elements of a drive interact, so that only whole drives have an equilibrium."""
        return math.isfinite(self.bearing_stiffness) or math.isfinite(self.housing_stiffness)


STIFFNESSES = tuple(name for name, field in fields_of(ModelOptions).items() if field.infinite)
"""Names of the stiffnesses of bodies that are rigid by default."""


def write_options(options: ModelOptions) -> dict[str, Any]:
    """The fields that differ from their defaults, by name, as a drawing writes them.

    >>> write_options(ModelOptions(bearing_stiffness=250e6, inertia="on"))
    {'bearing_stiffness': '250 N/um', 'inertia': 'on'}
    """
    values = {name: (field, getattr(options, name)) for name, field in fields_of(ModelOptions).items()}
    return {name: field.write(value) for name, (field, value) in values.items() if value != field.default}
