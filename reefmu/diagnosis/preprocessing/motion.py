"""True motion behind noisy angles: monotone paths between reversals, speeds, and rates whose errors are known.

Friction depends on the path that is travelled. Where a drive stands still its twist does not move, but the noise of
the measurement goes back and forth, and integrating it would relax a friction state that in truth stays. Paths are
therefore monotone (isotonic regression) between reversals, and a reversal is where the angle comes back by more than
noise could. A speed is the slope over the shortest window in which motion exceeds the noise: friction must not see the
noise of a drive that stands still. Damping is in proportion to the rate of the twist, also where that is small: it is
the slope of a smoothing spline, as smooth as the twist shows, and its errors are noise of the torque.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.optimize import isotonic_regression
from scipy.signal import savgol_filter

from stiffness_model.numerics.arrays import Array
from stiffness_model.numerics.smoothing_spline import SmoothingSpline, smoothing_spline

from ...speed import Instants, central_speed, merged_stamps

LEAST_MOVING = 0.25
"""Quantile over the runs of what is taken for the noise of an angle. Chosen by judgement; among 33 simulated records of
friction it leaves less residual than the median of all runs in 13, by up to 30 %, and more in 4, by up to 3 %."""
REVERSAL_DEVIATIONS = 8.0
"""Return of an angle, in standard deviations of its noise, that makes a reversal. Chosen by judgement, above the range
of about 6 that some hundred samples of white noise span."""
MIN_DWELL = 12
"""Samples near a reversal from which on the angle stood still there and its level is their median. Chosen by
judgement."""
WINDOWS = (3, 5, 9, 17, 33, 65)
"""Samples of the windows in which slopes are tried, shortest first. Chosen by judgement, each twice the one before."""
NOISE_FREE = 1e-6
"""Noise of an angle over its whole range below which it counts as simulated. Chosen by judgement, below that of any
encoder over a usual range."""
SIGNIFICANT_SLOPE = 8.0
"""Slope over its standard deviation from which motion exceeds the noise. Chosen by judgement, like a reversal."""
STEPS_COMPARED, OTHER_STEP = 8, 2.0
"""Steps before and after an instant whose medians tell whether the sampling changes there, and the ratio from which it
does; chosen by judgement: clocks jitter by less, and rigs change the rate of sampling by more."""


def signal_noise(signal: Array, runs: list[tuple[int, int]]) -> float:
    """Standard deviation of the noise of an angle or a torque (n,) over runs given by first and past-the-last index.

    Third differences of white noise have 20 times its variance, and motion is smoother than that nearly everywhere.
    They are taken over every other sample, since the errors of neighbouring encoder samples are correlated. Motion that
    is not smooth, such as the ripple under a turning crank, adds to them in some runs: the quarter of the runs with the
    least counts. A run in which an encoder's last digit does not change says nothing; one that moves evenly has none.
    """
    rounding = 8 * np.finfo(float).eps * float(np.abs(signal).max(initial=0.0))
    parts = [signal[a:b] for a, b in runs if b - a > 12]
    moving = [p for p in parts if np.median(np.abs(p[6:] - p[:-6])) > rounding]
    medians = [float(np.median(np.abs(p[6:] - 3 * p[4:-2] + 3 * p[2:-4] - p[:-6]))) for p in moving]
    found = [median if median > rounding else 0.0 for median in medians]
    return 1.4826 * float(np.quantile(found, LEAST_MOVING, method="lower")) / np.sqrt(20) if found else 0.0


def turning_points(angle: Array, least: float) -> list[int]:
    """Indices at which an angle (n,) reverses and comes back by more than `least`, and the first and the last index.

    >>> turning_points(np.array([0.0, 1.0, 0.9, 2.0, 0.0, 0.1]), 0.5)
    [0, 3, 5]
    """
    values = angle.tolist()
    points, direction, low, high, extreme = [0], 0, 0, 0, 0
    for k, x in enumerate(values):
        if direction == 0:
            low, high = (k if x < values[low] else low), (k if x > values[high] else high)
            direction = 1 if x - values[low] > least else -1 if values[high] - x > least else 0
            extreme = k
        elif direction * (x - values[extreme]) >= 0:
            extreme = k
        elif direction * (values[extreme] - x) > least:
            points.append(extreme)
            direction, extreme = -direction, k
    return [*points, len(values) - 1]


def monotone_path(angle: Array, noise: float) -> Array:
    """Path (n,), rad, of an angle of one run without the oscillation of its noise (standard deviation, rad)."""
    least = REVERSAL_DEVIATIONS * noise
    if least <= 0 or len(angle) < 3:
        return angle.copy()
    points = turning_points(angle, least)
    path = np.empty_like(angle)
    for a, b in itertools.pairwise(points):
        part = angle[a : b + 1]
        path[a : b + 1] = isotonic_regression(part, increasing=bool(part[-1] >= part[0])).x
    for before, k, after in zip(points, points[1:], points[2:], strict=False):
        is_maximum = angle[k] >= angle[after]
        near = np.abs(angle - angle[k]) < least
        first = max([before, *(np.flatnonzero(~near[before:k]) + before + 1)])
        last = min([after, *(np.flatnonzero(~near[k:after]) + k - 1)])
        if last - first >= MIN_DWELL:
            # The extreme sample of a dwell is its noisiest; the angle stood at the median.
            level = float(np.median(angle[first : last + 1]))
            part = path[before : after + 1]
            path[before : after + 1] = np.minimum(part, level) if is_maximum else np.maximum(part, level)
    return path


def estimate_speed(angle: Array, time: Array, noise: float) -> Array:
    """Rate of change (n,), per second, of an angle or a torque (n,) of one run with noise of a standard deviation in
    its unit."""
    at = merged_stamps(angle, time)
    if _is_exact(at, noise):
        return central_speed(angle, time)  # simulated: as the simulation took it
    return np.concatenate([_speed(at.values[part], at.time[part], noise) for part in _sampled_alike(at)])[at.number]


def _speed(angle: Array, time: Array, noise: float) -> Array:
    """`estimate_speed` of the instants (k,) of a motion that is sampled at one rate."""
    n = len(angle)
    windows = [w for w in WINDOWS if w <= n]
    if not windows:
        return np.zeros(n)
    # Where no window shows motion, it is that in the widest one.
    speed, _ = _line_slope(angle, time, windows[-1])
    pending = np.ones(n, bool)
    for window in windows:
        slope, deviation = _parabola_slope(angle, time) if window == 3 else _line_slope(angle, time, window)
        shown = pending & (np.abs(slope) > SIGNIFICANT_SLOPE * noise * deviation)
        speed[shown] = slope[shown]
        pending &= ~shown
    return speed


def estimate_rate(signal: Array, time: Array, noise: float) -> Array:
    """Rate of change (n,), per second, of a signal (n,) of one run with noise of a standard deviation in its unit:
    also where it is small, unlike a speed."""
    at = merged_stamps(signal, time)
    if _is_exact(at, noise):
        return central_speed(signal, time)  # simulated: as the simulation took it
    return np.concatenate([spline.slopes(at.values[part]) for part, spline in _splines(at, noise)])[at.number]


def rate_errors(signal: Array, time: Array, noise: float, draws: int, rng: np.random.Generator) -> Array:
    """(draws, n) errors of `estimate_rate`, per second, of signals that move as this one does."""
    at = merged_stamps(signal, time)
    if _is_exact(at, noise):
        return np.zeros((draws, len(signal)))
    parts = [spline.slope_errors(draws, rng) for _, spline in _splines(at, noise)]
    return np.concatenate(parts, axis=1)[:, at.number]


def _is_exact(at: Instants, noise: float) -> bool:
    """Whether a signal has no noise, or no second instant."""
    return len(at.time) < 2 or noise <= NOISE_FREE * float(np.ptp(at.values))


def _splines(at: Instants, noise: float) -> Iterator[tuple[slice, SmoothingSpline]]:
    """Splines between reversals, of instants that are sampled alike: motions are sampled as densely as they are fast,
    and are as smooth as each other where they are as fast."""
    for part in _sampled_alike(at):
        corners = turning_points(at.values[part], REVERSAL_DEVIATIONS * noise)[1:-1]
        yield part, smoothing_spline(at.time[part], at.values[part], noise**2 / at.stamps[part], corners)


def _sampled_alike(at: Instants) -> Iterator[slice]:
    """Parts of a run in which the time steps are alike."""
    return itertools.starmap(slice, itertools.pairwise([0, *_changes_of_step(at.time), len(at.time)]))


def _changes_of_step(time: Array) -> list[int]:
    """Numbers of the instants (k,), s, from which on the time step is another one for some steps at least."""
    log = np.log(np.diff(time))
    padded = np.pad(log, STEPS_COMPARED, mode="edge")
    medians = np.median(sliding_window_view(padded, STEPS_COMPARED), axis=1)
    before, after = medians[: len(log)], medians[STEPS_COMPARED:][: len(log)]
    own = np.abs(np.diff(log, prepend=log[0]))
    limit = np.log(OTHER_STEP)
    found: list[int] = []
    for change in np.flatnonzero((own > limit) & (np.abs(after - before) > limit)).tolist():
        if min(change - (found[-1] if found else 0), len(time) - change) >= STEPS_COMPARED:
            found.append(change)
    return found


def _parabola_slope(angle: Array, time: Array) -> tuple[Array, Array]:
    """Slopes (n,), rad/s, of parabolas through three samples each, and their standard deviations (n,), 1/s, over that
    of an angle."""
    n = len(angle)
    three = np.clip(np.arange(n) - 1, 0, n - 3) + np.arange(3)[:, None]
    a, b, c = time[three] - time
    # Derivatives of Lagrange's polynomials.
    numerator = -np.stack([b + c, a + c, a + b])
    weights = numerator / np.stack([(a - b) * (a - c), (b - a) * (b - c), (c - a) * (c - b)])
    return (weights * angle[three]).sum(axis=0), np.sqrt((weights**2).sum(axis=0))


def _line_slope(angle: Array, time: Array, window: int) -> tuple[Array, Array]:
    """The same for straight lines through a window about each sample."""
    duration = _slope(time, window)
    return _slope(angle, window) / duration, np.sqrt(12 / (window * (window**2 - 1))) / duration


def _slope(values: Array, window: int) -> Array:
    """Slopes (n,) per sample of straight lines through a window about each sample, at the ends of the last window."""
    slope = np.asarray(savgol_filter(values, window, 1, deriv=1, mode="nearest"), float)
    half = window // 2
    slope[:half], slope[-half:] = slope[half], slope[-half - 1]
    return slope
