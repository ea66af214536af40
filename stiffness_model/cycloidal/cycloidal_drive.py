"""One pin-cycloid reducer as drawn: geometry, profile modifications, clearances, materials and tolerances."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated

from ..drawing.fields import (
    CHOICE,
    COUNT,
    MATERIAL,
    NUMBER,
    TEXT,
    Field,
    check_attributes,
    fields_of,
    number_between,
)
from ..drawing.materials import Material
from ..drawing.options import RIGID
from ..errors import expect, expect_integer, expect_number
from ..frozen_mapping import FrozenMapping
from ..kinds import CYCLOIDAL
from ..units import format_quantity, limit_text
from .pin_trochoid import PinTrochoid

CYCLOIDAL_PARTS = ("disc", "ring", "roller")
"""Parts with a material: the discs, the ring's pins or lobes, and the output rollers."""
_SIZE = "Width of the tolerance zone of {}, six standard deviations."
_POSITION = "Diameter of the tolerance zone of the position of {}, six standard deviations of each coordinate."


def _at_least_three(value: object, where: str) -> int:
    return expect_integer(value, "a whole number of at least 3", where, low=3)


def _any_length(value: object, where: str) -> float:
    return expect_number(value, "a finite length in m", where)


def _length(section: str, doc: str, example: str) -> Field:
    return Field("length", section, doc, example)


def _signed_length(doc: str, example: str) -> Field:
    return Field("length", "modifications", doc, example, _any_length)


@dataclass(frozen=True, kw_only=True)
class CycloidalDrive:
    """A pin-cycloid reducer with fixed ring. SI; the `Field` beside each attribute states its meaning.

    materials: of `CYCLOIDAL_PARTS`; where: the file it was read from, for messages. Raises `InputError` for values of
    which no reducer can be made.
    """

    name: Annotated[str, Field(TEXT, "", "Name of the drive, which its curve, FMU and files carry.", "my_gear")]
    description: Annotated[str, Field(TEXT, "", "What the drive is, in a sentence.", "Printed reducer")] = ""
    ring: Annotated[
        str,
        Field(
            CHOICE,
            "geometry",
            'What the disc rolls in: "pins", or "lobes" of the pins\' radius that are one piece with the ring.',
            choices=("pins", "lobes"),
        ),
    ] = "pins"
    pins: Annotated[
        int, Field(COUNT, "geometry", "Pins or lobes of the ring; the disc has one lobe less.", "14", _at_least_three)
    ]
    pin_radius: Annotated[float, _length("geometry", "Radius of a pin, or of the tip of a ring's lobe.", "3.5 mm")]
    pin_circle_radius: Annotated[float, _length("geometry", "Radius of the circle of the pins' centres.", "34 mm")]
    eccentricity: Annotated[
        float, _length("geometry", "Distance of the disc's centre from the drive's axis.", "1.5 mm")
    ]
    discs: Annotated[int, Field(COUNT, "geometry", "Discs on the crank, evenly distributed over its turn.", "2")] = 1
    disc_thickness: Annotated[float, _length("geometry", "Length of the contacts of one disc.", "12 mm")]
    output_rollers: Annotated[
        int, Field(COUNT, "geometry", "Output rollers, each in a hole of every disc.", "8", _at_least_three)
    ]
    roller_radius: Annotated[float, _length("geometry", "Outer radius of an output roller.", "4.5 mm")]
    roller_circle_radius: Annotated[
        float, _length("geometry", "Radius of the circle of the output rollers' centres.", "20 mm")
    ]
    profile_clearance: Annotated[
        float,
        _signed_length(
            "Equidistant shift of the flank: the normal clearance to every pin; negative: interference.", "50 um"
        ),
    ] = 0.0
    profile_offset: Annotated[
        float,
        _signed_length("Radial shift of the generating pins' circle for the flank; positive: a larger disc.", "-20 um"),
    ] = 0.0
    hole_clearance: Annotated[
        float,
        _signed_length("Radius of a hole beyond roller_radius + eccentricity; negative: interference.", "50 um"),
    ] = 0.0
    bearing_clearance: Annotated[
        float,
        _length("modifications", "Radial play of a disc on its eccentric, to either side.", "10 um"),
    ] = 0.0
    materials: Annotated[
        Mapping[str, Material],
        Field(MATERIAL, "materials", "Material of the discs.", "PLA", name="disc_material"),
        Field(MATERIAL, "materials", "Material of the ring's pins or lobes.", "100Cr6", name="ring_material"),
        Field(MATERIAL, "materials", "Material of the output rollers.", "100Cr6", name="roller_material"),
    ]
    stiffness_scatter: Annotated[
        float,
        Field(
            NUMBER,
            "materials",
            "Standard deviation of the logarithm of the factor common to all moduli and stiffnesses of a drive.",
            "0.3",
            number_between(-math.ulp(0.0), 2.0, "a standard deviation from 0 to below 2"),
        ),
    ] = 0.0
    profile_clearance_tolerance: Annotated[
        float, _length("tolerances", _SIZE.format("the profile clearance of a drive, common to its pins"), "60 um")
    ] = 0.0
    hole_clearance_tolerance: Annotated[
        float, _length("tolerances", _SIZE.format("the hole clearance of a drive, common to its holes"), "60 um")
    ] = 0.0
    pin_tolerance: Annotated[float, _length("tolerances", _SIZE.format("a pin's diameter"), "20 um")] = 0.0
    pin_position_tolerance: Annotated[float, _length("tolerances", _POSITION.format("the pins"), "40 um")] = 0.0
    profile_tolerance: Annotated[
        float, _length("tolerances", _SIZE.format("the profile of each lobe, along the normal"), "30 um")
    ] = 0.0
    roller_tolerance: Annotated[float, _length("tolerances", _SIZE.format("a roller's diameter"), "10 um")] = 0.0
    roller_position_tolerance: Annotated[float, _length("tolerances", _POSITION.format("the rollers"), "40 um")] = 0.0
    hole_tolerance: Annotated[float, _length("tolerances", _SIZE.format("a hole's diameter"), "40 um")] = 0.0
    hole_position_tolerance: Annotated[float, _length("tolerances", _POSITION.format("the holes"), "40 um")] = 0.0
    bearing_stiffness: Annotated[
        float,
        Field(
            "stiffness",
            "bodies",
            "Radial stiffness of each eccentric with bearing and crank.",
            "100 N/um",
            infinite=RIGID,
        ),
    ] = math.inf
    ring_stiffness: Annotated[
        float,
        Field(
            "stiffness",
            "bodies",
            "Stiffness of the ring and the lobe under each pin contact, along its normal.",
            "50 N/um",
            infinite=RIGID,
        ),
    ] = math.inf
    roller_stiffness: Annotated[
        float,
        Field("stiffness", "bodies", "Bending stiffness of each output roller's pin.", "20 N/um", infinite=RIGID),
    ] = math.inf
    housing_stiffness: Annotated[
        float,
        Field(
            "torsional stiffness",
            "bodies",
            "Torsional stiffness, at the output, of all that lies between contacts and flanges.",
            "20 N.m/arcmin",
            infinite=RIGID,
        ),
    ] = math.inf
    max_twist: Annotated[float, Field("angle", "operation", "Greatest twist in use, at the output.", "60 arcmin")]
    where: str = field(default="", compare=False, repr=False)

    def __post_init__(self) -> None:
        at = f"{self.where or self.name}: "
        check_attributes(self, CycloidalDrive, str(self.where or self.name))
        for part in CYCLOIDAL_PARTS:
            expect(
                part in self.materials, f"a material for {', '.join(CYCLOIDAL_PARTS)}", list(self.materials), at + part
            )
        object.__setattr__(self, "materials", FrozenMapping(self.materials))
        self._check_geometry(at)

    def _check_geometry(self, at: str) -> None:
        """Check what single fields do not show. at: what precedes the field's name in a message."""
        path, hole = self.path, self.hole_radius
        widest = min(path.least_convex_radius(), self.pin_circle_radius * math.sin(math.pi / self.pins))
        spacing = self.roller_circle_radius * math.sin(math.pi / self.output_rollers)
        edge = self.pin_circle_radius - self.eccentricity - self.pin_radius - hole
        for name, limit, reason in (
            ("eccentricity", self.pin_circle_radius / self.pins, "pin_circle_radius/pins, where the flank gets loops"),
            ("pin_radius", widest, "where the flank is undercut or pins touch"),
            ("roller_radius", spacing - hole + self.roller_radius, "where the holes of neighbouring rollers touch"),
            ("roller_circle_radius", edge, "where holes reach the flank"),
        ):
            value = getattr(self, name)
            expected = f"less than {limit_text(limit, 'length')}, {reason}"
            expect(value < limit, expected, format_quantity(value, "length"), at + name)

    @property
    def kind(self) -> str:
        """The kind of drive that a drawing states."""
        return CYCLOIDAL

    @property
    def path(self) -> PinTrochoid:
        """The nominal path of the pins' centres in a disc's frame."""
        return PinTrochoid(self.pin_circle_radius, self.eccentricity, self.pins)

    @property
    def lobes(self) -> int:
        """Lobes of a disc."""
        return self.pins - 1

    @property
    def ratio(self) -> float:
        """Signed ratio from crank to output with the ring fixed: -(pins - 1), since they turn in opposite senses."""
        return -float(self.lobes)

    @property
    def transmission_ratio(self) -> float:
        """Magnitude of the ratio."""
        return float(self.lobes)

    @property
    def hole_radius(self) -> float:
        """Nominal radius of a hole, m: roller, eccentricity and clearance."""
        return self.roller_radius + self.eccentricity + self.hole_clearance

    def __repr__(self) -> str:
        return (
            f"CycloidalDrive({self.name!r}, {self.pins} {self.ring}, {self.lobes} lobes, {self.discs} disc(s), "
            f"{self.output_rollers} output rollers, ratio {self.ratio:g})"
        )


CYCLOIDAL_FIELDS: Mapping[str, Field] = FrozenMapping(fields_of(CycloidalDrive))
"""Every field of such a drawing by name: TOML key, keyword of `load_drive` and name for `--set`."""
