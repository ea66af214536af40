"""Speeds from angles and time stamps that need not be even."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import median_filter

from stiffness_model.numerics.arrays import Array

MEDIAN_WINDOW = 31
"""Samples over which the usual step of time is taken."""


def median_step(step: Array) -> Array:
    """The usual one of the steps (n,), s, around each; a clock that stands still makes none."""
    goes = step > 0
    if not goes.any():
        return np.zeros(len(step))
    return np.asarray(median_filter(step[goes], MEDIAN_WINDOW, mode="nearest"))[np.maximum(np.cumsum(goes) - 1, 0)]


def central_speed(angle: Array, time: Array) -> Array:
    """Speed (n,), rad/s, of an angle (n,), rad, of one run: central differences over its time stamps (n,), s.

    Stamps far closer than those around, of a clock that is coarse or late, count as one: their difference is no time.

    >>> central_speed(np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 1.0, 1.000001, 2.0])).round(2)
    array([1.5, 1.5, 1.5, 1.5])
    """
    if len(time) < 2:
        return np.zeros(len(time))
    step = np.diff(time)
    index = np.concatenate([[0], np.cumsum((step > 0) & (step > 0.5 * median_step(step)))])
    count = np.bincount(index)
    if len(count) < 2:
        return np.zeros(len(time))
    return np.gradient(np.bincount(index, angle) / count, np.bincount(index, time) / count)[index]
