"""Synthetic records of a gear with known play, friction and stiffness at a locked output, for tests of comparisons."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from reefmu.record import Record, make_record
from stiffness_model.numerics.arrays import Array

AMPLITUDE = 25.0
"""N.m, of large cycles."""


@dataclass(frozen=True)
class Gear:
    """play: rad, to either side; friction: N.m, without load; loss: its growth over the load; stiffness: N.m/rad;
    noise: N.m, of the torque; stick: rad, distance between the places at which the motor sticks."""

    play: float = 0.02
    friction: float = 2.0
    loss: float = 0.1
    stiffness: float = 400.0
    noise: float = 0.2
    stick: float = 0.0


def ramp(amplitude: float, n: int) -> Array:
    """Torque (n,), N.m, from zero to either amplitude and back."""
    return amplitude * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * np.linspace(0, 1, n)))


def twist_of(gear: Gear, torque: Array, start: float = 0.0) -> Array:
    """Twist (n,), rad, under a motor's torque (n,), N.m: it moves only where the torque exceeds the friction."""
    span = 2 * AMPLITUDE / gear.stiffness + gear.play
    grid = np.arange(-span, span, gear.stick) if gear.stick else np.linspace(-span, span, 4001)
    load = gear.stiffness * (np.maximum(grid - gear.play, 0) + np.minimum(grid + gear.play, 0))
    friction = gear.friction + gear.loss * np.abs(load)
    # Within the play the load does not order the places; a slope of a millionth does.
    upper, lower = load + friction + 1e-6 * grid, load - friction + 1e-6 * grid
    upper, lower = np.maximum.accumulate(upper), np.maximum.accumulate(lower)
    lowest = np.searchsorted(upper, torque).tolist()
    highest = np.searchsorted(lower, torque, side="right").tolist()
    places, place = [], int(np.abs(grid - start).argmin())
    for least, most in zip(lowest, highest, strict=True):
        place = min(max(place, least), most, len(grid) - 1)
        places.append(place)
    return grid[places]


def measured(
    gear: Gear, seed: int = 0, large: int = 3, small: int = 0, small_amplitude: float = 3.0, n: int = 1500
) -> Record:
    """A record of `small` and then `large` cycles, each a run of `n` samples, with noise of the torque."""
    rng = np.random.default_rng(seed)
    columns: dict[str, list[Array]] = {"time": [], "run": [], "twist": [], "output_torque": []}
    for run, amplitude in enumerate([small_amplitude] * small + [AMPLITUDE] * large):
        torque = ramp(amplitude * rng.uniform(0.98, 1.0), n)
        columns["twist"].append(twist_of(gear, torque))
        columns["output_torque"].append(torque + gear.noise * rng.standard_normal(n))
        columns["time"].append(10.0 * run + np.linspace(0, 8, n))
        columns["run"].append(np.full(n, float(run)))
    return make_record({name: np.concatenate(parts) for name, parts in columns.items()}, f"synthetic-{seed}")
