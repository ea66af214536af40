"""Where the elements are along a record: their motion past the crank, block by block."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stiffness_model.drawing.drive import Drive
from stiffness_model.lookup.element_table import FADE_HALF_WIDTH
from stiffness_model.numerics.arrays import Array

from ..preprocessing.trace import Blocks, Trace
from .seating import Seating

MAX_SAMPLES = 8
"""Samples of a block at which its elements enter or leave the profile; chosen by judgement to bound the time of long
records, whose blocks have more."""
SLOW = 0.5
"""rad, rotation within a block up to which its elements are taken to stand at their mean positions: an element's
response, about a sine of the position, is then within 1 % of its average."""


@dataclass(frozen=True)
class ElementMotion:
    """Motion of the elements past the crank without load, at points of a record: one for each block, or one for each of
    its samples where the crank turns fast.

    rotation: (p,) rad, of that crank relative to the cage; offsets: (p, k) rad, rotation of single samples less that of
    the point; first: (n,), number of the first point of each block.
    """

    rotation: Array
    offsets: Array
    first: NDArray[np.intp]

    @cached_property
    def block(self) -> NDArray[np.intp]:
        """(p,), number of the block of each point."""
        return np.repeat(np.arange(len(self.first)), self.count)

    @cached_property
    def count(self) -> NDArray[np.intp]:
        """(n,), number of points of each block."""
        return np.diff(self.first, append=len(self.rotation))

    def mean(self, values: Array) -> Array:
        """(n, ...) means over the blocks of values (p, ...) at the points."""
        total = np.add.reduceat(values, self.first, axis=0)
        return total / self.count.reshape(-1, *(1,) * (values.ndim - 1))


def element_motion(drive: Drive, trace: Trace, blocks: Blocks, delay: float = 0.0) -> ElementMotion:
    """The motion of a drive's elements along a record, as it was when the torque acted.

    delay: s, by which the torque is read later than the angles.
    The contacts are those of a crank that is twisted from the position that it has without load (paper, section III).
    That position follows the output: where the crank is locked, a twist of the output moves the elements along the
    profile as far as the crank would have to turn for it.
    """
    crank, twist = trace.crank - delay * trace.crank_speed, trace.smooth_twist - delay * trace.twist_rate
    rotation = (drive.ratio - 1) * (crank / drive.ratio - twist)
    within = np.maximum.reduceat(rotation, blocks.first) - np.minimum.reduceat(rotation, blocks.first)
    samples = blocks.count.astype(np.intp)
    count = np.where(within > SLOW, samples, 1)
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    single = np.repeat(count > 1, count)
    sample = np.repeat(blocks.first, count) + np.arange(count.sum()) - np.repeat(first, count)
    at = np.where(single, rotation[sample], np.repeat(blocks.mean(rotation), count))
    k = min(int(samples.max()), MAX_SAMPLES)
    place = ((np.arange(k) + 0.5) / k * np.repeat(samples, count)[:, None]).astype(np.intp)
    offsets = np.where(single[:, None], 0.0, rotation[np.repeat(blocks.first, count)[:, None] + place] - at[:, None])
    return ElementMotion(at, offsets, first)


def at_blocks(motion: ElementMotion, blocks: NDArray[np.intp]) -> ElementMotion:
    """The motion in some blocks alone, in their order."""
    count = motion.count[blocks]
    first = np.concatenate([[0], np.cumsum(count)[:-1]])
    kept = np.repeat(motion.first[blocks] - first, count) + np.arange(count.sum())
    return ElementMotion(motion.rotation[kept], motion.offsets[kept], first)


def element_positions(drive: Drive, motion: ElementMotion, seating: Seating) -> tuple[Array, NDArray[np.intp]]:
    """Positions of the elements, rad, and the lobes that they meet, (p, elements) each."""
    n = np.arange(drive.elements)
    angle = seating.start + 2 * np.pi * n / len(n) + motion.rotation[:, None] + np.pi
    turns = np.floor(angle / (2 * np.pi)).astype(np.intp)
    beta = angle - 2 * np.pi * turns - np.pi
    rows = drive.eccentrics
    # Crank and cage of a reversing drive turn in opposite directions: the cage moves on to the next lobe.
    lobe = (np.array(seating.seats)[n // rows] - drive.orientation * turns) % drive.lobes * rows + n % rows
    return beta, lobe


def inside_profile(drive: Drive, motion: ElementMotion, beta: Array) -> Array:
    """Share of each point, (p, elements), that elements at positions beta, (p, elements) rad, spend within the usable
    profile, at whose edges they fade as in the core's tables."""
    share = np.zeros(beta.shape)
    for offset in motion.offsets.T:
        share += np.clip((drive.usable_limit - np.abs(beta + offset[:, None])) / (2 * FADE_HALF_WIDTH) + 0.5, 0.0, 1.0)
    return share / motion.offsets.shape[1]
