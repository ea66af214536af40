"""Sampling of a record: rates, clock, gaps, ranges and quantisation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..diagnosis.preprocessing.audit import TIME_RESOLUTION, count_gaps
from ..record import Record

SHARED_STAMPS = 0.1
"""Share of samples with the time stamp of the one before from which the clock counts as coarse. Chosen by judgement."""
IRREGULAR_SHARE = 0.2
"""Deviation of the 5th or 95th percentile of the time steps from their median, over it, from which sampling counts as
irregular. Chosen by judgement."""
QUANTISED_SHARE = 0.5
"""Distinct values over the number of samples above which a signal is not examined for steps. Chosen by judgement."""
STEP_TOLERANCE, MAX_MULTIPLE = 0.05, 20
"""Deviation of the distances of levels from whole steps, in steps, within which a signal is quantised, and the number
of steps up to which distances are examined. Chosen by judgement: decimal places of the file leave less."""


@dataclass(frozen=True)
class RunSummary:
    """run: its number; samples; duration: s; twist, torque: least and greatest value, rad and N.m."""

    run: int
    samples: int
    duration: float
    twist: tuple[float, float]
    torque: tuple[float, float]


@dataclass(frozen=True)
class Sampling:
    """rate: Hz, samples over duration, median over the runs; step: s, median time between different stamps;
    longest_step: s; shared_stamps: share of samples with the stamp of the one before; irregular: whether the steps
    differ; gaps: number of steps within runs that are gaps by the rule of the diagnosis."""

    rate: float
    step: float
    longest_step: float
    shared_stamps: float
    irregular: bool
    gaps: int

    @property
    def coarse_clock(self) -> bool:
        """Whether several samples share a time stamp."""
        return self.shared_stamps > SHARED_STAMPS


def sampling(record: Record) -> Sampling:
    """The sampling of a record within its runs."""
    runs = [time for time in np.split(record.time, record.starts[1:]) if np.ptp(time) > TIME_RESOLUTION]
    if not runs:
        return Sampling(0.0, 0.0, 0.0, 1.0, False, 0)
    # Every run has a rate of its own.
    steps = [np.diff(time) for time in runs]
    moving = [step[step > TIME_RESOLUTION] for step in steps]
    low, high = np.quantile(np.concatenate([step / np.median(step) for step in moving]), [0.05, 0.95])
    different = np.concatenate(moving)
    return Sampling(
        float(np.median([(len(time) - 1) / float(np.ptp(time)) for time in runs])),
        float(np.median(different)),
        float(different.max()),
        1 - different.size / sum(step.size for step in steps),
        bool(max(1 - low, high - 1) > IRREGULAR_SHARE),
        count_gaps(record),
    )


def run_summaries(record: Record, twist: Array) -> tuple[RunSummary, ...]:
    """The runs of a record with its twist (n,), rad, in the order of time."""
    parts = np.split(np.arange(len(record)), record.starts[1:])
    return tuple(
        RunSummary(
            int(record.run[index[0]]),
            len(index),
            float(np.ptp(record.time[index])),
            value_range(twist[index]),
            value_range(record.output_torque[index]),
        )
        for index in parts
    )


def value_range(values: Array) -> tuple[float, float]:
    """Least and greatest of values (n,)."""
    return float(values.min()), float(values.max())


def quantisation_step(values: Array) -> float | None:
    """The step of which all differences of values (n,) are multiples, or None for a signal without steps.

    >>> float(round(quantisation_step(0.1 + 0.25 * np.array([0, 1, 1, 3, 3, 7, 7, 1])), 6))
    0.25
    """
    levels = np.unique(values)
    if levels.size < 2 or levels.size > QUANTISED_SHARE * len(values):
        return None
    # Levels that differ by rounding are one level.
    distances = np.diff(levels)
    distances = distances[distances > 1e-9 * float(np.abs(levels).max())]
    if not distances.size:
        return None
    smallest = float(distances.min())
    # The mean of the steps of one is free of the rounding of the file.
    step = float(distances[distances < 1.5 * smallest].mean())
    multiples = distances / step
    near = multiples[multiples < MAX_MULTIPLE]
    return step if np.abs(near - np.round(near)).max() < STEP_TOLERANCE else None
