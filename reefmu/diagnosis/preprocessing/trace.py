"""Signals that the effects depend on: angles, speeds and paths over n samples, and blocks of samples.

Directions and paths come from angles without noise: the noise of an encoder would lengthen a path although nothing
moves. The elastic torque depends on the twist as measured.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...effects import IndependentVariable
from ...record import Record
from .motion import estimate_rate, estimate_speed, monotone_path, signal_noise


@dataclass(frozen=True)
class Trace:
    """Signals over n samples, (n,) each, in SI units and degC.

    start: whether a sample is the first of its run; step: s, time since the sample before, never negative; twist: rad,
    as measured; smooth_twist, crank, output: rad, paths without noise (see `motion`); *_speed, twist_rate: rad/s;
    torque: N.m, as measured; torque_rate: N.m/s, of the torque without noise; ratio: signed, None where it is not
    known: the crank then stands still, or its angle and speed are referred to the output; friction: (runs,) share of
    the friction along an angle that is built up when a run starts, -1 to 1, by angle; none where it is not given.
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
    torque_rate: Array
    ratio: float | None
    friction: Mapping[IndependentVariable, Array] = field(default_factory=dict)

    def __len__(self) -> int:
        return len(self.time)

    @property
    def crank_factor(self) -> float:
        """The crank's angle over the same angle referred to the output: the ratio, where it is known."""
        return 1.0 if self.ratio is None else self.ratio

    @cached_property
    def first(self) -> NDArray[np.bool_]:
        """(n,), whether a sample is the first of the record."""
        return np.arange(len(self)) == 0

    @cached_property
    def crank_direction(self) -> Array:
        """(n,) sign of the crank's motion since the sample before."""
        return self._direction(self.crank)

    @cached_property
    def output_direction(self) -> Array:
        """(n,) sign of the output's motion since the sample before."""
        return self._direction(self.output)

    @cached_property
    def twist_direction(self) -> Array:
        """(n,) sign of the twist's change since the sample before."""
        return self._direction(self.smooth_twist)

    def _direction(self, path: Array) -> Array:
        return np.sign(np.where(self.start, 0.0, np.diff(path, prepend=path[0])))

    @property
    def run_ranges(self) -> list[tuple[int, int]]:
        """First and past-the-last index of every run."""
        edges = [*np.flatnonzero(self.start).tolist(), len(self)]
        return list(itertools.pairwise(edges))


def make_trace(record: Record, ratio: float | None) -> Trace:
    """The signals of a record of a gear with a signed transmission ratio, None where it is not known."""
    start = np.zeros(len(record), bool)
    start[record.starts] = True
    run_ranges = list(itertools.pairwise([*record.starts.tolist(), len(record)]))
    twist = record.twist(ratio)
    angles = {"crank": record.crank_angle, "output": record.output_angle}
    path = {name: _path(angle, run_ranges) for name, angle in (angles | {"twist": twist}).items()}
    speed = {name: _by_run(estimate_speed, angle, record.time, run_ranges) for name, angle in angles.items()}
    step = np.maximum(np.diff(record.time, prepend=record.time[0]), 0.0)
    return Trace(
        time=record.time,
        run=record.run,
        start=start,
        step=step,
        crank=path["crank"],
        crank_speed=speed["crank"],
        output=path["output"],
        output_speed=speed["output"],
        temperature=record.temperature,
        twist=twist,
        smooth_twist=path["twist"],
        twist_rate=_by_run(estimate_rate, twist, record.time, run_ranges),
        torque=record.output_torque,
        torque_rate=_by_run(estimate_rate, record.output_torque, record.time, run_ranges),
        ratio=ratio,
    )


def _path(angle: Array, run_ranges: list[tuple[int, int]]) -> Array:
    noise = signal_noise(angle, run_ranges)
    return np.concatenate([monotone_path(angle[a:b], noise) for a, b in run_ranges])


def _by_run(
    rate: Callable[[Array, Array, float], Array], signal: Array, time: Array, run_ranges: list[tuple[int, int]]
) -> Array:
    noise = signal_noise(signal, run_ranges)
    return np.concatenate([rate(signal[a:b], time[a:b], noise) for a, b in run_ranges])


@dataclass(frozen=True)
class Blocks:
    """Consecutive samples that are averaged: first sample (n,) and number of samples (n,) of each block."""

    first: NDArray[np.intp]
    count: Array

    def mean(self, values: Array) -> Array:
        """Means (n,) over the blocks of values of all samples."""
        return np.add.reduceat(values, self.first) / self.count

    def spread(self, values: NDArray[Any]) -> NDArray[Any]:
        """The values (n,) of the blocks at all their samples."""
        return np.repeat(values, self.count.astype(np.intp))

    def span(self, values: Array) -> Array:
        """(n,) greatest less least of the values of all samples in each block."""
        return np.maximum.reduceat(values, self.first) - np.minimum.reduceat(values, self.first)


def make_blocks(trace: Trace, samples: int) -> Blocks:
    """Blocks of `samples` samples within the runs; a remainder of less than half of that joins the block before."""
    first = np.concatenate([np.arange(a, b, samples) for a, b in trace.run_ranges])
    tail = np.diff(first, append=len(trace)) < max(1, samples // 2)
    first = first[~tail | trace.start[first]]
    return Blocks(first, np.diff(first, append=len(trace)).astype(float))
