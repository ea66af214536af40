"""Sets of start values for an FMU: mean and percentiles of the population, each effect small and large, a load."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from stiffness_model.errors import InputError, expect

from .component import Component
from .start.start_parameters import START_TORQUE

if TYPE_CHECKING:
    from reefmu.effects import Effect

SMALL, LARGE = 1 / 3, 3.0
"""Size of an effect in its presets, relative to its size in the model (to its nominal size where it is neutral there).
Chosen by judgement: half an order of magnitude to either side."""
LOAD = 0.5
"""Load of the preset `loaded`, relative to the full torque; chosen by judgement."""


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


def loaded_start(component: Component, torque: float) -> dict[str, float]:
    """Start values by name for a start in equilibrium: the torque, and in a joint the torques that hold it.

    torque: of the drive on the output, N.m. Errors: `InputError` for a torque that the drive does not reach.
    """
    start = component.start
    assert start is not None
    u, p = np.array([float(signal.start) for signal in component.inputs]), component.parameter_vector()
    least, greatest = np.asarray(start.limits(u, p)).ravel().tolist()
    expect(least <= torque <= greatest, f"a torque from {least:.4g} to {greatest:.4g} N.m", f"{torque:g} N.m", "load")
    if component.kind == "drive":
        return {START_TORQUE: torque}
    p[start.search.torque] = torque
    outputs = np.asarray(component.output(component.initial(u, p), u, p)).ravel()
    at = {signal.name: float(value) for signal, value in zip(component.outputs, outputs, strict=True)}
    return {START_TORQUE: torque, "motor.tau": -at["crank.tau"], "load.tau": -at["output.tau"]}


def loaded_preset(component: Component, mean: Preset, torque: float) -> Preset:
    """The preset `mean` with the start values for a torque, N.m; errors as of `loaded_start`."""
    text = f"At rest under a load: the drive starts with {torque:.4g} N.m on the output"
    return mean._replace(name="loaded", description=text, values={**mean.values, **loaded_start(component, torque)})


def loaded_presets(component: Component, mean: Preset) -> tuple[Preset, ...]:
    """`loaded_preset` for half the full torque; none for a drive that does not reach it."""
    try:
        return (loaded_preset(component, mean, LOAD * component.full_torque),)
    except InputError:
        return ()
