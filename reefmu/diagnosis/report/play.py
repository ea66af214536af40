"""Clearances without a drawing: given as the play that they make, an angle at the output, instead of a length."""

from __future__ import annotations

from dataclasses import replace

from ..forward.base_curve import BaseCurve
from ..schema import NamedEffect, Value

_UNITS = {"m": "rad", "m/K": "rad/K", "m/rad": "1"}


def as_rotational_play(effect: NamedEffect, base: BaseCurve) -> NamedEffect:
    """The effect with its clearances, m, as play to either side, rad; unchanged where there is a drawing.

    model.toml keeps the clearances and states the lever between the two.
    """
    if base.kind == "drawing":
        return effect

    def turned(v: Value) -> Value:
        return replace(
            v, value=v.value / base.lever, low=v.low / base.lever, high=v.high / base.lever, unit=_UNITS[v.unit]
        )

    return replace(
        effect, parameters={name: turned(v) if v.unit in _UNITS else v for name, v in effect.parameters.items()}
    )
