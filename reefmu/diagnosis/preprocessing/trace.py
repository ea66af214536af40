"""What the effects see of a record: angles, speeds and paths over n samples, thinned for the search.

Directions and ways travelled are taken from smoothed angles: with the noise of an encoder in them a path
grows although nothing moves. The elastic torque sees the angles as measured.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...record import Record
from .motion import angle_noise, estimate_speed, monotone_path


@dataclass(frozen=True)
class Trace:
    """Signals over n samples, all (n,), SI units and degC.

    start: first samples of runs; step: time since the sample before, s, never negative; twist: as measured, rad;
    smooth_twist, crank, output: paths without their noise, see `motion`; *_speed, twist_rate: rad/s; torque: measured,
    N.m.
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
    twist_rate: Array
    torque: Array
    ratio: float

    def __len__(self) -> int:
        return len(self.time)

    @cached_property
    def first(self) -> NDArray[np.bool_]:
        """The record's first sample."""
        return np.arange(len(self)) == 0

    @cached_property
    def crank_direction(self) -> Array:
        """Sign of the crank's motion since the sample before."""
        return np.sign(np.where(self.start, 0.0, np.diff(self.crank, prepend=self.crank[0])))

    @cached_property
    def output_direction(self) -> Array:
        """Sign of the output's motion since the sample before."""
        return np.sign(np.where(self.start, 0.0, np.diff(self.output, prepend=self.output[0])))

    @property
    def run_ranges(self) -> list[tuple[int, int]]:
        """First and past-the-last index of every run."""
        edges = [*np.flatnonzero(self.start).tolist(), len(self)]
        return list(itertools.pairwise(edges))


def make_trace(record: Record, ratio: float) -> Trace:
    """The signals of a record; paths and speeds without the noise of the angles."""
    start = np.zeros(len(record), bool)
    start[record.starts] = True
    run_ranges = list(itertools.pairwise([*record.starts.tolist(), len(record)]))
    twist = record.twist(ratio)
    angles = {"crank": record.crank_angle, "output": record.output_angle, "twist": twist}
    noise = {name: angle_noise(angle, run_ranges) for name, angle in angles.items()}
    path, speed = {}, {}
    for name, angle in angles.items():
        parts = [slice(a, b) for a, b in run_ranges]
        path[name] = np.concatenate([monotone_path(angle[p], noise[name]) for p in parts])
        speed[name] = np.concatenate([estimate_speed(angle[p], record.time[p], noise[name]) for p in parts])
    step = np.maximum(np.diff(record.time, prepend=record.time[0]), 0.0)
    return Trace(
        record.time,
        record.run,
        start,
        step,
        path["crank"],
        speed["crank"],
        path["output"],
        speed["output"],
        record.temperature,
        twist,
        path["twist"],
        speed["twist"],
        record.output_torque,
        ratio,
    )


@dataclass(frozen=True)
class Blocks:
    """Neighbouring samples taken together: first sample and number of samples of each block."""

    first: NDArray[np.intp]
    count: Array

    def mean(self, values: Array) -> Array:
        """Means over the blocks of values (n,)."""
        return np.add.reduceat(values, self.first) / self.count


def make_blocks(trace: Trace, samples: int) -> Blocks:
    """Blocks of `samples` samples, the last of a run with what is left."""
    first = np.concatenate([np.arange(a, b, samples) for a, b in trace.run_ranges])
    # A tail of a few samples joins its neighbour.
    tail = np.diff(first, append=len(trace)) < max(1, samples // 2)
    first = first[~tail | trace.start[first]]
    return Blocks(first, np.diff(first, append=len(trace)).astype(float))
