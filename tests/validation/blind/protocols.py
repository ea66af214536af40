"""Test protocols of a rig: crank, load and temperature over time, in runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from .elements import Array

ROUNDS_OF_WEAR = 36
"""Turns of the output in the run with wear; after each of them an individual meets its first lobes again."""
ROTATION_SPEEDS = (0.5, 5.0, 50.0)
"""Speeds of the crank, rad/s."""


@dataclass(frozen=True)
class Schedule:
    """A test as the rig performs it, all arrays (n,).

    time: s, continuing over the pauses between runs; run: from 1; crank: rad; load: command to the loading device,
    1 for full torque; temperature: degC.
    """

    time: Array
    run: Array
    crank: Array
    load: Array
    temperature: Array

    @property
    def starts(self) -> Array:
        """Index of every run's first sample, and the number of samples."""
        return np.flatnonzero(np.diff(self.run, prepend=0, append=0))


Piece = tuple[Array, Array, Array]
"""Part of a run: time steps, s, crank, rad, and load."""


def _loops(
    crank: float, amplitudes: tuple[float, ...], period: float, cycles: int = 2, samples: int = 100, offset: float = 0.0
) -> Piece:
    """Loops about `offset` with the crank locked; the load is a triangle with slightly rounded peaks."""
    phase = 2 * np.pi * np.arange(1, cycles * samples + 1) / samples
    shape = np.arcsin(0.985 * np.sin(phase)) / np.arcsin(0.985)
    load = np.concatenate([a * shape + offset for a in amplitudes])
    return np.full(len(load), period / samples), np.full(len(load), crank), load


def _ramp(crank: float, start: float, end: float, duration: float, samples: int) -> Piece:
    part = np.arange(1, samples + 1) / samples
    return np.full(samples, duration / samples), np.full(samples, crank), start + (end - start) * part


def _turn(start: float, turns: float, speed: float, load: float, samples: int) -> Piece:
    """Rotation under a constant load, with a smooth start and stop over a tenth of the time each."""
    s = np.arange(1, samples + 1) / samples
    way = np.where(s < 0.1, s**2 / 0.2, np.where(s > 0.9, 0.9 - (1 - s) ** 2 / 0.2, s - 0.05)) / 0.9
    duration = abs(turns) * 2 * np.pi / speed / 0.9
    return np.full(samples, duration / samples), start + turns * 2 * np.pi * way, np.full(samples, load)


def _assemble(
    runs: list[list[Piece]],
    rng: np.random.Generator,
    warm: dict[int, tuple[float, float]] | None = None,
    pause: float = 20.0,
) -> Schedule:
    """Join runs; warm: temperatures, degC, at start and end of some runs, by index."""
    times, numbers, cranks, loads, temperatures = [], [], [], [], []
    now, room = 0.0, rng.uniform(19.5, 21.0)
    for number, pieces in enumerate(runs):
        steps, crank, load = (np.concatenate([piece[k] for piece in pieces]) for k in range(3))
        elapsed = np.cumsum(steps)
        begin, end = (warm or {}).get(number, (room, room + rng.uniform(0, 0.4)))
        times.append(now + elapsed)
        temperatures.append(begin + (end - begin) * (1 - np.exp(-2 * elapsed / elapsed[-1])) / (1 - np.exp(-2)))
        numbers.append(np.full(len(steps), number + 1))
        cranks.append(crank)
        loads.append(load)
        now += elapsed[-1] + pause * rng.uniform(0.5, 2.0)
    return Schedule(*(np.concatenate(a) for a in (times, numbers, cranks, loads, temperatures)))


def full(rng: np.random.Generator, ratio: int = 29) -> Schedule:
    """The full protocol: loops of four amplitudes at six crank angles, three rates, holds, rotation at three speeds in
    both senses under loads of both signs, a warm run and a run after many turns; about 12 000 samples.
    """
    angles = rng.uniform(0, 2 * np.pi) + 2 * np.pi * (np.arange(6) + rng.uniform(-0.15, 0.15, 6)) / 6
    period = rng.uniform(18, 30)
    runs = [[_loops(a, (0.12, 0.35, 0.65, 1.0), period)] for a in angles]
    runs.append([_loops(angles[0], (0.8,), p, samples=120) for p in (60.0, 6.0, 0.6)])
    runs.append(_holds(angles[0], rng.uniform(110, 160)))
    for speed in ROTATION_SPEEDS:
        for load in (0.5, -0.5):
            there = angles[0] + 4 * np.pi
            runs.append([_ramp(angles[0], 0, load, 4.0, 30), _turn(angles[0], 2, speed, load, 270)])
            runs.append([_ramp(there, 0, load, 4.0, 30), _turn(there, -2, speed, load, 270)])
    runs.append([_loops(angles[1], (0.65, 1.0), period, cycles=4)])
    turns = ROUNDS_OF_WEAR * ratio
    many = [_ramp(angles[0], 0, 0.3, 4.0, 20), _turn(angles[0], turns, 150.0, 0.3, 240)]
    after = angles[0] + 2 * np.pi * turns
    runs.append([*many, _ramp(after, 0.3, 0, 4.0, 20), _loops(after, (0.35, 0.65, 1.0), period)])
    warm = {len(runs) - 2: (rng.uniform(20, 24), rng.uniform(45, 60))}
    return _assemble(runs, rng, warm)


def _holds(crank: float, dwell: float) -> list[Piece]:
    pieces = []
    for load in (0.8, -0.8):
        pieces += [
            _ramp(crank, 0, load, 4.0, 20),
            _ramp(crank, load, load, dwell, 190),
            _ramp(crank, load, 0, 4.0, 20),
            _ramp(crank, 0, 0, 0.6 * dwell, 110),
        ]
    return pieces


def one_loop(rng: np.random.Generator, ratio: int = 29) -> Schedule:
    """Limited: three cycles of a single loop at one crank angle."""
    return _assemble([[_loops(rng.uniform(0, 6), (float(rng.uniform(0.7, 1.0)),), 25.0, cycles=3, samples=400)]], rng)


def one_sign(rng: np.random.Generator, ratio: int = 29) -> Schedule:
    """Limited: load in one direction only; loops at four angles, a hold and slow and fast rotation."""
    angles = rng.uniform(0, 2 * np.pi) + np.pi / 2 * np.arange(4)
    # The loops start unloaded and do not reverse the sign of the load.
    runs = [[_ramp(a, 0, 0.05, 1.0, 10), *(_pushes(a, s, 25.0) for s in (0.4, 0.7, 1.0))] for a in angles]
    runs.append(
        [
            _ramp(angles[0], 0, 0.8, 4.0, 20),
            _ramp(angles[0], 0.8, 0.8, 120.0, 190),
            _ramp(angles[0], 0.8, 0.05, 4.0, 20),
            _ramp(angles[0], 0.05, 0.05, 80.0, 110),
        ]
    )
    for speed in (0.5, 20.0):
        there = angles[0] + 4 * np.pi
        runs.append([_ramp(angles[0], 0, 0.5, 4.0, 30), _turn(angles[0], 2, speed, 0.5, 270)])
        runs.append([_ramp(there, 0, 0.5, 4.0, 30), _turn(there, -2, speed, 0.5, 270)])
    return _assemble(runs, rng)


def _pushes(crank: float, top: float, period: float) -> Piece:
    """Two cycles between 0.05 and `top`."""
    phase = 2 * np.pi * np.arange(1, 201) / 100
    load = 0.05 + (top - 0.05) * (1 - np.cos(phase)) / 2
    return np.full(200, period / 100), np.full(200, crank), load


def one_speed(rng: np.random.Generator, ratio: int = 29) -> Schedule:
    """Limited: loops at two angles at one rate, rotation in one sense at one speed."""
    angles = rng.uniform(0, 2 * np.pi) + np.array([0.0, 2.2])
    runs = [[_loops(a, (0.35, 0.7, 1.0), 25.0)] for a in angles]
    runs.append([_ramp(angles[0], 0, 0.5, 4.0, 30), _turn(angles[0], 2, 5.0, 0.5, 400)])
    return _assemble(runs, rng)


def locked(rng: np.random.Generator, ratio: int = 29) -> Schedule:
    """Loops, rates and holds in a single run with the crank locked at 0, for records without a crank or run column."""
    loops = [_loops(0.0, (0.12, 0.35, 0.65, 1.0), 25.0), *(_loops(0.0, (0.8,), p) for p in (60.0, 6.0, 0.6))]
    return _assemble([[*loops, *_holds(0.0, 130.0)]], rng)


PROTOCOLS: dict[str, Callable[[np.random.Generator, int], Schedule]] = {
    f.__name__: f for f in (full, one_loop, one_sign, one_speed, locked)
}
POOR = ("one_loop", "one_sign", "one_speed")
