"""Speeds from angles at uneven time stamps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.ndimage import median_filter

from stiffness_model.numerics.arrays import Array

MEDIAN_WINDOW = 31
"""Samples of the running median of the time step; chosen by judgement."""
SAMPLES_AFTER = 8
"""Time stamps after shared ones whose median step tells how far apart their samples are; chosen by judgement."""


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

    Time stamps that several samples share, as those of a coarse or late clock, are spread (`spread_stamps`).

    >>> central_speed(np.array([0.0, 1.0, 2.0, 3.0, 4.0]), np.array([0.0, 2.0, 2.0, 3.0, 4.0])).round(2).tolist()
    [1.0, 1.0, 1.0, 1.0, 1.0]
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
    """A signal (n,) at the instants of its time stamps (n,), s: repeated stamps are spread (`spread_stamps`), and those
    that are still much closer than their neighbours share one.

    >>> merged_stamps(np.array([0.0, 1.0, 3.0, 4.0]), np.array([0.0, 1.0, 1.000001, 2.0])).time.round(3).tolist()
    [0.0, 1.0, 1.5, 2.0]
    """
    time = spread_stamps(time)
    number = _numbers(time)
    count = np.bincount(number).astype(float)
    return Instants(np.bincount(number, time) / count, np.bincount(number, signal) / count, count, number)


def spread_stamps(time: Array) -> Array:
    """Time stamps (n,), s, of which those that several samples share are spread.

    A clock that is late, or coarse, gives several samples one stamp. They are taken to be as far apart as the samples
    after them and to end before the next stamp, but not to begin before the stamp that precedes them.

    >>> spread_stamps(np.array([0.0, 1.0, 1.0, 1.0, 1.1, 1.2])).round(3).tolist()
    [0.0, 0.8, 0.9, 1.0, 1.1, 1.2]
    """
    number = _numbers(time)
    count = np.bincount(number)
    if len(count) < 3 or len(count) == len(time):
        return time
    first = np.cumsum(count) - count
    stamp = time[first]
    each = np.diff(stamp) / count[:-1]
    padded = np.pad(each, (0, SAMPLES_AFTER + 1), mode="edge")
    after = np.median(sliding_window_view(padded, SAMPLES_AFTER), axis=1)[1 : len(count)]
    # The samples of the stamp before end as far before this one as they are apart.
    before = np.concatenate([[-np.inf], stamp[:-1] + (count[:-1] - 1) * each])[:-1]
    apart = np.minimum(after, (stamp[1:] - before) / (count[:-1] + 1))
    # After the last stamp there is none by which its samples could be spread.
    spread = (count[number] > 1) & (number < len(apart))
    of = number[spread]
    found = time.astype(float)
    found[spread] = stamp[of + 1] - (first[of + 1] - np.flatnonzero(spread)) * apart[of]
    return np.maximum.accumulate(found)


def _numbers(time: Array) -> NDArray[np.intp]:
    """(n,) numbers of the instants of time stamps (n,), s, where those much closer than their neighbours share one."""
    step = np.diff(time)
    number = np.zeros(len(time), np.intp)
    number[1:] = np.cumsum((step > 0) & (step > 0.5 * median_step(step)))
    return number
