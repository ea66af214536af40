"""What the effects see of a record: angles, speeds and paths over n samples, thinned for the search.

Directions and ways travelled are taken from smoothed angles: with the noise of an encoder in them a path
grows although nothing moves. The elastic torque sees the angles as measured.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.ndimage import uniform_filter1d

from ..record import Record

Array = NDArray[np.float64]

STILL = 3.5
"""Play, over the twist's noise, with which paths follow the twist."""
PIECES = ((24, 1.2), (12, 1.5), (8, 1.8))
"""Samples of the pieces in which the twist's noise is looked for, and the share of it that each sees, inverted."""


@dataclass(frozen=True)
class Trace:
    """Signals over n samples, all (n,), SI units and degC.

    start: first samples of runs; step: time since the sample before, s, never negative; twist: as measured, rad;
    smooth_twist: with most of its noise taken out; torque: measured, N.m; play: rad, within which the twist's jitter
    moves no path. crank and output are smooth, and the output follows with that play.
    """

    time: Array
    run: NDArray[np.int64]
    start: NDArray[np.bool_]
    step: Array
    crank: Array
    crank_speed: Array
    output: Array
    output_speed: Array
    temperature: Array
    twist: Array
    smooth_twist: Array
    torque: Array
    ratio: float
    play: float = 0.0

    def __len__(self) -> int:
        return len(self.time)

    @cached_property
    def first(self) -> NDArray[np.bool_]:
        """The record's first sample."""
        return np.arange(len(self)) == 0

    @cached_property
    def twist_rate(self) -> Array:
        """rad/s."""
        return self.crank_speed / self.ratio - self.output_speed

    @cached_property
    def crank_direction(self) -> Array:
        """Sign of the crank's motion since the sample before."""
        return np.sign(np.where(self.start, 0.0, np.diff(self.crank, prepend=self.crank[0])))

    @cached_property
    def output_direction(self) -> Array:
        """Sign of the output's motion since the sample before."""
        return np.sign(np.where(self.start, 0.0, np.diff(self.output, prepend=self.output[0])))

    def path(self, shift: Array | float) -> tuple[Array, NDArray[np.intp]]:
        """The path (n,), rad, that the smooth twist less `shift` goes, and the sample (n,) at which each value was
        last moved: where the twist only jitters, the path stands still."""
        return followed(self.smooth_twist - shift, self.play)

    @property
    def bounds(self) -> list[tuple[int, int]]:
        """First and past-the-last index of every run."""
        edges = [*np.flatnonzero(self.start).tolist(), len(self)]
        return list(itertools.pairwise(edges))


def trace_of(record: Record, ratio: float, window: int = 1) -> Trace:
    """The signals of a record; window: samples over which paths are smoothed (1: not at all)."""
    start = np.zeros(len(record), bool)
    start[record.starts] = True
    bounds = list(itertools.pairwise([*record.starts.tolist(), len(record)]))
    crank, output = record.crank_angle.copy(), record.output_angle.copy()
    crank_speed, output_speed = np.zeros(len(record)), np.zeros(len(record))
    width = STILL * twist_noise(record, ratio) / window**0.5
    for a, b in bounds:
        part = slice(a, b)
        if b - a < 3:
            continue
        crank[part], output[part] = smoothed(crank[part], window), smoothed(output[part], window)
        crank_speed[part] = _speed(crank[part], record.time[part], window)
        output_speed[part] = _speed(output[part], record.time[part], window)
    step = np.maximum(np.diff(record.time, prepend=record.time[0]), 0.0)
    smooth = crank / ratio - output
    crank, output = turned(record.output_angle, crank, followed(smooth, width)[0], ratio)
    return Trace(record.time, record.run, start, step, crank, crank_speed, output, output_speed,
                 record.temperature, record.twist(ratio), smooth, record.output_torque, ratio, width)


def turned(measured_output: Array, crank: Array, twist: Array, ratio: float) -> tuple[Array, Array]:
    """Crank and output angle (n,) that give a twist: the output moves, or the crank where the output is locked."""
    if np.ptp(measured_output) == 0 and np.ptp(crank) > 0:
        return ratio * (twist + measured_output), measured_output
    return crank, crank / ratio - twist


def followed(path: Array, width: float) -> tuple[Array, NDArray[np.intp]]:
    """A path (n,) followed with a play of `width` to either side, and the sample (n,) at which each value was moved.

    It stands still until it is pulled along.

    >>> followed(np.array([0.0, 0.1, -0.1, 1.0, 0.9, 0.0]), 0.2)[0].tolist()
    [0.0, 0.0, 0.0, 0.8, 0.8, 0.2]
    """
    if width <= 0:
        return path, np.arange(len(path))
    at, moved = float(path[0]), 0
    found, last = [], []
    for k, value in enumerate(path.tolist()):
        if value - at > width:
            at, moved = value - width, k
        elif at - value > width:
            at, moved = value + width, k
        found.append(at)
        last.append(moved)
    return np.array(found), np.array(last, dtype=np.intp)


def twist_noise(record: Record, ratio: float) -> float:
    """Standard deviation, rad, of the twist's jitter where it moves evenly: the calmest of short pieces.

    A parabola is taken out of each piece, so that even motion does not count, and with it some of a slow noise, for
    which the factors of `PIECES` make up. On records with a noise of known size, its autocorrelation 0 to 0.97, the
    result is 0.6 to 1.5 times the truth.
    """
    twist = record.twist(ratio)
    found = []
    for samples, factor in PIECES:
        if len(twist) < samples:
            continue
        run = sliding_window_view(record.run, samples)[::samples // 2]
        pieces = sliding_window_view(twist, samples)[::samples // 2][run[:, 0] == run[:, -1]]
        if len(pieces):
            k = np.linspace(-1, 1, samples)
            basis = np.linalg.qr(np.stack([np.ones(samples), k, k * k], axis=1))[0]
            left = pieces - pieces @ basis @ basis.T
            found.append(factor * float(np.quantile(np.sqrt((left**2).sum(axis=1) / (samples - 3)), 0.05)))
    return min(found, default=0.0)


def smoothed(values: Array, window: int) -> Array:
    """Two passes of a moving mean, mirrored through the ends; a straight line stays what it is."""
    n = len(values)
    width = min(window, n)
    if width <= 1:
        return values.copy()
    pad = width
    index = np.arange(-pad, n + pad)
    mirrored = np.abs(index)
    mirrored = np.minimum(mirrored, 2 * (n - 1) - mirrored).clip(0, n - 1)
    wide = values[mirrored]
    # Odd about the ends: a ramp goes on.
    wide = np.where(index < 0, 2 * values[0] - wide, np.where(index >= n, 2 * values[-1] - wide, wide))
    for _ in range(2):
        wide = uniform_filter1d(wide, width, mode="nearest")
    return wide[pad:pad + n]


def _speed(angle: Array, time: Array, window: int) -> Array:
    # Repeated time stamps of a coarse clock must not divide by zero: differences go over distinct times.
    distinct, index = np.unique(time, return_inverse=True)
    if len(distinct) < 2:
        return np.zeros_like(angle)
    mean = np.bincount(index, angle) / np.bincount(index)
    return smoothed(np.gradient(mean, distinct)[index], window)


@dataclass(frozen=True)
class Blocks:
    """Neighbouring samples taken together: first sample and number of samples of each block."""

    first: NDArray[np.intp]
    count: Array

    def mean(self, values: Array) -> Array:
        """Means over the blocks of values (n,)."""
        return np.add.reduceat(values, self.first) / self.count


def blocks_of(trace: Trace, samples: int) -> Blocks:
    """Blocks of `samples` samples, the last of a run with what is left."""
    first = np.concatenate([np.arange(a, b, samples) for a, b in trace.bounds])
    # A tail of a few samples joins its neighbour.
    tail = np.diff(first, append=len(trace)) < max(1, samples // 2)
    first = first[~tail | trace.start[first]]
    return Blocks(first, np.diff(first, append=len(trace)).astype(float))


def select(trace: Trace, keep: NDArray[np.bool_]) -> Trace:
    """Whole runs of a trace: `keep` (n,) must be the same for all samples of a run."""
    values = {name: getattr(trace, name)[keep] for name in trace.__dataclass_fields__ if name not in ("ratio", "play")}
    return Trace(**values, ratio=trace.ratio, play=trace.play)
