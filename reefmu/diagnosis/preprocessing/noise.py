"""Noise of a record without a model: what differs between cycles that should be equal.

Differences of matching samples of successive cycles hold twice the variance of the noise and nothing that repeats;
mean and slope of each pair are removed, so that slow changes do not count. The variance of a sample is a + b slope^2:
that of the torque sensor, and that of the twist sensor multiplied by the stiffness. The correlation time, the sum of
the autocorrelation over all lags, gives sums over many samples their standard error.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from stiffness_model.numerics.arrays import Array

from .autocorrelation import Autocorrelation, autocorrelation
from .trace import Trace

MIN_CYCLE = 24
"""Least number of samples of a cycle that is compared. Chosen by judgement: fewer give no autocorrelation."""
MIN_LOOP_RANGE = 0.1
"""Least range of a loop over that of its run. Chosen by judgement: smaller ones may be noise."""
CYCLE_TOLERANCE = 0.04
"""Greatest difference of the twist of matching samples, over half the range of the run. Chosen by judgement: beyond it
nonlinearity shows in the difference of the torques."""
CRANK_TOLERANCE = 0.05
"""rad, greatest difference of the crank angle of matching samples. Chosen by judgement, small against the passing of an
element."""
PERIOD_TOLERANCE = 0.05
"""Relative deviation of single periods from their median within which a run is periodic, and of the durations of two
cycles of equal speed. Chosen by judgement."""
WARMING_TOLERANCE = 1.0
"""K, greatest difference of the temperatures of two cycles. Chosen by judgement, above what sensors of temperature
scatter by."""
DEAD_BAND = 0.15
"""Band about the middle of the twist, over its range to either side, that a cycle must cross. Chosen by judgement."""
OUTLIER_RATIO = 5.0
"""Mean square of a difference, over the median of all, from which the cycles were not equal. Chosen by judgement."""
CLIPPED_DEVIATIONS = 3.5
"""Robust standard deviations at which residuals of a smoothed record are clipped, and from which the twist of matching
samples is another one. Chosen by judgement: noise hardly exceeds them, corners at reversals do."""
SLOPE_DIGITS = 2
"""Decimals of the squared stiffness over its median from which on two values are the same: by smaller differences the
noise of the twist cannot be told from that of the torque. Chosen by judgement."""


@dataclass(frozen=True)
class Noise:
    """torque: N.m, standard deviation of the torque sensor; twist: rad, of the twist sensor; correlation: over samples;
    pairs: of cycles compared; samples: compared in all; repeated: whether cycles repeat; without, the figures rest on
    the smoothness of the torque alone.
    """

    torque: float
    twist: float
    correlation: Autocorrelation
    pairs: int
    samples: int
    repeated: bool

    def variance(self, slope: Array) -> Array:
        """(n,) (N.m)^2, variance of single samples at a stiffness `slope` (n,), N.m/rad."""
        return self.torque**2 + (self.twist * slope) ** 2


def estimate_noise(trace: Trace, slope: Array) -> Noise:
    """Noise of all samples of a trace; slope: (n,) N.m/rad, stiffness of the base curve."""
    pairs = [_difference(trace, slope, first, second) for first, second in matching_cycles(trace)]
    repeated = len(pairs) >= 2
    if not repeated:
        pairs = [pair for a, b in trace.run_ranges if (pair := _smoothing_residual(trace, slope, a, b)) is not None]
    pairs = _without_outliers(pairs)
    if not pairs:
        spread = float(np.std(trace.torque)) or 1.0
        return Noise(spread, 0.0, Autocorrelation(1.0), 0, 1, False)
    # In units of a first estimate of the local noise, so that steep and flat segments count equally.
    constant, rate = _variance_parts(np.concatenate([d**2 for d, _ in pairs]), np.concatenate([s for _, s in pairs]))
    units = [np.sqrt(constant + rate * s**2) for _, s in pairs]
    found = autocorrelation([_detrended(d / unit) for (d, _), unit in zip(pairs, units, strict=True)], MIN_CYCLE)
    return Noise(
        float(np.sqrt(constant * found.variance)),
        float(np.sqrt(rate * found.variance)),
        found,
        len(pairs),
        sum(len(d) for d, _ in pairs),
        repeated,
    )


def block_variances(noise: Noise, slope: Array, count: Array) -> tuple[Array, Array]:
    """Variances of block means, (n,) (N.m)^2 each.

    slope: (n,) N.m/rad, stiffness; count: (n,) samples of the blocks. The first counts the whole autocorrelation of the
    noise and weights sums over many blocks, the second only that within a block and is its actual variance.
    """
    single = noise.variance(slope)
    sizes, which = np.unique(count, return_inverse=True)
    inside = np.array([noise.correlation.of_means(int(size), 1)[0] for size in sizes])
    return single * noise.correlation.correlation_time / count, single * inside[which]


def _without_outliers(pairs: list[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """Pairs without those whose difference is far larger than most: their cycles were not equal."""
    squares = np.array([float(np.mean(d**2)) for d, _ in pairs])
    return [pair for pair, s in zip(pairs, squares, strict=True) if s <= OUTLIER_RATIO * np.median(squares)]


def cycle_period(twist: Array) -> int:
    """Samples of one cycle of a periodic twist (n,), rad; 0 if it does not repeat."""
    low, high = np.quantile(twist, [0.005, 0.995])
    middle, dead = (low + high) / 2, DEAD_BAND * (high - low)
    if high <= low:
        return 0
    level = np.where(twist > middle + dead, 1, np.where(twist < middle - dead, -1, 0))
    known = np.flatnonzero(level)
    turn = np.diff(level[known])
    periods = []
    for sign in (1, -1):
        # Midway between the last sample on one side of the dead band and the first on the other.
        at = np.flatnonzero(turn * sign > 0)
        middles = [(known[k] + known[k + 1]) / 2 for k in at]
        periods += np.diff(middles).tolist()
    period = float(np.median(periods)) if periods else 0.0
    if not periods or np.abs(np.array(periods) - period).max() >= PERIOD_TOLERANCE * period + 1:
        period = _peak_spacing(twist, MIN_LOOP_RANGE * (high - low))
    return round(period) if period >= MIN_CYCLE else 0


def _peak_spacing(twist: Array, swing: float) -> float:
    """Samples between the peaks of loops that do not all cross one level; 0 if most distances differ."""
    from scipy.signal import find_peaks

    spacing = np.diff(find_peaks(twist, prominence=swing)[0])
    if len(spacing) < 2:
        return 0.0
    period = float(np.median(spacing))
    return period if np.mean(np.abs(spacing - period) < PERIOD_TOLERANCE * period + 1) > 0.5 else 0.0


def matching_cycles(trace: Trace) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Indices of matching samples one cycle apart, in pairs of cycles over all runs."""
    return [pair for a, b in trace.run_ranges for pair in _matching_in_run(trace, a, b)]


def _matching_in_run(trace: Trace, a: int, b: int) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Indices one cycle apart in the run from sample a to b."""
    twist, period = trace.smooth_twist[a:b], cycle_period(trace.smooth_twist[a:b])
    n = b - a
    if not period or n < 1.9 * period:
        return []
    # The exact period minimises the difference between the run and the run shifted by it.
    wide = max(2, period // 50)
    around = [p for p in range(period - wide, period + wide + 1) if n - p >= MIN_CYCLE]
    period = min(around, key=lambda p: float(np.mean((twist[p:] - twist[:-p]) ** 2)))
    # The first loop starts from rest: its presliding does not repeat.
    first = period // 2 if n >= 2.4 * period else period // 4
    shifted = np.abs(twist[period:] - twist[:-period])
    turned = np.abs(trace.crank[a + period : b] - trace.crank[a : b - period])
    equal = (shifted <= 0.5 * CYCLE_TOLERANCE * float(np.ptp(twist))) & (turned <= CRANK_TOLERANCE)
    equal[:first] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[0], equal.astype(int), [0]])))
    found = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        cycles = max(1, round((end - begin) / period))
        for index in np.array_split(np.arange(a + begin, a + end), cycles):
            if len(index) >= max(MIN_CYCLE, period // 3) and _are_alike(trace, index, index + period):
                found.append((index, index + period))
    return found


def _are_alike(trace: Trace, first: NDArray[np.intp], second: NDArray[np.intp]) -> bool:
    """Whether two cycles are as fast and as warm as each other."""
    duration = [float(trace.time[index[-1]] - trace.time[index[0]]) for index in (first, second)]
    warmer = float(trace.temperature[second].mean() - trace.temperature[first].mean())
    return abs(duration[1] - duration[0]) <= PERIOD_TOLERANCE * max(duration) and abs(warmer) <= WARMING_TOLERANCE


def _difference(trace: Trace, slope: Array, first: NDArray[np.intp], second: NDArray[np.intp]) -> tuple[Array, Array]:
    """Detrended torque difference of matching samples, scaled to the noise of one of them, and their stiffness.

    A period is no whole number of samples: what the torque changes by in the part of a sample by which the second cycle
    is late is no noise, nor is what the base curve changes by over the rest of the difference of the twist. Where that
    rest is far larger than elsewhere, as at the ends of a loop before another one, the cycles are not equal.
    """
    moved = trace.smooth_twist[second] - trace.smooth_twist[first]
    rate, torque_rate = ((of[first] + of[second]) / 2 for of in (trace.twist_rate, trace.torque_rate))
    late = float(moved @ rate) / max(float(rate @ rate), 1e-300)
    rest = trace.twist[second] - trace.twist[first] - late * rate
    equal = np.abs(rest - np.median(rest)) <= _most(rest)
    d = (trace.torque[second] - trace.torque[first] - late * torque_rate - slope[first] * rest)[equal]
    return _detrended(d) / np.sqrt(2), slope[first][equal]


def _most(values: Array) -> float:
    """Greatest deviation from the median that is noise."""
    return CLIPPED_DEVIATIONS * 1.4826 * float(np.median(np.abs(values - np.median(values))))


def _detrended(values: Array) -> Array:
    x = np.linspace(-1, 1, len(values))
    return values - values.mean() - x * (float(values @ x) / float(x @ x))


def _smoothing_residual(trace: Trace, slope: Array, a: int, b: int, window: int = 25) -> tuple[Array, Array] | None:
    """Residual of a moving cubic over `window` samples, which is noise if all else is smooth, and the stiffness."""
    from scipy.signal import savgol_filter

    if b - a < 3 * window:
        return None
    torque = trace.torque[a:b] - slope[a:b] * (trace.twist[a:b] - trace.smooth_twist[a:b])
    residual = torque - np.asarray(savgol_filter(torque, window, 3), float)
    inner = slice(window, b - a - window)
    # Corners at reversals are rare and large, and are clipped to what noise could be.
    limit = _most(residual[inner])
    return np.clip(residual[inner], -limit, limit) / np.sqrt(1 - _centre_weight(window)), slope[a:b][inner]


def _centre_weight(window: int) -> float:
    from scipy.signal import savgol_coeffs

    return float(savgol_coeffs(window, 3)[window // 2])


def _variance_parts(squares: Array, slope: Array) -> tuple[float, float]:
    """Constant and coefficient of slope^2 of the variance, neither negative, from squared noise (n,) and slope (n,)."""
    scale = float(np.median(np.abs(slope))) or 1.0
    x = (slope / scale) ** 2
    edges = np.unique(np.quantile(x, np.linspace(0, 1, 13)).round(SLOPE_DIGITS))
    if len(edges) < 4:
        return float(squares.mean()), 0.0
    bins = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
    count = np.bincount(bins, minlength=len(edges) - 1).astype(float)
    mean_x = np.bincount(bins, x, minlength=len(edges) - 1) / np.maximum(count, 1)
    mean = np.bincount(bins, squares, minlength=len(edges) - 1) / np.maximum(count, 1)
    weight = np.sqrt(count) / np.maximum(mean, 1e-300)
    constant, rate = float(squares.mean()), 0.0
    for _ in range(2):
        (constant, rate), _ = nnls(np.stack([weight, weight * mean_x], axis=1), weight * mean)
        weight = np.sqrt(count) / np.maximum(constant + rate * mean_x, 1e-300)
    return max(float(constant), 1e-12 * float(squares.mean())), float(rate) / scale**2
