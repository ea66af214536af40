"""Full cycles of the torque as loops: at each twist, the mean and half the difference of both directions.

With T the torque that is measured while the twist rises or falls, and a friction that depends on the load but not on
the speed, T = T_e + F on the way up and T = T_e - F on the way down, whether the friction is the motor's or the
drive's. The middle line (T_up + T_down)/2 is the elastic torque T_e, the half width (T_up - T_down)/2 the friction F.
Where the motor's torque was measured beside that at the output, and the crank turns with the twist, what it exceeds
that of the output by is a loop too, whose half width is the friction at the crank.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stiffness_model.errors import InputError
from stiffness_model.numerics.arrays import Array

from ..record import Record
from ..record.torque_cycles import TorqueBranch, torque_branches

LEVELS = 100
"""Levels of the twist in a loop. Chosen by judgement: tens of samples in each where a branch has some thousand, and
some ten levels within a play of a tenth of the loop's twist."""
COVERED = 0.9
"""Share of the torque's range that branches of either direction cover in a full cycle. Chosen by judgement: a run that
starts and ends at zero torque leaves out the error of the zero."""
FALLS = -0.5
"""Correlation of torque and twist below which a column has the other sign. Chosen by judgement: friction alone makes it
0, a spring 1."""
MIN_LEVELS = 10
"""Least number of levels that both directions pass; fewer show a twist that sticks. Chosen by judgement."""
BREAK_AWAY = 5
"""Samples whose mean torque is the one at which the twist starts to move. Chosen by judgement, against noise."""
TURNS_WITH = 0.9
"""Correlation of crank angle and twist in a cycle from which the friction at the crank reverses with the twist. Chosen
by judgement: a locked output gives 1, an output that turns under load any other."""
TIP = 0.8
"""Share of the greatest middle torque up to which a loop counts. Chosen by judgement: beyond it the half width falls
to zero, because the twist sticks after a reversal."""


@dataclass(frozen=True)
class TorqueLoop:
    """One full cycle at levels of equal distance of the twist.

    run: its run; crank: rad, mean crank angle; amplitude: N.m, half the range of the torque; step: rad, distance of the
    levels; middle, width: (n,) N.m, mean and half the difference of the torques of both directions, over the levels. At
    levels that one direction does not pass the middle is interpolated and the width NaN. ratio: signed, crank to
    output, None where it is not known; crank_width: (n,) N.m, friction at the crank, None for a record that does not
    show it.
    """

    run: int
    crank: float
    amplitude: float
    step: float
    twist: Array
    middle: Array
    width: Array
    ratio: float | None = None
    crank_width: Array | None = None

    @property
    def reach(self) -> tuple[float, float]:
        """N.m, load in the negative and in the positive direction up to which the loop counts, both positive or 0."""
        return max(-TIP * float(self.middle.min()), 0.0), max(TIP * float(self.middle.max()), 0.0)

    @property
    def friction_at_small_load(self) -> float:
        """N.m, mean half width within a quarter of the reach."""
        small = np.abs(self.middle) <= 0.25 * max(self.reach)
        return float(np.nanmean(self.width[small] if np.isfinite(self.width[small]).any() else self.width))


def torque_loops(record: Record, ratio: float | None = None) -> tuple[list[TorqueLoop], int]:
    """The full cycles of a record, in the order of time, and the number of those in which the twist sticks throughout.

    ratio: signed, crank to output. Raises `InputError` where the torque falls with growing twist: a column has the
    other sign.
    """
    twist = record.twist(ratio)
    cycles = _full_cycles(record)
    if cycles and np.median([_correlation(record, twist, branches) for branches in cycles]) < FALLS:
        raise InputError(
            f"{record.source or 'record'}: expected a torque that grows with the twist, got one that falls; "
            "reverse the sign of a column in the column map, as in TORQUE = '-output_torque'"
        )
    found = [loop for branches in cycles if (loop := _loop(record, twist, branches, ratio)) is not None]
    return found, len(cycles) - len(found)


def _correlation(record: Record, twist: Array, branches: Sequence[TorqueBranch]) -> float:
    """Correlation of torque and twist (n,), rad, in a cycle; 0 where the twist does not move."""
    cycle = slice(branches[0].first, branches[-1].past)
    moves = np.ptp(twist[cycle]) > 0
    return float(np.corrcoef(twist[cycle], record.output_torque[cycle])[0, 1]) if moves else 0.0


def _full_cycles(record: Record) -> list[list[TorqueBranch]]:
    """Successive branches of one run, of which the rising and the falling ones each cover the range of torques.

    A cycle ends as soon as both directions are covered.
    """
    cycles: list[list[TorqueBranch]] = []
    for _, of_run in itertools.groupby(torque_branches(record), key=lambda branch: branch.run):
        open_cycle: list[TorqueBranch] = []
        for branch in of_run:
            open_cycle.append(branch)
            if _is_full(open_cycle):
                cycles.append(open_cycle)
                open_cycle = []
    return cycles


def _is_full(branches: Sequence[TorqueBranch]) -> bool:
    ends = [torque for branch in branches for torque in (branch.start, branch.end)]
    whole = max(ends) - min(ends)
    return all(_length([b for b in branches if rising == (b.swing > 0)]) >= COVERED * whole for rising in (True, False))


def _length(branches: Sequence[TorqueBranch]) -> float:
    """N.m, length of the union of the branches' ranges of torque."""
    total, reached = 0.0, -np.inf
    for low, high in sorted((min(b.start, b.end), max(b.start, b.end)) for b in branches):
        total += max(high - max(low, reached), 0.0)
        reached = max(reached, high)
    return total


def _loop(record: Record, twist: Array, branches: Sequence[TorqueBranch], ratio: float | None) -> TorqueLoop | None:
    """The loop of the branches of a cycle; None where the twist does not move in both directions."""
    parts = [np.concatenate([np.arange(b.first, b.past) for b in branches if (b.swing > 0) == up]) for up in (1, 0)]
    low = max(float(twist[part].min()) for part in parts)
    high = min(float(twist[part].max()) for part in parts)
    if high <= low:
        return None
    edges = np.linspace(low, high, LEVELS + 1)
    up, down = _directions(twist, record.output_torque, branches, edges)
    middle, width = (up + down) / 2, (up - down) / 2
    known = np.isfinite(middle)
    if known.sum() < MIN_LEVELS:
        return None
    whole = np.concatenate(parts)
    return TorqueLoop(
        branches[0].run,
        float(record.crank_angle[whole].mean()),
        float(np.ptp(record.output_torque[whole])) / 2,
        float(edges[1] - edges[0]),
        (edges[1:] + edges[:-1]) / 2,
        np.interp(np.arange(LEVELS), np.flatnonzero(known), middle[known]),
        width,
        ratio,
        _crank_width(record, twist, branches, edges, ratio),
    )


def _crank_width(
    record: Record, twist: Array, branches: Sequence[TorqueBranch], edges: Array, ratio: float | None
) -> Array | None:
    """Friction at the crank (LEVELS,), N.m, of a cycle; None where the record does not show it."""
    if record.crank_torque is None or ratio is None:
        return None
    cycle = slice(branches[0].first, branches[-1].past)
    if np.ptp(record.crank_angle[cycle]) == 0:
        return None
    together = float(np.corrcoef(record.crank_angle[cycle], twist[cycle])[0, 1])
    if abs(together) < TURNS_WITH:
        return None
    up, down = _directions(twist, record.crank_torque - record.output_torque / ratio, branches, edges)
    return np.sign(together) * (up - down) / 2


def _directions(twist: Array, torque: Array, branches: Sequence[TorqueBranch], edges: Array) -> list[Array]:
    """Mean torques (LEVELS,), N.m, of the rising and of the falling branches; twist: rad, torque: N.m, both (n,)."""
    return [
        _direction([_torque_over_levels(twist, torque, b, edges) for b in branches if (b.swing > 0) == way])
        for way in (True, False)
    ]


def _direction(pieces: Sequence[Array]) -> Array:
    """Mean of the branches of one direction (LEVELS,), N.m, NaN where none passes."""
    table = np.stack(pieces)
    count = np.isfinite(table).sum(axis=0)
    total = np.nansum(table, axis=0)
    return np.divide(total, count, out=np.full(LEVELS, np.nan), where=count > 0)


def _torque_over_levels(twist: Array, torque: Array, branch: TorqueBranch, edges: Array) -> Array:
    """Mean torque (LEVELS,), N.m, of a branch in each level that it passes, interpolated over those that it leaps; NaN
    elsewhere.

    twist: rad, torque: N.m, both (n,); edges: (LEVELS + 1,) rad. Samples before the twist has moved by a level do not
    count: it sticks, and the torque is anywhere between the friction of either direction. The torque that ends it is
    that of the levels up to the first one with samples.
    """
    sense = 1.0 if branch.swing > 0 else -1.0
    inside = np.arange(branch.first, branch.past)
    moved = sense * (twist[inside] - twist[branch.first]) > edges[1] - edges[0]
    mean = np.full(LEVELS, np.nan)
    if not moved.any():
        return mean
    moving = inside[int(moved.argmax()) :]
    place = np.clip(np.searchsorted(edges, twist[moving], side="right") - 1, -1, LEVELS)
    within = (place >= 0) & (place < LEVELS)
    count = np.bincount(place[within], minlength=LEVELS)
    known = np.flatnonzero(count)
    if not len(known):
        return mean
    sums = np.bincount(place[within], torque[moving[within]], minlength=LEVELS)
    at_known = sums[known] / count[known]
    mean[known[0] : known[-1] + 1] = np.interp(np.arange(known[0], known[-1] + 1), known, at_known)
    start = int(np.clip(np.searchsorted(edges, twist[branch.first], side="right") - 1, 0, LEVELS - 1))
    break_away = float(torque[moving[:BREAK_AWAY]].mean())
    if sense > 0:
        mean[start : known[0]] = break_away
    else:
        mean[known[-1] + 1 : start + 1] = break_away
    return mean
