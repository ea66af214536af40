"""Scatter between cycles that repeat in torque: variance that cycles of one state have, correlated within a cycle.

A rig that drives the torque repeats its cycles in torque and not in time, and cycles then differ by more than the noise
of the sensors: the motor sticks at other places, the twist drifts. Such a difference lasts over a good part of a
branch: it does not average out over the blocks of a branch as white noise of the same variance would. It is modelled
as the sum of two first-order autoregressions along the path of the twist, one as long as the record shows and one
shorter than a level, with one standard deviation each for all branches between the same torques. They are estimated
without a model, from the covariances between levels of the torque at equal twist about the mean of the branches.

Fits remain weighted least squares: blocks get one variance, that of sums over them (working independence: Liang and
Zeger, Biometrika 73, 1986). Without the zero and the base curve's parameters, which a fit leaves free, the trace of an
effect has its slowest period in a branch; the variance is that of sums of this period. Whitening by the
autoregressions, or a variance for each amplitude, would be more efficient if the laws were exact. They are not: the
first gives the greatest weight to jumps where the motor sticks, the second to small cycles, in which it sticks
throughout.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_banded

from stiffness_model.numerics.arrays import Array

from ...record import LEVELS, Record, TorqueBranch, level_means, repeated_branches, torque_branches
from .noise import Noise
from .trace import Blocks, Trace

NEAR_LAGS, FAR_LAGS = range(1, 6), range(6, 11)
"""Lags, in levels, whose covariances give variance and correlation length. Chosen by judgement: the ratio of two means
of five lags is stable for a few branches, and longer lags suffer from the mean that was removed."""
CORRELATION_LENGTHS = (1.0, 100.0)
"""Bounds of the correlation length in levels: of one level, and of five branches, which acts as a constant. Chosen by
judgement."""
SHORT_LENGTH = 0.5
"""Correlation length, in levels, of what neighbouring levels do not share. Chosen by judgement: a level averages over
all that is shorter."""


@dataclass(frozen=True)
class CycleScatter:
    """Scatter between cycles, over the whole record.

    variance: (N.m)^2, of a block; weighting_variance: (N.m)^2, the same with its autocorrelation, as sums over many
    blocks have it. long, short: (n,) correlation of each block with the one before, 0 where a run begins, in either
    autoregression; long_share: of the first in the variance. length: correlation length of the first over that of a
    branch. level_deviation: standard deviation of the logarithm of the variance, as known from so many branches.
    """

    variance: float
    weighting_variance: float
    long: Array
    short: Array
    long_share: float
    length: float
    level_deviation: float

    @property
    def rms(self) -> float:
        """Root mean square, N.m."""
        return float(np.sqrt(self.variance))

    def simulate(self, count: int, rng: np.random.Generator) -> Array:
        """(n, count) N.m, the scatter of records with cycles as different as those of this one."""
        found = np.zeros((len(self.long), count))
        for correlation, share in ((self.long, self.long_share), (self.short, 1 - self.long_share)):
            innovation = np.sqrt(1 - correlation**2)[:, None] * rng.standard_normal(found.shape)
            # x_i = correlation_i x_(i-1) + innovation_i
            bands = np.stack([np.ones(len(correlation)), -np.append(correlation[1:], 0.0)])
            found += np.sqrt(share * self.variance) * solve_banded((1, 0), bands, innovation)
        return found


def estimate_cycle_scatter(record: Record, trace: Trace, blocks: Blocks, noise: Noise) -> CycleScatter | None:
    """The scatter between the cycles of a record with these signals, blocks and noise; None where no cycles repeat in
    torque or they do not differ by more than the noise."""
    branches = torque_branches(record)
    groups = [group for group in repeated_branches(record, branches) if not any(_sticks(trace, b) for b in group)]
    known = [(group, lags) for group in groups if (lags := _lag_covariances(trace, group)) is not None]
    near, far = (sum((len(g) - 1) * float(c[list(lags)].mean()) for g, c in known) for lags in (NEAR_LAGS, FAR_LAGS))
    if near <= 0:
        return None
    shortest, longest = CORRELATION_LENGTHS
    decay = np.clip(far / near, np.exp(-len(NEAR_LAGS) / shortest), np.exp(-len(NEAR_LAGS) / longest))
    length = -len(NEAR_LAGS) / float(np.log(decay))
    slow, fast = np.zeros(len(trace)), np.zeros(len(trace))
    position = np.zeros(len(trace))
    parts = [_variance_parts(group, lags, length, noise) for group, lags in known]
    swings = np.array([abs(group[0].swing) for group, _ in known])
    for number, branch in enumerate(branches):
        inside = slice(branch.first, branch.past)
        # A branch that repeats no other scatters as those of the most similar swing do.
        slow[inside], fast[inside] = parts[int(np.abs(np.log(swings / abs(branch.swing))).argmin())]
        position[inside] = (number + _path_share(trace, branch)) * LEVELS
    step = np.abs(np.diff(blocks.mean(position), prepend=0.0))
    starts = np.diff(trace.run[blocks.first], prepend=trace.run[0] - 1) != 0
    slow, fast = blocks.mean(slow), blocks.mean(fast)
    long, short = (np.where(starts, 0.0, np.exp(-step / scale)) for scale in (length, SHORT_LENGTH))
    # The power density of the longer autoregression at one period for each branch, over that at zero.
    at_branch = 1 / (1 + (2 * np.pi * length / LEVELS) ** 2)
    whole = slow * np.maximum(at_branch * _summed_correlation(long), 1) + fast * _summed_correlation(short)
    slow_mean, fast_mean, mean = (float(np.average(v, weights=blocks.count)) for v in (slow, fast, whole))
    variance = slow_mean + fast_mean
    # Levels that say as much of the variance as one independent value: the sum of their squared correlation.
    independent = sum(len(group) - 1 for group, _ in known) * LEVELS * np.tanh(1 / length)
    deviation = float(np.sqrt(2 / independent))
    return CycleScatter(variance, mean, long, short, slow_mean / variance, length / LEVELS, deviation)


def _variance_parts(group: Sequence[TorqueBranch], lags: Array, length: float, noise: Noise) -> tuple[float, float]:
    """Variances, (N.m)^2, of the long and of the short autoregression of a group; lags: its covariances (LEVELS,)."""
    shape = np.exp(-np.array(NEAR_LAGS) / length)
    long = max(float(lags[list(NEAR_LAGS)].mean() / shape.mean()), 0.0)
    in_level = float(np.mean([branch.past - branch.first for branch in group])) / LEVELS
    white = noise.torque**2 * min(noise.correlation.correlation_time / max(in_level, 1.0), 1.0)
    return long, max(float(lags[0]) - long - white, 0.0)


def _summed_correlation(correlation: Array) -> Array:
    """(n,) sum of the correlations of each block with all others and itself, from those (n,) with the one before."""
    before = correlation.tolist()
    n = len(before)
    behind, ahead = np.ones(n), np.ones(n)
    for i in range(1, n):
        behind[i] = 1 + before[i] * behind[i - 1]
    for i in range(n - 2, -1, -1):
        ahead[i] = 1 + before[i + 1] * ahead[i + 1]
    return behind + ahead - 1


def _sticks(trace: Trace, branch: TorqueBranch) -> bool:
    """Whether a branch shows too few values of the twist to compare torques at equal twist."""
    return len(np.unique(trace.twist[branch.first : branch.past])) < LEVELS


def _lag_covariances(trace: Trace, group: Sequence[TorqueBranch]) -> Array | None:
    """Covariances (LEVELS,), (N.m)^2, of the torque between levels of the twist by their lag, about the mean of the
    branches; None where too many levels are empty."""
    means = level_means([(trace.twist[b.first : b.past], trace.torque[b.first : b.past]) for b in group])
    # A level that a branch lacks has no mean and does not count.
    rest = means - means.mean(axis=0)
    lags: list[float] = []
    for lag in range(LEVELS):
        products = rest[:, : LEVELS - lag] * rest[:, lag:]
        known = products[np.isfinite(products)]
        lags.append(float(known.mean()) if known.size else np.nan)
    if not np.isfinite(lags[: FAR_LAGS[-1] + 1]).all():
        return None
    # The mean of m branches takes one m-th of the variance with it.
    return np.array(lags) * len(group) / (len(group) - 1)


def _path_share(trace: Trace, branch: TorqueBranch) -> Array:
    """(n,) share of a branch's path of the twist that each of its samples has travelled; of the samples where the twist
    stands."""
    path = trace.smooth_twist[branch.first : branch.past]
    travelled = np.cumsum(np.abs(np.diff(path, prepend=path[0])))
    return travelled / travelled[-1] if travelled[-1] > 0 else np.linspace(0, 1, len(path))
