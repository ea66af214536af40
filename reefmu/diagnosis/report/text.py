"""The words of the report: sizes in the units that people use, and what a reader must mind."""

from __future__ import annotations

from stiffness_model.units import ARCMIN, MICROMETRE

from ..schema import Diagnosis, Location, NamedEffect, Value

MEANING = {
    "named": "the missing effect is found",
    "partly": "an effect is found, and something more is missing",
    "ambiguous": "several explanations fit; this record cannot tell which",
    "none": "nothing is missing",
    "unknown": "something is missing that has no name here",
    "insufficient": "the record does not allow a diagnosis",
}
"""What each verdict means."""
_SHOWN = {
    "m": (MICROMETRE, "um"),
    "rad": (ARCMIN, "arcmin"),
    "m/K": (MICROMETRE, "um/K"),
    "m/rad": (1e-9, "nm/rad"),
    "rad/(N.m)": (ARCMIN, "arcmin/(N.m)"),
    "rad/K": (ARCMIN, "arcmin/K"),
}
LARGE_REST = 1.5
"""Gap left over the noise that a reader is told of."""


def quantity_text(value: float, unit: str) -> str:
    """A value in SI as text in the unit that people use.

    >>> quantity_text(1.25e-6, "m"), quantity_text(0.059, "1")
    ('1.25 um', '0.059')
    """
    factor, name = _SHOWN.get(unit, (1.0, unit))
    return f"{value / factor:.4g}" + ("" if name == "1" else f" {name}")


def interval_text(value: Value) -> str:
    """The 95 % interval as text."""
    return (
        f"{quantity_text(value.low, '1' if value.unit not in _SHOWN else value.unit).split(' ')[0]} ... "
        f"{quantity_text(value.high, value.unit)}"
    )


def main_parameter_text(effect: NamedEffect) -> str:
    """The parameter that says how large an effect is, with its interval; of a kinematic error its greatest order."""
    sizes = {name: v for name, v in effect.parameters.items() if not name.startswith("phase")}
    name = next(iter(sizes))
    if name.startswith("amplitude"):
        name = max((n for n in sizes if n.startswith("amplitude")), key=lambda n: abs(sizes[n].value))
    value = sizes[name]
    return f"{name.replace('_', ' ')} {quantity_text(value.value, value.unit)} (95 %: {interval_text(value)})"


def location_text(place: Location) -> str:
    """A place in words."""
    name = place.coordinate.replace("_", " ")
    return place.region if name == "crank angle" else f"{name}, strongest at {place.region}"


def file_name(source: str) -> str:
    """The last part of a path, or of several, of either kind of system."""
    return ", ".join(part.replace("\\", "/").rsplit("/", 1)[-1] for part in source.split(", "))


def cautions(d: Diagnosis) -> list[str]:
    """What a reader must mind before believing the numbers."""
    lines = [
        f"{effect.name}: {name.replace('_', ' ')} is {value.warning.replace('its bound', 'a bound of its range')}"
        + (
            f" ({quantity_text(value.value, value.unit)}): the true value may lie beyond"
            if "bound" in value.warning
            else f" ({interval_text(value)}): its size is hardly known"
        )
        for effect in d.effects
        for name, value in effect.parameters.items()
        if value.warning
    ]
    gap = d.gap
    if d.effects and gap.after >= gap.before:
        lines.append(
            f"the gap does not shrink ({gap.before:.3g} to {gap.after:.3g} N.m): the effect only shows "
            "against the scatter that the tolerances allow"
        )
    elif (
        d.effects
        and gap.held_out_after is not None
        and gap.held_out_before is not None
        and gap.held_out_after >= gap.held_out_before
    ):
        lines.append("on runs that the fit did not see the gap does not shrink")
    if d.verdict in ("named", "ambiguous", "none") and gap.after > LARGE_REST * gap.noise:
        own = gap.after_own_scatter
        why = (
            ""
            if own is None or own > 0.9 * gap.after
            else f"; without what this one drive's tolerances likely make, {own:.3g} N.m"
        )
        lines.append(
            f"the gap left, {gap.after:.3g} N.m, is {gap.after / max(gap.noise, 1e-300):.1f} times the noise{why}"
        )
    return lines
