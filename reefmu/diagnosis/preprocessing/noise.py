"""The noise of a record, model-free: what differs between cycles that should be alike.

Differences of matching samples of successive cycles hold twice the noise and nothing that repeats; mean and
slope of each pair go out, so slow changes do not count either. Variance is a + b slope^2: the torque sensor's
part and the twist sensor's, seen through the stiffness. `correlation_time` is the integral of the autocorrelation:
with it, sums over many samples get honest errors without a model of the noise.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import nnls

from stiffness_model.numerics.arrays import Array

from .autocorrelation import autocorrelation
from .trace import Trace

MIN_CYCLE = 24
"""Samples below which a cycle says nothing."""
MIN_LOOP_RANGE = 0.1
"""Least loop that counts as one, as a share of a run's range."""
CYCLE_TOLERANCE = 0.04
"""Greatest difference of two cycles' ranges, as a share."""


@dataclass(frozen=True)
class Noise:
    """torque: N.m, standard deviation of the torque's part; twist: rad, of the twist's; correlation_time: samples,
    sum of the autocorrelation over all lags, 1 for white noise; lag_one: autocorrelation at lag one; pairs: of
    cycles compared; repeated: False if no cycles repeat and the figures come from smoothness alone.
    """

    torque: float
    twist: float
    correlation_time: float
    lag_one: float
    pairs: int
    repeated: bool

    def variance(self, slope: Array) -> Array:
        """Variance (n,) of single samples, (N.m)^2, where the stiffness is `slope` N.m/rad."""
        return self.torque**2 + (self.twist * slope) ** 2


def estimate_noise(trace: Trace, slope: Array) -> Noise:
    """Noise of a trace (all samples, not thinned); slope: (n,) stiffness of the base curve, N.m/rad."""
    pairs = [_difference(trace, slope, first, second) for first, second in matching_cycles(trace)]
    repeated = len(pairs) >= 2
    if not repeated:
        pairs = [pair for a, b in trace.run_ranges if (pair := _smoothing_residual(trace, slope, a, b)) is not None]
    pairs = _without_outliers(pairs)
    if not pairs:
        spread = float(np.std(trace.torque)) or 1.0
        return Noise(spread, 0.0, 1.0, 0.0, 0, False)
    # In units of the local noise, so that steep and flat stretches count alike; the sizes follow.
    rough = _variance_parts(np.concatenate([d**2 for d, _ in pairs]), np.concatenate([s for _, s in pairs]))
    units = [np.sqrt(rough[0] + rough[1] * s**2) for _, s in pairs]
    found = autocorrelation([_detrended(d / unit) for (d, _), unit in zip(pairs, units, strict=True)], MIN_CYCLE)
    return Noise(
        float(np.sqrt(rough[0] * found.variance)),
        float(np.sqrt(rough[1] * found.variance)),
        found.correlation_time,
        found.lag_one,
        len(pairs),
        repeated,
    )


def _without_outliers(pairs: list[tuple[Array, Array]]) -> list[tuple[Array, Array]]:
    """Pairs without those whose difference is far larger than most: there the cycles were not the same after all."""
    squares = np.array([float(np.mean(d**2)) for d, _ in pairs])
    return [pair for pair, s in zip(pairs, squares, strict=True) if s <= 5 * np.median(squares)]


def cycle_period(twist: Array) -> int:
    """Samples of one cycle of a run that goes to and fro; 0 if it does not repeat."""
    low, high = np.quantile(twist, [0.005, 0.995])
    middle, dead = (low + high) / 2, 0.15 * (high - low)
    if high <= low:
        return 0
    level = np.where(twist > middle + dead, 1, np.where(twist < middle - dead, -1, 0))
    known = np.flatnonzero(level)
    turn = np.diff(level[known])
    periods = []
    for sign in (1, -1):
        # Where the sample is known to have crossed, interpolated from the last on the other side.
        at = np.flatnonzero(turn * sign > 0)
        middles = [(known[k] + known[k + 1]) / 2 for k in at]
        periods += np.diff(middles).tolist()
    period = float(np.median(periods)) if periods else 0.0
    if not periods or np.abs(np.array(periods) - period).max() >= 0.05 * period + 1:
        period = _peak_spacing(twist, MIN_LOOP_RANGE * (high - low))
    return round(period) if period >= MIN_CYCLE else 0


def _peak_spacing(twist: Array, swing: float) -> float:
    """Samples between the tips of loops that do not all cross one level; 0 if most are not alike."""
    from scipy.signal import find_peaks

    spacing = np.diff(find_peaks(twist, prominence=swing)[0])
    if len(spacing) < 2:
        return 0.0
    period = float(np.median(spacing))
    return period if np.mean(np.abs(spacing - period) < 0.05 * period + 1) > 0.5 else 0.0


def matching_cycles(trace: Trace) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Indices of matching samples, one cycle apart, cycle by cycle over all runs."""
    return [pair for a, b in trace.run_ranges for pair in _matching_in_run(trace, a, b)]


def _matching_in_run(trace: Trace, a: int, b: int) -> list[tuple[NDArray[np.intp], NDArray[np.intp]]]:
    """Indices one cycle apart in the run from a to b."""
    twist, period = trace.smooth_twist[a:b], cycle_period(trace.smooth_twist[a:b])
    n = b - a
    if not period or n < 1.9 * period:
        return []
    # The exact period in samples: where the run is most like itself.
    wide = max(2, period // 50)
    around = [p for p in range(period - wide, period + wide + 1) if n - p >= MIN_CYCLE]
    period = min(around, key=lambda p: float(np.mean((twist[p:] - twist[:-p]) ** 2)))
    # The first loop starts from rest: what friction does there does not come again.
    first = period // 2 if n >= 2.4 * period else period // 4
    apart = np.abs(twist[period:] - twist[:-period])
    turned = np.abs(trace.crank[a + period : b] - trace.crank[a : b - period])
    alike = (apart <= 0.5 * CYCLE_TOLERANCE * float(np.ptp(twist))) & (turned <= 0.05)
    alike[:first] = False
    edges = np.flatnonzero(np.diff(np.concatenate([[0], alike.astype(int), [0]])))
    found = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        cycles = max(1, round((end - begin) / period))
        for index in np.array_split(np.arange(a + begin, a + end), cycles):
            if len(index) >= max(MIN_CYCLE, period // 3):
                found.append((index, index + period))
    return found


def _difference(trace: Trace, slope: Array, first: NDArray[np.intp], second: NDArray[np.intp]) -> tuple[Array, Array]:
    """Noise in the difference of matching samples, as of one of them, and the slopes there."""
    d = trace.torque[second] - trace.torque[first] - slope[first] * (trace.twist[second] - trace.twist[first])
    return _detrended(d) / np.sqrt(2), slope[first]


def _detrended(values: Array) -> Array:
    x = np.linspace(-1, 1, len(values))
    return values - values.mean() - x * (float(values @ x) / float(x @ x))


def _smoothing_residual(trace: Trace, slope: Array, a: int, b: int, window: int = 25) -> tuple[Array, Array] | None:
    """What a moving cubic does not follow: noise, if what is not noise is smooth."""
    from scipy.signal import savgol_filter

    if b - a < 3 * window:
        return None
    rough = trace.torque[a:b] - slope[a:b] * (trace.twist[a:b] - trace.smooth_twist[a:b])
    rest = rough - np.asarray(savgol_filter(rough, window, 3), float)
    inner = slice(window, b - a - window)
    # Corners at reversals are rare and large: they are held to what noise could be.
    limit = 3.5 * 1.4826 * float(np.median(np.abs(rest[inner])))
    return np.clip(rest[inner], -limit, limit) / np.sqrt(1 - _centre_weight(window)), slope[a:b][inner]


def _centre_weight(window: int) -> float:
    from scipy.signal import savgol_coeffs

    return float(savgol_coeffs(window, 3)[window // 2])


def _variance_parts(squares: Array, slope: Array) -> tuple[float, float]:
    """Constant part and part per slope^2 of the variance, neither negative."""
    scale = float(np.median(np.abs(slope))) or 1.0
    x = (slope / scale) ** 2
    edges = np.unique(np.quantile(x, np.linspace(0, 1, 13)))
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
    if constant <= 0:
        # The floor of the torque sensor is then not seen; half the quietest bin at most.
        constant = 0.0
    return max(float(constant), 1e-12 * float(squares.mean())), float(rate) / scale**2
