"""True motion behind noisy angles: paths that turn only where the drive did, and speeds.

Friction lives on the path that is rubbed along. Where a drive stands or turns under a steady load its twist does not
move, but its measured noise goes to and fro, and would rub a state away that in truth stays. So a path is monotone
(isotonic regression) between turning points, and a turning point is one where the angle comes back by more than noise
could. A speed is a slope over the shortest window in which motion shows above the noise.
"""

from __future__ import annotations

import itertools

import numpy as np
from scipy.optimize import isotonic_regression
from scipy.signal import savgol_filter

from stiffness_model.numerics.arrays import Array

from ...speed import central_speed, median_step

REVERSAL_DEVIATIONS = 8.0
"""Way back, in standard deviations of the noise, that makes a turning point: some hundred samples of noise span 6."""
MAX_REVERSAL_SHARE = 0.05
"""The same at most, as a share of the whole way."""
MIN_DWELL = 12
"""Samples near a turning point from which on the angle stood there; its level is then their median."""
WINDOWS = (3, 5, 9, 17, 33, 65)
NOISE_FREE = 1e-6
"""Noise over the whole way below which an angle counts as free of it."""
SIGNIFICANT_SLOPE = 8.0
"""Slope over its standard deviation at which motion shows."""


def angle_noise(angle: Array, runs: list[tuple[int, int]]) -> float:
    """Standard deviation, rad, of what is rough in an angle (n,), over the runs `runs`.

    Third differences, over every other sample since encoders remember the last, of white noise have 20 times its
    variance; motion is smoother than that nearly everywhere.
    """
    rough = [np.abs(p[6:] - 3 * p[4:-2] + 3 * p[2:-4] - p[:-6]) for a, b in runs if len(p := angle[a:b]) > 12]
    return 1.4826 * float(np.median(np.concatenate(rough))) / np.sqrt(20) if rough else 0.0


def turning_points(angle: Array, least: float) -> list[int]:
    """Indices where an angle (n,) turns and comes back by more than `least`, with the first and the last index.

    >>> turning_points(np.array([0.0, 1.0, 0.9, 2.0, 0.0, 0.1]), 0.5)
    [0, 3, 5]
    """
    values = angle.tolist()
    turns, way, low, high, farthest = [0], 0, 0, 0, 0
    for k, x in enumerate(values):
        if way == 0:
            low, high = (k if x < values[low] else low), (k if x > values[high] else high)
            way = 1 if x - values[low] > least else -1 if values[high] - x > least else 0
            farthest = k
        elif way * (x - values[farthest]) >= 0:
            farthest = k
        elif way * (values[farthest] - x) > least:
            turns.append(farthest)
            way, farthest = -way, k
    return [*turns, len(values) - 1]


def monotone_path(angle: Array, noise: float) -> Array:
    """The way (n,) that an angle of one run went, without the to and fro of its noise (standard deviation, rad)."""
    least = min(REVERSAL_DEVIATIONS * noise, MAX_REVERSAL_SHARE * float(np.ptp(angle)))
    if least <= 0 or len(angle) < 3:
        return angle.copy()
    turns = turning_points(angle, least)
    path = np.empty_like(angle)
    for a, b in itertools.pairwise(turns):
        piece = angle[a : b + 1]
        path[a : b + 1] = isotonic_regression(piece, increasing=bool(piece[-1] >= piece[0])).x
    for before, k, after in zip(turns, turns[1:], turns[2:], strict=False):
        top = angle[k] >= angle[after]
        near = np.abs(angle - angle[k]) < least
        first = max([before, *(np.flatnonzero(~near[before:k]) + before + 1)])
        last = min([after, *(np.flatnonzero(~near[k:after]) + k - 1)])
        if last - first >= MIN_DWELL:
            # The farthest sample of a stand is its noisiest; it stood at their median.
            level = float(np.median(angle[first : last + 1]))
            part = path[before : after + 1]
            path[before : after + 1] = np.minimum(part, level) if top else np.maximum(part, level)
    return path


def estimate_speed(angle: Array, time: Array, noise: float) -> Array:
    """Speed (n,), rad/s, of an angle of one run."""
    n = len(angle)
    if noise <= NOISE_FREE * float(np.ptp(angle)):
        return central_speed(angle, time)  # simulated: as it was
    speed, open_ = np.zeros(n), np.ones(n, bool)
    windows = [w for w in WINDOWS if w <= n]
    # A coarse or late clock puts many samples at one time: no speed is taken from steps far shorter than those around.
    step = np.diff(time, append=2 * time[-1] - time[-2]) if n > 1 else np.ones(n)
    usual = median_step(step)
    for window in windows:
        order = 2 if window == 3 else 1
        way = np.asarray(savgol_filter(angle, 3, 2, deriv=1), float) if order == 2 else _slope(angle, window)
        # Stamps rise, so that their straight slope does too; a parabola's may vanish where the rate changes.
        duration = _slope(time, window)
        sound = (duration > 0.5 * usual) & (duration > 0)
        deviation = np.full(n, noise * np.sqrt(12 / (window * (window**2 - 1))))
        if order == 2:
            deviation[[0, -1]] *= np.sqrt(13)  # a parabola's slope at its ends
        shown = np.abs(way) > SIGNIFICANT_SLOPE * deviation
        last = window == windows[-1]
        duration = np.where(sound, duration, usual) if last else duration
        now = open_ & (duration > 0) & (sound | last) & (shown | last)
        speed[now] = way[now] / duration[now]
        open_ &= ~now
    return speed


def _slope(values: Array, window: int) -> Array:
    """Slopes (n,) by index of straight lines through a window about each; at the ends those of the outermost window."""
    slope = np.asarray(savgol_filter(values, window, 1, deriv=1, mode="nearest"), float)
    half = window // 2
    slope[:half], slope[-half:] = slope[half], slope[-half - 1]
    return slope
