"""A drive of kind "catalogue": what a maker's data sheet states of a gear, each number with its source."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any

import numpy as np

from ..display import dataframe, html_table, view
from ..drawing.fields import NUMBER, TEXT, Field, check_attributes, fields_of, number_between, optional, positive
from ..errors import InputError, expect, expect_number
from ..frozen_mapping import FrozenMapping
from ..kinds import CATALOGUE
from ..numerics.arrays import Array
from ..numerics.piecewise_line import PiecewiseLine
from ..units import ARCMIN, format_quantity
from .efficiency_table import EfficiencyTable

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEYOND_T2 = 2.0
"""Range of a curve over its last torque limit where a sheet states no permissible torque: chosen by judgement, since
makers place t2 near the rated torque and permit two to four times that for short."""


def _optional(quantity: str, doc: str, example: str) -> Field:
    return Field(quantity, "", doc, example, optional(positive(f"a positive {quantity}")))


def _ratio(value: object, where: str) -> float:
    number = expect_number(value, "a ratio, crank to output, negative where the two turn in opposite senses", where)
    expect(abs(number) > 1, "a ratio of magnitude above 1", value, where)
    return int(number) if number == int(number) else number


_STIFFNESS, _TORQUE = "torsional stiffness", "torque"


@dataclass(frozen=True, kw_only=True)
class CatalogueDrive:
    """A gear as its data sheet states it; the `Field` beside each attribute states its meaning. SI, twists in rad.

    twist, torque: (n,) points of a curve in place of stiffnesses, empty without one. upper_limits: names of the fields
    whose value is an upper limit ("below 1 arcmin"). sources: of single fields, beside `source` for all others. Raises
    `InputError` for a sheet without a curve and for values that contradict each other.
    """

    name: Annotated[str, Field(TEXT, "", "Name of the gear, which its curve, FMU and files carry.", "my_gear")]
    maker: Annotated[str, Field(TEXT, "", "Who makes the gear.", "Harmonic Drive")] = ""
    type: Annotated[str, Field(TEXT, "", "The maker's designation.", "CHA-40A")] = ""
    gear_type: Annotated[str, Field(TEXT, "", "Its principle.", "strain wave")] = ""
    source: Annotated[str, Field(TEXT, "", "Document and page from which the numbers are.", "Manual 2015, page 50")]
    note: Annotated[str, Field(TEXT, "", "A remark on the numbers.", "t2 read from a diagram")] = ""
    ratio: Annotated[
        float,
        Field(NUMBER, "", "Ratio from crank to output; negative where they turn in opposite senses.", "50", _ratio),
    ]
    ratio_range: Annotated[str, Field(TEXT, "", "The ratios for which the numbers hold.", "above 50")] = ""
    k1: Annotated[float | None, _optional(_STIFFNESS, "Stiffness up to the torque t1.", "100 kN.m/rad")] = None
    t1: Annotated[float | None, _optional(_TORQUE, "Torque up to which k1 holds.", "54 N.m")] = None
    k2: Annotated[float | None, _optional(_STIFFNESS, "Stiffness from t1 to t2.", "140 kN.m/rad")] = None
    t2: Annotated[float | None, _optional(_TORQUE, "Torque up to which k2 holds.", "196 N.m")] = None
    k3: Annotated[float | None, _optional(_STIFFNESS, "Stiffness beyond t2.", "180 kN.m/rad")] = None
    stiffness: Annotated[float | None, _optional(_STIFFNESS, "One stiffness for all torques.", "113 N.m/arcmin")] = None
    lost_motion: Annotated[float | None, _optional("angle", "Lost motion, as the maker defines it.", "1 arcmin")] = None
    hysteresis_loss: Annotated[
        float | None, _optional("angle", "Width of the hysteresis loop at zero torque.", "1 arcmin")
    ] = None
    transmission_accuracy: Annotated[float | None, _optional("angle", "Transmission accuracy.", "0.7 arcmin")] = None
    rated_torque: Annotated[float | None, _optional(_TORQUE, "Rated torque at the output.", "412 N.m")] = None
    acceleration_torque: Annotated[
        float | None, _optional(_TORQUE, "Permissible torque of starts and stops.", "1029 N.m")
    ] = None
    momentary_torque: Annotated[float | None, _optional(_TORQUE, "Permissible momentary torque.", "2058 N.m")] = None
    inertia: Annotated[float | None, _optional("moment of inertia", "Inertia at the input.", "1.5 kg.cm2")] = None
    max_twist: Annotated[
        float,
        Field(
            "angle",
            "",
            "Greatest twist in use; by default that under the greatest torque stated.",
            "8 arcmin",
            number_between(-math.ulp(0.0), math.inf, "an angle from zero on"),
            default=None,
        ),
    ] = 0.0
    twist: tuple[float, ...] = ()
    torque: tuple[float, ...] = ()
    upper_limits: tuple[str, ...] = ()
    sources: Mapping[str, str] = field(default_factory=lambda: FrozenMapping({}))
    efficiency: EfficiencyTable | None = None
    where: str = field(default="", compare=False, repr=False)

    def __post_init__(self) -> None:
        check_attributes(self, CatalogueDrive, self.where or self.name)
        object.__setattr__(self, "sources", FrozenMapping(self.sources))
        at = self.where or self.name
        expect(bool(self.source.strip()), "the document from which the numbers are", self.source, f"{at}: source")
        if limit := re.fullmatch(r"above (\d+\.?\d*)", self.ratio_range):
            inside = abs(self.ratio) > float(limit[1])
            expect(inside, f"a ratio {self.ratio_range}, for which the numbers hold", self.ratio, f"{at}: ratio")
        corners = self._corners(at)
        if self.max_twist == 0:
            object.__setattr__(self, "max_twist", self._greatest_twist(corners, at))

    @property
    def kind(self) -> str:
        """The kind that a drawing states (`stiffness_model.kinds`)."""
        return CATALOGUE

    @property
    def transmission_ratio(self) -> float:
        """Magnitude of the ratio."""
        return abs(self.ratio)

    @cached_property
    def line(self) -> PiecewiseLine:
        """The torque over the twist, to the digit: the sheet's straight lines, an odd function."""
        x, y = self._corners(self.name)
        if self.twist:
            return PiecewiseLine.through(x, y)
        stiffness = self._stiffnesses[-1]
        last = max(self.max_twist, 1.2 * float(x[-1]))
        return PiecewiseLine.through(np.append(x, last), np.append(y, y[-1] + stiffness * (last - x[-1])))

    @property
    def hysteresis_torque(self) -> float:
        """Torque of the effect `hysteresis`, N.m, whose loop has the sheet's width at zero torque; 0 without one.

        The loop's branches are the curve plus and minus this torque; they cross zero torque where the curve carries it.
        """
        return 0.0 if self.hysteresis_loss is None else float(self.line.at(self.hysteresis_loss / 2))

    @property
    def permissible_torque(self) -> float | None:
        """The greatest torque that the sheet permits, N.m; None if it states none."""
        named = (self.rated_torque, self.acceleration_torque, self.momentary_torque)
        return max((torque for torque in named if torque is not None), default=None)

    def source_of(self, name: str) -> str:
        """The source of a field's value."""
        return self.sources.get(name, self.source)

    def __repr__(self) -> str:
        size = f"{float(self.line.at(self.max_twist)):.4g} N.m at {self.max_twist / ARCMIN:.4g} arcmin"
        return f"CatalogueDrive({self.name!r}, ratio {self.ratio:g}, {size})"

    def _repr_html_(self) -> str:
        return html_table(self.name, {"ratio": f"{self.ratio:g}", **stated_values(self), "source": self.source})

    def plot(self, ax: Axes | None = None) -> Axes:
        """The curve to max_twist, on `ax` or on new axes, which are returned."""
        simulate = view("stiffness_model.catalog.catalogue_population:simulate_catalogue")
        return simulate(self, np.linspace(0.0, self.max_twist, 61), 1).plot(ax)

    def to_dataframe(self) -> Any:
        """A `pandas.DataFrame` of what the sheet states, each with its source. Raises `InputError` without pandas."""
        values = stated_values(self)
        columns = {"field": list(values), "value": list(values.values()), "source": [*map(self.source_of, values)]}
        return dataframe(columns)

    @property
    def _stiffnesses(self) -> list[float]:
        if self.stiffness is not None:
            return [self.stiffness]
        return [k for k in (self.k1, self.k2, self.k3) if k is not None]

    def _corners(self, at: str) -> tuple[Array, Array]:
        """Twists, rad, and torques, N.m, (n,) of zero and of the corners or points of the curve."""
        stated = [name for name in ("k1", "t1", "k2", "t2", "k3") if getattr(self, name) is not None]
        forms = [bool(stated), self.stiffness is not None, bool(self.twist)]
        expected = "k1, t1, k2, t2 and k3, or one stiffness, or a table of twist and torque"
        if sum(forms) != 1:
            given = [*stated, *(["stiffness"] if forms[1] else []), *(["twist and torque"] if forms[2] else [])]
            raise InputError(f"{at}: expected {expected}, got {', '.join(given) or 'none'} (source: {self.source})")
        if self.twist:
            return np.array(self.twist), np.array(self.torque)
        if stated and stated not in (["k1"], ["k1", "t1", "k2"], ["k1", "t1", "k2", "t2", "k3"]):
            raise InputError(f"{at}: expected {expected}, got {', '.join(stated)} alone (source: {self.source})")
        limits = [t for t in (self.t1, self.t2) if t is not None]
        expect(limits == sorted(set(limits)), "t1 below t2", ", ".join(f"{t:g} N.m" for t in limits), at)
        torque = np.array([0.0, *limits])
        return np.append(0.0, np.cumsum(np.diff(torque) / np.array(self._stiffnesses[: len(limits)]))), torque

    def _greatest_twist(self, corners: tuple[Array, Array], at: str) -> float:
        x, y = corners
        if self.twist:
            return float(np.abs(x).max())
        torque = self.permissible_torque or BEYOND_T2 * float(y[-1])
        expect(
            torque > 0, "the field 'max_twist', or a rated or momentary torque, for the range of the curve", "none", at
        )
        if torque <= y[-1]:
            return float(np.interp(torque, y, x))
        return float(x[-1] + (torque - y[-1]) / self._stiffnesses[-1])


FIELDS: Mapping[str, Field] = FrozenMapping(dict(fields_of(CatalogueDrive)))
"""The fields that are single values, by name: TOML key, keyword of `load_drive` and name for `--set`."""


def stated_values(drive: CatalogueDrive) -> dict[str, str]:
    """The quantities of the sheet with their units, "below" where they are upper limits, by name."""
    found: dict[str, str] = {}
    for name, declared in FIELDS.items():
        value = getattr(drive, name)
        if declared.has_unit and value is not None and name != "max_twist":
            below = "below " if name in drive.upper_limits else ""
            found[name] = below + format_quantity(value, declared.quantity)
    return found
