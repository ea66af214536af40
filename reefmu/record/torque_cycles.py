"""Cycles that repeat in torque: what the twist at equal torque differs by from cycle to cycle.

A rig that drives the torque repeats its cycles in torque and not in time: durations and twists differ. A branch is what
lies between two reversals of the torque, or between a reversal and an end of a run. Branches of all runs that rise or
fall between the same torques are compared. The spread holds all that does not repeat: drift, creep, stick-slip at other
places, and the mean of the sensors' noise over one level.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from .record import Record

MIN_SWING = 0.4
"""Return of the torque, over its range in the run, that makes a reversal. Chosen by judgement: below the half by which
a run that starts in the middle of its range rises, and above the dips of a motor that sticks and slips."""
MIN_SAMPLES = 24
"""Least number of samples of a branch. Chosen by judgement: a sample or two for each level."""
AMPLITUDE_TOLERANCE = 0.1
"""Greatest difference between the torques at the ends of two branches, over their swing, at which they repeat each
other. Chosen by judgement: a current limit or a sticking motor cuts the amplitude by some per cent."""
CRANK_TOLERANCE = 0.2
"""rad, greatest difference of the mean crank angle of two branches. Chosen by judgement, small against the passing of
an element, larger than what the twist itself turns the crank by from cycle to cycle."""
LEVELS = 20
"""Levels at which branches are compared. Chosen by judgement."""
TRIMMED_SHARE = 0.05
"""Share of the common range at either end that is not compared, because reversals differ. Chosen by judgement."""


@dataclass(frozen=True)
class TorqueBranch:
    """first, past: indices of the samples of a branch within one run; start, end: N.m, torque at its ends."""

    run: int
    first: int
    past: int
    start: float
    end: float

    @property
    def swing(self) -> float:
        """N.m, signed: positive on a rising branch."""
        return self.end - self.start


@dataclass(frozen=True)
class BranchGroup:
    """Branches between the same torques, and how they differ.

    twist: rad, standard deviation between branches of the twist at equal torque; torque: N.m, that of the torque at
    equal twist, NaN where the twist sticks; both root mean squares over the levels that at least two branches cross.
    """

    branches: tuple[TorqueBranch, ...]
    twist: float
    torque: float

    @property
    def samples(self) -> int:
        """Number of samples of all branches."""
        return sum(branch.past - branch.first for branch in self.branches)


@dataclass(frozen=True)
class CycleSpread:
    """branches: number of branches found; groups: those that repeat; twist: rad, and torque: N.m, spread of the groups,
    pooled by their samples; NaN without a group that shows it."""

    branches: int
    groups: tuple[BranchGroup, ...]
    twist: float
    torque: float


def torque_cycle_spread(record: Record, ratio: float | None = None) -> CycleSpread:
    """The spread between cycles of a record that repeat in torque.

    ratio: signed, crank to output, for the twist of a record with a crank angle.
    """
    twist = record.twist(ratio)
    branches = torque_branches(record)
    groups: list[BranchGroup] = []
    for members in repeated_branches(record, branches):
        parts = [(twist[b.first : b.past], record.output_torque[b.first : b.past]) for b in members]
        of_twist = _level_spread([(torque, angle) for angle, torque in parts])
        of_torque = float("nan") if any(_sticks(angle) for angle, _ in parts) else _level_spread(parts)
        if np.isfinite(of_twist):
            groups.append(BranchGroup(tuple(members), of_twist, of_torque))
    weights = np.array([group.samples for group in groups], float)
    of_twist = _pooled(np.array([group.twist for group in groups]), weights)
    of_torque = _pooled(np.array([group.torque for group in groups]), weights)
    return CycleSpread(len(branches), tuple(groups), of_twist, of_torque)


def _pooled(spreads: Array, weights: Array) -> float:
    known = np.isfinite(spreads)
    return float(np.sqrt(np.average(spreads[known] ** 2, weights=weights[known]))) if known.any() else float("nan")


def _sticks(twist: Array) -> bool:
    """Whether a branch shows too few values of the twist (n,), rad, to compare torques at equal twist."""
    return len(np.unique(twist)) < LEVELS


def torque_branches(record: Record) -> list[TorqueBranch]:
    """The branches of the torque over all runs, in the order of time."""
    found: list[TorqueBranch] = []
    for a, b in itertools.pairwise([*record.starts.tolist(), len(record)]):
        torque = record.output_torque[a:b]
        if np.ptp(torque) == 0:
            continue
        reversals = _reversals(torque, MIN_SWING * float(np.ptp(torque)))
        for first, last in itertools.pairwise([0, *reversals, len(torque) - 1]):
            if last + 1 - first >= MIN_SAMPLES:
                found.append(
                    TorqueBranch(int(record.run[a]), a + first, a + last + 1, float(torque[first]), float(torque[last]))
                )
    return found


def _reversals(torque: Array, least: float) -> list[int]:
    """Indices of maxima and minima from which the torque (n,), N.m, departs by at least `least` to either side."""
    from scipy.signal import find_peaks

    peaks = [find_peaks(sign * torque, prominence=least)[0] for sign in (1.0, -1.0)]
    return sorted(np.concatenate(peaks).tolist())


def repeated_branches(record: Record, branches: Sequence[TorqueBranch]) -> list[list[TorqueBranch]]:
    """Groups of two or more branches of a record between the same torques at the same crank angle."""
    groups: list[list[TorqueBranch]] = []
    for branch in branches:
        for group in groups:
            if repeats_branch(record, group[0], branch):
                group.append(branch)
                break
        else:
            groups.append([branch])
    return [group for group in groups if len(group) >= 2]


def repeats_branch(record: Record, first: TorqueBranch, second: TorqueBranch) -> bool:
    """Whether two branches of a record lie between the same torques at the same crank angle."""
    tolerance = AMPLITUDE_TOLERANCE * abs(first.swing)
    turned = record.crank_angle[second.first : second.past].mean() - record.crank_angle[first.first : first.past].mean()
    return (
        abs(first.start - second.start) <= tolerance
        and abs(first.end - second.end) <= tolerance
        and ("crank_angle" in record.missing or abs(float(turned)) <= CRANK_TOLERANCE)
    )


def _level_spread(parts: Sequence[tuple[Array, Array]]) -> float:
    """Root mean square over levels of x of the standard deviation between parts of y at equal x; NaN without any.

    parts: of m branches, x and y (n_k,) each.
    """
    at_centre = level_means(parts)
    members = np.isfinite(at_centre).sum(axis=0)
    shared = members >= 2
    if not shared.any():
        return float("nan")
    variance = np.nanvar(at_centre[:, shared], axis=0, ddof=1)
    return float(np.sqrt(np.average(variance, weights=members[shared] - 1)))


def level_means(parts: Sequence[tuple[Array, Array]]) -> Array:
    """(m, LEVELS) y of m branches at equal levels of x over their common range; NaN where a branch has none.

    parts: of the branches, x and y (n_k,) each.
    """
    low = max(float(x.min()) for x, _ in parts)
    high = min(float(x.max()) for x, _ in parts)
    trimmed = TRIMMED_SHARE * (high - low)
    if high - low <= 2 * trimmed:
        return np.full((len(parts), LEVELS), np.nan)
    edges = np.linspace(low + trimmed, high - trimmed, LEVELS + 1)
    centre = (edges[1:] + edges[:-1]) / 2
    mean_x, mean_y = np.full((2, len(parts), LEVELS), np.nan)
    xx, xy = np.zeros(LEVELS), np.zeros(LEVELS)
    for k, (x, y) in enumerate(parts):
        inside = (x >= edges[0]) & (x < edges[-1])
        x, y = x[inside], y[inside]
        level = np.minimum(np.searchsorted(edges, x, side="right") - 1, LEVELS - 1)
        count = np.bincount(level, minlength=LEVELS)
        with np.errstate(invalid="ignore"):
            mean_x[k] = np.bincount(level, x, minlength=LEVELS) / count
            mean_y[k] = np.bincount(level, y, minlength=LEVELS) / count
        deviation = x - mean_x[k, level]
        xx += np.bincount(level, deviation**2, minlength=LEVELS)
        xy += np.bincount(level, deviation * (y - mean_y[k, level]), minlength=LEVELS)
    # Samples of a branch need not be centred in a level; the common slope of the level refers them to its centre.
    slope = np.divide(xy, xx, out=np.zeros(LEVELS), where=xx > 0)
    return mean_y + slope * (centre - mean_x)
