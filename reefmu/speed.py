"""Speeds from angles at uneven time stamps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from stiffness_model.numerics.arrays import Array

MEDIAN_WINDOW = 31
"""Samples of the running median of the time step; chosen by judgement."""


def median_step(step: Array) -> Array:
    """Running median (n,) of the time steps (n,), s; steps of zero, of a clock that stands still, do not count."""
    positive = step > 0
    if not positive.any():
        return np.zeros(len(step))
    return np.asarray(median_filter(step[positive], MEDIAN_WINDOW, mode="nearest"))[
        np.maximum(np.cumsum(positive) - 1, 0)
    ]


def central_speed(angle: Array, time: Array) -> Array:
    """Speed (n,), rad/s, of an angle (n,), rad, of one run: central differences over its time stamps (n,), s.

    Time stamps much closer than their neighbours, as of a coarse or late clock, are merged: their difference is no
    measure of time.

    >>> central_speed(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1.0, 1.000001, 2.0])).round(2)
    array([1.5, 1.5, 1.5, 1.5])
    """
    at = merged_stamps(angle, time)
    if len(at.time) < 2:
        return np.zeros(len(time))
    return np.gradient(at.values, at.time)[at.number]


class Instants(NamedTuple):
    """A signal at the k instants of n time stamps.

    time: (k,) s; values: (k,), means of the signal; stamps: (k,), how many each has; number: (n,), of the instant of
    every stamp.
    """

    time: Array
    values: Array
    stamps: Array
    number: NDArray[np.intp]


def merged_stamps(signal: Array, time: Array) -> Instants:
    """A signal (n,) at the instants of its time stamps (n,), s: stamps much closer than their neighbours share one.

    >>> merged_stamps(np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 1.0, 1.000001, 2.0])).values.tolist()
    [0.0, 2.0, 4.0]
    """
    step = np.diff(time)
    number = np.zeros(len(time), np.intp)
    number[1:] = np.cumsum((step > 0) & (step > 0.5 * median_step(step)))
    count = np.bincount(number).astype(float)
    return Instants(np.bincount(number, time) / count, np.bincount(number, signal) / count, count, number)
