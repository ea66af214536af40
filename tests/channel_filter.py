"""A first-order low-pass filter of sampled signals, exact where they are linear between samples."""

from __future__ import annotations

import itertools
from dataclasses import replace

import numpy as np
from scipy.signal import cont2discrete, lfilter, lfiltic

from reefmu.record import Record
from stiffness_model.numerics.arrays import Array


def filtered(values: Array, step: float, time_constant: float) -> Array:
    """(n,) of values (n,) at equal steps, s, that stood at the first one before."""
    numerator, denominator, _ = cont2discrete(([1.0], [time_constant, 1.0]), step, "foh")
    numerator = np.ravel(numerator)
    state = lfiltic(numerator, denominator, [values[0]], [values[0]])
    return np.asarray(lfilter(numerator, denominator, values, zi=state)[0], float)


def with_filtered_channels(record: Record, time_constant: float) -> Record:
    """The record with angles and torque filtered, run by run; each run has equal steps of time."""
    edges = [*record.starts.tolist(), len(record)]

    def channel(values: Array) -> Array:
        parts = [slice(a, b) for a, b in itertools.pairwise(edges)]
        steps = [float(np.median(np.diff(record.time[part]))) for part in parts]
        return np.concatenate(
            [filtered(values[part], step, time_constant) for part, step in zip(parts, steps, strict=True)]
        )

    return replace(
        record,
        crank_angle=channel(record.crank_angle),
        output_angle=channel(record.output_angle),
        output_torque=channel(record.output_torque),
    )
