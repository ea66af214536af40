"""One REE drive: geometry, materials and tolerances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

from ..elasticity.hertz import LINE_EXPONENT, POINT_EXPONENT
from ..errors import expect, expect_integer, expect_number
from ..geometry.ball_path import BallPath, usable_limit
from ..geometry.seats import Seats
from ..units import format_quantity
from .assembly_checks import check_flank, check_mesh, check_radii
from .materials import Material
from .options import ModelOptions
from .tolerances import Tolerance

PARTS = ("element", "crank", "cage", "gear")
HOLES = ("cage", "gear")
"""Parts whose toleranced diameter is an inner one."""
COUNTS = ("elements", "eccentrics", "lobes")


def diameters(element_radius: float, crank_radius: float) -> dict[str, float]:
    """Nominal diameter, m, that the tolerance of each part is for; the gear's is the pitch circle of the elements.

    >>> diameters(7e-3, 41e-3)["gear"]
    0.096
    """
    return {
        "element": 2 * element_radius,
        "crank": 2 * crank_radius,
        "cage": 2 * element_radius,
        "gear": 2 * (crank_radius + element_radius),
    }


@dataclass(frozen=True)
class Drive:
    """One drive as drawn. Lengths in m, angles in rad.

    element: "ball" or "roller" (with element_length); elements: count on all eccentrics together;
    transmission_ratio: the magnitude |i|, crank to cage with the gear fixed; lobes: |i| - 1 (crank and cage
    turn together) or |i| + 1 (they reverse); crank_deviation: whether the crank's deviation is drawn per
    "element" (the paper) or per "eccentric" (a workshop); max_twist: greatest twist at the output, rad; beyond:
    what is switched on beside the paper's model.

    Raises `InputError` for what cannot be a drive.
    """

    name: str
    element_radius: float
    elements: int
    crank_radius: float
    eccentricity: float
    transmission_ratio: float
    lobes: int
    materials: Mapping[str, Material]
    tolerances: Mapping[str, Tolerance]
    max_twist: float
    element: str = "ball"
    element_length: float = 0.0
    eccentrics: int = 1
    crank_deviation: str = "element"
    beyond: ModelOptions = field(default_factory=ModelOptions)
    description: str = ""
    where: str = field(default="", compare=False, repr=False)

    def __post_init__(self) -> None:
        at = f"{self.where or self.name}: "
        for name in ("name", "description"):
            expect(isinstance(getattr(self, name), str), "a text", getattr(self, name), at + name)
        for name in ("element_radius", "crank_radius", "eccentricity", "max_twist"):
            object.__setattr__(self, name, expect_number(getattr(self, name), "a positive number", at + name, low=0))
        for name in COUNTS:
            # As a plain int, whatever counted: NumPy's go neither into TOML nor into C.
            object.__setattr__(
                self, name, expect_integer(getattr(self, name), "a whole number of at least 1", at + name)
            )
        expect(self.element in ("ball", "roller"), "'ball' or 'roller'", self.element, at + "element")
        length = "the roller's length, positive" if self.element == "roller" else "a length that is not negative"
        object.__setattr__(
            self,
            "element_length",
            expect_number(
                self.element_length, length, at + "element_length", low=0 if self.element == "roller" else -1e-300
            ),
        )
        expect(
            self.crank_deviation in ("element", "eccentric"),
            "'element' or 'eccentric'",
            self.crank_deviation,
            at + "crank_deviation",
        )
        ratio = expect_number(
            self.transmission_ratio, "the ratio's magnitude, above 1", at + "transmission_ratio", low=1
        )
        object.__setattr__(self, "transmission_ratio", int(ratio) if ratio == int(ratio) else ratio)
        expect(
            self.lobes in (self.transmission_ratio - 1, self.transmission_ratio + 1),
            f"transmission_ratio - 1 = {self.transmission_ratio - 1:g} lobes (turning together) or "
            f"transmission_ratio + 1 = {self.transmission_ratio + 1:g} (reversing)",
            self.lobes,
            at + "lobes",
        )
        expect(
            self.elements % self.eccentrics == 0,
            f"a multiple of the {self.eccentrics} eccentrics",
            self.elements,
            at + "elements",
        )
        expect(
            self.eccentricity < self.element_radius + self.crank_radius,
            "an eccentricity below crank_radius + element_radius",
            self.eccentricity,
            at + "eccentricity",
        )
        expect(
            self.element_radius < self.crank_radius,
            "an element smaller than its path, its radius below the crank's "
            f"{format_quantity(self.crank_radius, 'length')}",
            format_quantity(self.element_radius, "length"),
            at + "element_radius",
        )
        expect(
            self.element == "ball" or self.beyond.cage_contact == "hertz",
            "'hertz' for rollers, whose slots have flat walls",
            self.beyond.cage_contact,
            at + "cage_contact",
        )
        for part in PARTS:
            expect(part in self.materials, f"a material for {', '.join(PARTS)}", list(self.materials), at + "materials")
            expect(
                part in self.tolerances, f"a tolerance for {', '.join(PARTS)}", list(self.tolerances), at + "tolerances"
            )
        self._check_assembled(at)

    def _check_assembled(self, at: str) -> None:
        """The bounds of `assembly_checks`: what no part shows by itself."""
        radii = {part: self.crank_radius if part == "crank" else self.element_radius for part in PARTS}
        check_radii(radii, self.tolerances, at)
        check_flank(self.path, self.usable_limit, self.element_radius, at)
        exponent = POINT_EXPONENT if self.element == "ball" else LINE_EXPONENT
        own = self.materials["element"].compliance
        compliance = {part: (own + self.materials[part].compliance) ** (1 / exponent) for part in ("gear", "crank")}
        check_mesh(self.path, self.element_radius, self.tolerances, compliance, at)

    def __repr__(self) -> str:
        """One line; `drive_to_dict` has every field.

        >>> from stiffness_model import load_drive
        >>> load_drive("workshop")
        Drive('workshop', 3 x 25 balls of 10 mm, 26 lobes, ratio -25)
        """
        return (
            f"Drive({self.name!r}, {self.eccentrics} x {self.elements_per_row} {self.element}s of "
            f"{format_quantity(2 * self.element_radius, 'length')}, {self.lobes} lobes, ratio {self.ratio:g})"
        )

    @property
    def orientation(self) -> int:
        """+1 where crank and cage turn together, -1 where they reverse."""
        return 1 if self.lobes < self.transmission_ratio else -1

    @property
    def ratio(self) -> float:
        """Signed transmission ratio i, crank to cage with the gear fixed: z + 1 or -(z - 1)."""
        return self.orientation * self.transmission_ratio

    @property
    def path(self) -> BallPath:
        """The nominal path of the elements' centres."""
        return BallPath(self.crank_radius + self.element_radius, self.eccentricity, self.lobes)

    @cached_property
    def usable_limit(self) -> float:
        """|beta| beyond which the profile cuts itself, rad; elements there carry nothing."""
        return usable_limit(self.path, self.element_radius)

    def size(self, part: str) -> float:
        """Nominal diameter of a part, m, as `diameters` has it."""
        return diameters(self.element_radius, self.crank_radius)[part]

    @property
    def elements_per_row(self) -> int:
        """Elements on one eccentric."""
        return self.elements // self.eccentrics

    @property
    def seats(self) -> Seats:
        """Where the elements of one eccentric stand, and the wall between their bores."""
        return Seats(
            round(self.transmission_ratio),
            self.elements_per_row,
            self.path.centre_distance,
            self.element_radius + self.tolerances["cage"].offset,
        )
