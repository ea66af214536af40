"""The switches of a drawing: what is computed beyond the plain contact model. The defaults switch everything off.

Quantities are SI inside (N/m, N.m/rad, rad/s, Pa, N); a drawing writes them with their units, or "rigid" for a
stiffness without end.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

from ..errors import expect, expect_number, unknown_name
from ..units import format_quantity, parse_quantity

GEAR_CONTACTS = ("linear", "exact")
CAGE_CONTACTS = ("hertz", "lamina")
INERTIA = ("off", "on")
BEARING_TYPES = ("ball", "roller")
RIGID = "rigid"


@dataclass(frozen=True)
class ModelOptions:
    """What a drawing switches on beside the paper's model.

    bearing_stiffness: radial, of each eccentric's bearing, N/m; cage_wall_stiffness: of the wall beside each bore,
    N/m; ring_stiffness: of the gear ring under each element, along the contact's normal, N/m; housing_stiffness:
    torsional, of all that lies between contacts and flanges, N.m/rad at the output (`math.inf`: rigid).
    gear_contact: "linear" (the paper's fixed normal and indentation, eq. 8) or "exact" (`geometry.exact_profile`);
    cage_contact: "hertz" (capped) or "lamina" (`elasticity.conformal`); inertia: "on" for the forces on the elements at
    the crank_speed (`contact.inertia`). crank_speed: rad/s, for them and for lives in hours.
    friction_coefficient: of all contacts of the elements, for losses (`ratings.efficiency`); no part in the torque.
    gear_pressure_limit, crank_pressure_limit, cage_pressure_limit: Pa, 0 for that of the material
    (`ratings.static_safety`). bearing_capacity: dynamic load rating C of each crank bearing, N, 0 if unknown;
    bearing_type: "ball" or "roller" (`ratings.bearing_life`).
    """

    bearing_stiffness: float = math.inf
    cage_wall_stiffness: float = math.inf
    ring_stiffness: float = math.inf
    housing_stiffness: float = math.inf
    gear_contact: str = "linear"
    cage_contact: str = "hertz"
    inertia: str = "off"
    crank_speed: float = 0.0
    friction_coefficient: float = 0.0
    gear_pressure_limit: float = 0.0
    crank_pressure_limit: float = 0.0
    cage_pressure_limit: float = 0.0
    bearing_capacity: float = 0.0
    bearing_type: str = "ball"

    def __post_init__(self) -> None:
        for name in STIFFNESSES:
            value = getattr(self, name)
            if value != math.inf:
                _keep(self, name, f"a positive stiffness or {RIGID!r}", 0.0)
        for name in ("crank_speed", "bearing_capacity", *PRESSURE_LIMITS):
            _keep(self, name, "a number that is not negative", -1e-300)
        _keep(self, "friction_coefficient", "a coefficient of friction from 0 to below 1", -1e-300, 1.0)
        for name, known in WORDS.items():
            value = getattr(self, name)
            if value not in known:
                raise unknown_name(name, value, known)

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
        """Whether forces of inertia act."""
        return self.inertia == "on" and self.crank_speed > 0

    @property
    def couples_elements(self) -> bool:
        """Whether elements of a drive feel each other: then only whole drives have an equilibrium."""
        return math.isfinite(self.bearing_stiffness) or math.isfinite(self.housing_stiffness)


def _keep(options: ModelOptions, name: str, expected: str, low: float, high: float = math.inf) -> None:
    """The field as a plain float, whatever kind of number came; raises `InputError` out of its bounds."""
    object.__setattr__(options, name, expect_number(getattr(options, name), expected, name, low=low, high=high))


STIFFNESSES = ("bearing_stiffness", "cage_wall_stiffness", "ring_stiffness", "housing_stiffness")
PRESSURE_LIMITS = ("gear_pressure_limit", "crank_pressure_limit", "cage_pressure_limit")
WORDS: dict[str, tuple[str, ...]] = {
    "gear_contact": GEAR_CONTACTS,
    "cage_contact": CAGE_CONTACTS,
    "inertia": INERTIA,
    "bearing_type": BEARING_TYPES,
}
QUANTITIES = {
    "bearing_stiffness": "stiffness",
    "cage_wall_stiffness": "stiffness",
    "ring_stiffness": "stiffness",
    "housing_stiffness": "torsional stiffness",
    "crank_speed": "speed",
    "bearing_capacity": "force",
    **dict.fromkeys(PRESSURE_LIMITS, "pressure"),
}
"""Fields with a unit and their kind of quantity."""
SECTIONS = {
    "bodies": (*STIFFNESSES, "bearing_capacity", "bearing_type"),
    "contacts": ("gear_contact", "cage_contact", "inertia", "friction_coefficient", *PRESSURE_LIMITS),
    "operation": ("crank_speed",),
}
"""Where a drawing writes them."""


def read_options(values: Mapping[str, Any], where: str) -> ModelOptions:
    """The switches from a drawing's fields; those that are missing stay off. Raises `InputError`.

    >>> read_options({"bearing_stiffness": "250 N/um"}, "drawing").bearing_stiffness
    250000000.0
    """
    read: dict[str, Any] = {}
    for name, value in values.items():
        rigid = isinstance(value, str) and value == RIGID
        if name in QUANTITIES and not (rigid and name in STIFFNESSES):
            read[name] = parse_quantity(value, QUANTITIES[name], f"{where}: {name}")
        else:
            read[name] = math.inf if rigid else value
    for name, known in WORDS.items():
        expect(
            isinstance(read.get(name, ""), str),
            " or ".join(repr(word) for word in known),
            read.get(name),
            f"{where}: {name}",
        )
    try:
        return ModelOptions(**read)
    except ValueError as error:
        # The same one line, with the drawing's name before it.
        raise type(error)(f"{where}: {error}") from None


def write_options(options: ModelOptions, section: str) -> dict[str, Any]:
    """What differs from the defaults in one section, as a drawing writes it."""
    return {
        name: _text(name, getattr(options, name))
        for name in SECTIONS.get(section, ())
        if getattr(options, name) != _DEFAULTS[name]
    }


def _text(name: str, value: Any) -> Any:
    return format_quantity(value, QUANTITIES[name]) if name in QUANTITIES else value


_DEFAULTS = {f.name: f.default for f in fields(ModelOptions)}
