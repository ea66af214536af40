"""The samples of a record at which friction at the crank slides, and what both torques differ by there.

Without losses the motor's torque is that at the output over the ratio. Friction is against the crank's motion. Where
the crank rests it can have any value up to break-away, and after a reversal it builds up over an elastic deflection:
such samples do not count.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...record import Record
from ..preprocessing.trace import make_trace

PRESLIDING_SHARE = 0.1
"""Way after a reversal, over the way to the next one, that does not count. Chosen by judgement: the friction of a drive
builds up over some mrad of the crank, and a loop of the twist turns it by ten times that and more."""
TURN = 2 * np.pi
"""rad, way of the crank after which its contacts return."""
LEAST = 3
"""Cycles from which on they are the replicates; of fewer, turns of the crank are, and of fewer of these, halves of the
ways between reversals. Three give a standard deviation with two degrees of freedom, as the intervals of effects have at
least."""


@dataclass(frozen=True)
class SlidingSamples:
    """(n,) each: load: N.m at the crank, of the output's torque without losses; excess: N.m, of the motor's torque over
    it; direction: 1 or -1, and speed: rad/s, of the crank; replicate: number of the replicate from 0 on. kind: what
    replicates are, in the plural."""

    load: Array
    excess: Array
    direction: Array
    speed: Array
    replicate: NDArray[np.intp]
    kind: str

    @property
    def replicates(self) -> int:
        """Number of replicates."""
        return len(np.unique(self.replicate))


def sliding_samples(record: Record, ratio: float) -> SlidingSamples:
    """The samples of a record with `crank_torque` at which the crank slides; ratio: signed, crank to output."""
    assert record.crank_torque is not None
    trace = make_trace(record, ratio)
    n = len(record)
    counts = np.zeros(n, bool)
    numbers = {kind: np.zeros(n, np.intp) for kind in ("cycles", "turns of the crank", "halves of ways")}
    cycle, turn, half = numbers.values()
    for first, past in trace.run_ranges:
        ways = _ways(trace.crank_direction[first:past], first)
        for number, (a, b) in enumerate(ways):
            way = np.abs(trace.crank[a:b] - trace.crank[max(a - 1, first)])
            share = way / way[-1]
            counts[a:b] = (trace.crank_direction[a:b] != 0) & (share > PRESLIDING_SHARE)
            # A way there and a way back are a cycle; numbers of runs and ways do not meet, since all are below n.
            cycle[a:b] = first + number // 2
            turn[a:b] = a + np.minimum(way // TURN, max(way[-1] // TURN - 1, 0))
            half[a:b] = a + (share > 0.5 * (1 + PRESLIDING_SHARE))
    load = record.output_torque / ratio
    kind = next((k for k, number in numbers.items() if len(np.unique(number[counts])) >= LEAST), "halves of ways")
    return SlidingSamples(
        load[counts],
        (record.crank_torque - load)[counts],
        trace.crank_direction[counts],
        trace.crank_speed[counts],
        np.unique(numbers[kind][counts], return_inverse=True)[1],
        kind,
    )


def _ways(direction: Array, first: int) -> list[tuple[int, int]]:
    """First and past-the-last index of the ways between reversals; direction: (n,) of one run, 0 at rest; first: index
    of its first sample."""
    moving = np.flatnonzero(direction)
    if not moving.size:
        return []
    turned = moving[1:][np.diff(direction[moving]) != 0]
    edges = [int(moving[0]), *turned.tolist(), len(direction)]
    return [(first + a, first + b) for a, b in itertools.pairwise(edges)]
