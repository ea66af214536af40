"""One REE drive: geometry, materials and tolerances."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

from ..display import dataframe, html_table, view
from ..elasticity.hertz import LINE_EXPONENT, POINT_EXPONENT
from ..errors import expect
from ..frozen_mapping import FrozenMapping
from ..geometry.ball_path import BallPath, usable_limit
from ..geometry.seats import Seats
from ..units import format_quantity
from .assembly_checks import check_flank, check_mesh, check_radii
from .fields import (
    CHOICE,
    COUNT,
    MATERIAL,
    NUMBER,
    OFFSET,
    PARTS,
    TEXT,
    TOLERANCE,
    Field,
    check_attributes,
    fields_of,
    ratio_above_one,
)
from .materials import Material
from .options import ModelOptions
from .tolerances import Tolerance, diameters

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HOLES = ("cage", "gear")
"""Parts whose toleranced diameter is that of a hole."""


@dataclass(frozen=True, kw_only=True)
class Drive:
    """One drive as drawn. Lengths in m, angles in rad; the `Field` beside each attribute states its meaning.

    materials, tolerances: by part (`fields.PARTS`); beyond: what is switched on beyond the paper's model; where: the
    file it was read from, for messages. Raises `InputError` for values of which no drive can be made.
    """

    name: Annotated[str, Field(TEXT, "", "Name of the drive, which its curve, FMU and files carry.", "my_drive")]
    description: Annotated[str, Field(TEXT, "", "What the drive is, in a sentence.", "Steel, ground gear profile")] = ""
    element: Annotated[
        str,
        Field(CHOICE, "geometry", "Kind of the rolling elements.", choices=("ball", "roller"), varies=True),
    ] = "ball"
    element_radius: Annotated[float, Field("length", "geometry", "Radius of a rolling element.", "7 mm", varies=True)]
    element_length: Annotated[
        float,
        Field(
            "length",
            "geometry",
            "Length of a roller along its axis; a ball has none.",
            "12 mm",
            varies=True,
        ),
    ] = 0.0
    elements: Annotated[int, Field(COUNT, "geometry", "Rolling elements on all eccentrics together.", "87")]
    eccentrics: Annotated[
        int, Field(COUNT, "geometry", "Eccentrics of the crank, each with one row of elements.", "3", varies=True)
    ] = 1
    crank_radius: Annotated[
        float,
        Field("length", "geometry", "Radius of the raceway on each eccentric of the crank.", "41 mm", varies=True),
    ]
    eccentricity: Annotated[
        float, Field("length", "geometry", "Distance of an eccentric's axis from the drive's.", "0.7 mm", varies=True)
    ]
    transmission_ratio: Annotated[
        float,
        Field(
            NUMBER,
            "geometry",
            "Magnitude |i| of the ratio from crank to cage with the gear fixed.",
            "29",
            ratio_above_one,
        ),
    ]
    lobes: Annotated[
        int,
        Field(
            COUNT,
            "geometry",
            "Lobes of the gear: |i| - 1 where crank and cage turn together, |i| + 1 where they reverse.",
            "30",
            varies=True,
        ),
    ]
    materials: Annotated[
        Mapping[str, Material],
        Field(MATERIAL, "materials", "Material of the {part}.", "100Cr6", varies=True, name="{part}_material"),
    ]
    tolerances: Annotated[
        Mapping[str, Tolerance],
        Field(
            TOLERANCE,
            "tolerances",
            "Tolerance zone of the diameter of the {part}.",
            "13 um",
            varies=True,
            name="{part}_tolerance",
        ),
        Field(
            OFFSET,
            "tolerances",
            "Mean deviation of the radius of the {part} from nominal, as a length or in sigma of that radius.",
            "5 um",
            varies=True,
            name="{part}_offset",
            default=None,
        ),
    ]
    crank_deviation: Annotated[
        str,
        Field(
            CHOICE,
            "tolerances",
            "Whether the crank's deviation is drawn per element (the paper) or once per eccentric (one ring each).",
            choices=("element", "eccentric"),
            varies=True,
        ),
    ] = "element"
    max_twist: Annotated[float, Field("angle", "operation", "Greatest twist in use, at the output.", "8 arcmin")]
    beyond: ModelOptions = field(default_factory=ModelOptions)
    where: str = field(default="", compare=False, repr=False)

    def __post_init__(self) -> None:
        check_attributes(self, Drive, str(self.where or self.name))
        at = f"{self.where or self.name}: "
        for name, kind in (("materials", "material"), ("tolerances", "tolerance")):
            values: Mapping[str, object] = getattr(self, name)
            for part in PARTS:
                expect(part in values, f"a {kind} for {', '.join(PARTS)}", list(values), at + name)
            object.__setattr__(self, name, FrozenMapping(values))
        self._check_geometry(at)
        self._check_assembled(at)

    def _check_geometry(self, at: str) -> None:
        """Check what single fields do not show. at: what precedes the field's name in a message."""
        ratio = self.transmission_ratio
        crank, element = (format_quantity(radius, "length") for radius in (self.crank_radius, self.element_radius))
        flat = self.element == "ball" or self.beyond.cage_contact == "hertz"
        for name, holds, expected in (
            ("element_length", self.element == "ball" or self.element_length > 0, "the roller's length, positive"),
            (
                "lobes",
                self.lobes in (ratio - 1, ratio + 1),
                f"transmission_ratio - 1 = {ratio - 1:g} lobes (turning together) or {ratio + 1:g} (reversing)",
            ),
            ("elements", self.elements % self.eccentrics == 0, f"a multiple of the {self.eccentrics} eccentrics"),
            (
                "eccentricity",
                self.eccentricity < self.element_radius + self.crank_radius,
                "an eccentricity below crank_radius + element_radius",
            ),
        ):
            expect(holds, expected, getattr(self, name), at + name)
        expect(
            self.element_radius < self.crank_radius,
            f"an element smaller than its path, its radius below the crank's {crank}",
            element,
            at + "element_radius",
        )
        expect(flat, "'hertz' for rollers, whose slots have flat walls", self.beyond.cage_contact, at + "cage_contact")

    def _check_assembled(self, at: str) -> None:
        """Check the bounds of `assembly_checks`, which need the whole drive."""
        radii = {part: self.crank_radius if part == "crank" else self.element_radius for part in PARTS}
        check_radii(radii, self.tolerances, at)
        check_flank(self.path, self.usable_limit, self.element_radius, at)
        exponent = POINT_EXPONENT if self.element == "ball" else LINE_EXPONENT
        own = self.materials["element"].compliance
        compliance = {part: (own + self.materials[part].compliance) ** (1 / exponent) for part in ("gear", "crank")}
        check_mesh(self.path, self.element_radius, self.tolerances, compliance, at)

    def __repr__(self) -> str:
        return (
            f"Drive({self.name!r}, {self.eccentrics} x {self.elements_per_row} {self.element}s of "
            f"{format_quantity(2 * self.element_radius, 'length')}, {self.lobes} lobes, ratio {self.ratio:g})"
        )

    def _repr_html_(self) -> str:
        return html_table(self.name, view("stiffness_model.plotting.drive_tables:main_sizes")(self))

    def plot(self, ax: Axes | None = None) -> Axes:
        """The first row to scale, without deviations and load, on `ax` or on new axes, which are returned."""
        return view("stiffness_model.plotting.cross_section.row:drive_row")(self, ax)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` of sizes, tolerances and materials by part. Raises `InputError` without pandas."""
        return dataframe(view("stiffness_model.plotting.drive_tables:part_columns")(self))

    @property
    def kind(self) -> str:
        """The kind that a drawing states (`stiffness_model.kinds`)."""
        return "rolling element eccentric"

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
        """|beta|, rad, beyond which the profile cuts itself; elements there carry no load."""
        return usable_limit(self.path, self.element_radius)

    def size(self, part: str) -> float:
        """Nominal diameter of a part, m (`tolerances.diameters`)."""
        return diameters(self.element_radius, self.crank_radius)[part]

    @property
    def elements_per_row(self) -> int:
        """Elements on one eccentric."""
        return self.elements // self.eccentrics

    @property
    def seats(self) -> Seats:
        """The possible places of the elements of one eccentric, and the wall between their bores."""
        return Seats(
            round(self.transmission_ratio),
            self.elements_per_row,
            self.path.centre_distance,
            self.element_radius + self.tolerances["cage"].offset,
        )


FIELDS: Mapping[str, Field] = FrozenMapping({**fields_of(Drive), **fields_of(ModelOptions)})
"""Every field of a drawing by name: TOML key, keyword of `load_drive` and name for `--set`."""
