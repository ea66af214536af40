"""A long trace reduced to a few samples a block, with nearly the same block means: for the search, not for its results.

A block of many samples is divided into parts, and every signal is averaged over each of them. Where the
crank turns fast there are more parts, and a block in which a motion begins, ends or reverses keeps all samples. The
states of the effects advance from part to part by the same exact steps as from sample to sample; only the torque that
makes a drive creep is held over a longer step.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.lookup.element_table import FADE_HALF_WIDTH
from stiffness_model.numerics.arrays import Array

from .trace import Blocks, Trace

PARTS = 5
"""Least parts of a block: a record of 12 000 samples remains as it is. Measured error of the torque, rms over a record
of 115 000 samples: 1 % of a block's noise, 3 % with creep."""
MAX_SPEED_CHANGE = 0.5
"""Change of a speed within a block, over its greatest value in the record, up to which a block is averaged. Chosen by
judgement: larger ones are starts and stops."""
CRANK_TRAVEL = 2 * FADE_HALF_WIDTH
"""Travel of the crank in a part, rad: over that angle the load on an element fades, which a missing ball shows."""


@dataclass(frozen=True)
class WeightedBlocks(Blocks):
    """Blocks over a thinned trace. first: (n,) first of its samples in each block; count: (n,) samples of the whole
    trace; weight: of every sample of the thinned trace in the mean of its block."""

    weight: Array

    def mean(self, values: Array) -> Array:
        """Means (n,) over the blocks of values of all samples."""
        return np.add.reduceat(self.weight * values, self.first)


def thin_trace(trace: Trace, blocks: Blocks) -> tuple[Trace, Blocks]:
    """The thinned trace and its blocks; a trace with few samples a block is returned as it is."""
    if len(trace) < 2 * PARTS * len(blocks.count):
        return trace, blocks
    number = blocks.spread(np.arange(len(blocks.count)))
    within = np.arange(len(trace)) - blocks.first[number]
    parts = np.maximum(np.ceil(blocks.span(trace.crank) / CRANK_TRAVEL), PARTS)
    parts = np.where(_kept_blocks(trace, blocks, number), blocks.count, np.minimum(parts, blocks.count))
    part = np.floor(within * parts[number] / blocks.count[number])
    first = np.flatnonzero((within == 0) | (np.diff(part, prepend=0.0) != 0))
    count = np.diff(first, append=len(trace))

    def means(signal: Array) -> Array:
        return np.add.reduceat(signal, first) / count

    time = means(trace.time)
    thinned = Trace(
        time=time,
        run=trace.run[first],
        start=trace.start[first],
        step=np.maximum(np.diff(time, prepend=time[0]), 0.0),
        crank=means(trace.crank),
        crank_speed=means(trace.crank_speed),
        output=means(trace.output),
        output_speed=means(trace.output_speed),
        temperature=means(trace.temperature),
        twist=means(trace.twist),
        smooth_twist=means(trace.smooth_twist),
        twist_rate=means(trace.twist_rate),
        torque_rate=means(trace.torque_rate),
        torque=means(trace.torque),
        ratio=trace.ratio,
        friction=trace.friction,
    )
    weight = count / blocks.count[number[first]]
    return thinned, WeightedBlocks(np.searchsorted(first, blocks.first), blocks.count, weight)


def _kept_blocks(trace: Trace, blocks: Blocks, number: NDArray[np.intp]) -> NDArray[np.bool_]:
    """(n_blocks,), whether a block keeps all its samples. number: (n,) block of each sample."""
    kept = np.zeros(len(blocks.count), bool)
    for speed in (trace.output_speed, trace.twist_rate):
        kept |= blocks.span(speed) > MAX_SPEED_CHANGE * np.abs(speed).max()
    kept[number[trace.start]] = True
    for path in (trace.smooth_twist, trace.crank, trace.output):
        direction = np.sign(np.where(trace.start, 0.0, np.diff(path, prepend=path[0])))
        moving = np.flatnonzero(direction)
        # A run begins at rest, so that its first motion is a change of direction too.
        changed = np.diff(direction[moving], prepend=0.0) != 0
        changed |= np.diff(trace.run[moving], prepend=-1) != 0
        turns = moving[changed]
        kept[number[turns]] = kept[number[turns - 1]] = True
    return kept
