"""The effects inside a model: those that the caller names and those that the drive's own data state."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from stiffness_model.kinds import AnyDrive, kind_of

from ..effects import Effect, Place, find_effect
from .signals import Signal
from .stages.order import stored_angles

NEED_PARTS = (Place.MODULUS, Place.ELEMENT)
"""Places of effects that are computed from the parts of a drawing."""


def in_order(names: Iterable[str]) -> tuple[Effect, ...]:
    """The effects of these names in the order of their places along the drive. Raises `UnknownNameError`.

    >>> [effect.name for effect in in_order(["hysteresis", "backlash"])]
    ['backlash', 'hysteresis']
    """
    places = list(Place)
    return tuple(sorted((find_effect(name) for name in names), key=lambda e: (places.index(e.place), e.name)))


def chosen_values(
    inherent: Mapping[str, Mapping[str, float]], given: Mapping[str, Mapping[str, float]]
) -> dict[str, Mapping[str, float]]:
    """Parameter values of the effects inside: those given, and the inherent values of what is not given.

    An effect that is given without any value is neutral.

    >>> chosen_values({"crank_friction": {"fraction": 0.1}}, {"crank_friction": {"viscous": 1e-4}, "damping": {}})
    {'crank_friction': {'fraction': 0.1, 'viscous': 0.0001}, 'damping': {}}
    """
    merged = {name: {**inherent.get(name, {}), **values} if values else values for name, values in given.items()}
    return {**inherent, **merged}


def inherent_effects(drive: AnyDrive) -> dict[str, dict[str, float]]:
    """Parameter values of the effects that the drive's own data state, by effect and parameter name."""
    kind = kind_of(drive)
    return kind.call("inherent_effects", drive) if kind.inherent_effects else {}


def undiagnosed_effects(drive: AnyDrive) -> dict[str, dict[str, float]]:
    """Those of `inherent_effects` that no record can show, so that a corrected model keeps them."""
    return {name: p for name, p in inherent_effects(drive).items() if find_effect(name).identification.not_a_candidate}


def state_signals(effects: tuple[Effect, ...]) -> tuple[Signal, ...]:
    """The states of a model with these effects: the last values of the angles that states evolve along, then the
    effects' own."""
    last = tuple(
        Signal(
            f"last.{angle.value}",
            "rad",
            "Twist at the last step"
            if angle.value == "twist"
            else f"{angle.value.capitalize()} angle at the last step",
        )
        for angle in stored_angles(effects)
    )
    return last + tuple(Signal(f"{e.name}.{s.name}", s.unit, s.description) for e in effects for s in e.states)
