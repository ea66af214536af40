"""The metrics of a design, which objectives and constraints refer to by name."""

from __future__ import annotations

from dataclasses import dataclass

from ...units import UNITS, si_unit


@dataclass(frozen=True)
class Metric:
    """One number of a design, SI. text: its name in figures; quantity: of `units.UNITS`, or "" for a pure number.

    shown: the unit of pictures and printed tables; drawn: known from the drawing, without any simulation.
    """

    name: str
    text: str
    quantity: str = ""
    display_unit: str = ""
    from_drawing: bool = False

    @property
    def unit(self) -> str:
        """The SI unit of the stored column."""
        return si_unit(self.quantity) if self.quantity else "1"

    @property
    def scale(self) -> float:
        """SI units in one `shown` unit."""
        return UNITS[self.quantity][self.display_unit] if self.quantity else 0.01 if self.display_unit == "%" else 1.0

    @property
    def label(self) -> str:
        """The text for an axis, with the display unit."""
        return f"{self.text} [{self.display_unit}]" if self.display_unit else self.text


_ALL = (
    Metric("stiffness", "stiffness", "torsional stiffness", "N.m/arcmin"),
    Metric("twist", "twist", "angle", "arcmin"),
    Metric("backlash", "play", "angle", "arcmin"),
    Metric("lost_motion", "lost motion", "angle", "arcmin"),
    Metric("no_load_force", "greatest no-load force", "force", "N"),
    Metric("no_load_sum", "sum of no-load forces", "force", "N"),
    Metric("greatest_force", "greatest force", "force", "N"),
    Metric("pressure", "greatest pressure over a turn", "pressure", "GPa"),
    Metric("load_share", "load share", "", "%"),
    Metric("scatter", "scatter of the torque", "", "%"),
    Metric("squeezed", "balls larger than their bore", "", "%"),
    Metric("cost_class", "cost class", from_drawing=True),
    Metric("undercut", "profile cut away", "", "%", from_drawing=True),
    Metric("pressure_angle", "pressure angle", "angle", "deg", from_drawing=True),
    Metric("diameter", "gear diameter", "length", "mm", from_drawing=True),
    Metric("ratio", "transmission ratio", from_drawing=True),
    Metric("elements", "elements", from_drawing=True),
)
METRICS = {metric.name: metric for metric in _ALL}
"""By name. "At the torque" is the study's `torque`; a mean is over the virtual drives.

stiffness: slope of the mean curve at the torque; twist: of the mean curve at the torque; backlash and
lost_motion: of the mean curve, for the torque (`curve.TwistTorqueCurve`); no_load_force: greatest force of a
contact at zero twist, mean; no_load_sum: sum of all contacts' forces at zero twist, mean, to which Coulomb friction is
proportional; greatest_force: greatest force of a contact at the torque, mean; pressure: greatest Hertzian
pressure at gear and crank over a turn at the torque, 90th percentile of the drives (a limit is for the most loaded
contact); load_share: greatest share of one element in the torque, mean;
scatter: (P90 - P10)/mean of the drives' torques at the twist of the torque; squeezed: share of the loaded part's
elements that are larger than their bore; cost_class: see `cost.cost_class`; undercut: share of the profile that
is cut away; pressure_angle: greatest between the gear's normal and the radius, where the profile exists;
diameter: across the gear's deepest points; ratio: magnitude |i|; elements: on all eccentrics.
"""
