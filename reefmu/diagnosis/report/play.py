"""Without a drawing a clearance is no length of a part: it is given as the play, rad at the output, that it makes."""

from __future__ import annotations

from dataclasses import replace

from ..forward.base_curve import BaseCurve
from ..schema import NamedEffect, Value

_UNITS = {"m": "rad", "m/K": "rad/K", "m/rad": "1"}


def as_rotational_play(effect: NamedEffect, base: BaseCurve) -> NamedEffect:
    """The effect with its lengths as plays to either side, by the base's lever; as it is where there is a drawing.

    model.toml keeps the lengths, and states the lever beside them.
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
