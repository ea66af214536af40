"""Clearances without a drawing: given as the play that they make, an angle at the output, instead of a length."""

from __future__ import annotations

from dataclasses import replace

from ..fitted_values import NamedEffect, Value
from ..forward.base_curve import BaseCurve

_UNITS = {"m": "rad", "m/K": "rad/K", "m/rad": "1"}


def as_rotational_play(effect: NamedEffect, base: BaseCurve) -> NamedEffect:
    """The effect with its clearances, m, as play to either side, rad; unchanged where there is a drawing.

    model.toml keeps the clearances and states the lever between the two.
    """

    def turned(v: Value) -> Value:
        factor, unit = rotational_play(v.unit, base)
        return replace(v, value=factor * v.value, low=factor * v.low, high=factor * v.high, unit=unit)

    return replace(effect, parameters={name: turned(v) for name, v in effect.parameters.items()})


def rotational_play(unit: str, base: BaseCurve) -> tuple[float, str]:
    """Factor and unit in which a parameter of this unit is given: those of an angle for a clearance without a
    drawing."""
    if base.kind == "drawing" or unit not in _UNITS:
        return 1.0, unit
    return 1 / base.lever, _UNITS[unit]
