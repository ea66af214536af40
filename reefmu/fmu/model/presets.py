"""Sets of parameter values for an FMU: mean and percentiles of the population, each effect small and large."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from reefmu.effects import Effect

    from .component import Component

SMALL, LARGE = 1 / 3, 3.0
"""Size of an effect in its presets, relative to its size in the model (to its nominal size where it is neutral there).
Chosen by judgement: half an order of magnitude to either side."""


class Preset(NamedTuple):
    """One set of parameter values. values: all tunable parameters of the drive by name, in their own units."""

    name: str
    description: str
    values: Mapping[str, float]


def presets(component: Component) -> tuple[Preset, ...]:
    """The presets of a component. Each contains every tunable parameter, so that one replaces another completely."""
    model = component.model
    start = {p.name: p.value for p in model.parameters if p.tunable}
    band = next(p for p in model.parameters if p.name == "band")
    sets = [Preset("mean", "The mean of the population", {**start, "band": 0.0})]
    if band.maximum != band.minimum:
        sets += [
            Preset("p10", "The 10th percentile of the torque over the population", {**start, "band": -1.0}),
            Preset("p90", "The 90th percentile of the torque over the population", {**start, "band": 1.0}),
        ]
    for effect in model.effects:
        for size, factor in (("small", SMALL), ("large", LARGE)):
            name, value = _sized(effect, start, factor)
            sets.append(
                Preset(
                    f"{effect.name}_{size}", f"{effect.title}: {size} ({name} = {value:.3g})", {**start, name: value}
                )
            )
    return tuple(sets)


def _sized(effect: Effect, start: Mapping[str, float], factor: float) -> tuple[str, float]:
    """The name of an effect's first parameter, which states its size, and its value in a preset, within its bounds."""
    parameter = effect.parameters[0]
    name = f"{effect.name}.{parameter.name}"
    value = factor * (start[name] if start[name] != parameter.neutral else parameter.nominal)
    return name, min(max(value, parameter.minimum), parameter.maximum)
