"""Where the elements are along a record: their seats, and their motion past the crank, by parts of blocks.

A row has as many seats as the drive's transmission ratio, and each seat faces a lobe of its own at every turn. Where a
drawing has fewer elements than seats, they are spread as evenly as the seats allow, as in `stiffness_model.rotation`.
Which element comes first no drawing says.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from stiffness_model.drawing.drive import Drive
from stiffness_model.lookup.element_table import FADE_HALF_WIDTH
from stiffness_model.numerics.arrays import Array

from ..preprocessing.channel_filter import Instant, filtered_instants
from ..preprocessing.trace import Blocks, Trace

MAX_SAMPLES = 8
"""Samples of a part at which its elements enter or leave the profile; chosen by judgement to bound the time of long
records, whose parts have more."""
SLOW = 0.1
"""rad, rotation within a part up to which its elements are taken to stand at their mean positions; about half the
distance of the elements. The covariance of blocks is then within 1 % of that of their samples (0.3: within 2 %)."""
TWIST_STEP = 0.05
"""Change of the twist within a part, over the greatest one of the drawing, up to which torque is taken to be linear in
it; about a step of the tables of `responses`, between whose nodes it is."""
LEAST_CHANGE = 1e-3
"""rad, by which an instant before must move the mean position of the elements to count; chosen by judgement, a tenth of
the width in which elements fade at the edges of the profile."""
GOLDEN = (math.sqrt(5) - 1) / 2
"""Multiples of the golden ratio are spread over a turn as evenly as those of any number (Weyl sequence)."""


@dataclass(frozen=True)
class ElementMotion:
    """Motion of the elements past the crank without load, in p parts of the n blocks of a record: as many for each as
    its elements move.

    rotation: (p,) rad, of that crank relative to the cage; twist: (p,) rad, less its mean over the block; weight: (p,),
    share of the part in the block's samples; offsets: (p, k) rad, rotation of single samples less that of the part,
    infinite where it has fewer than k; first: (n,), number of the first part of each block; start, samples: (p,), first
    sample of each part, and how many it has.
    """

    rotation: Array
    twist: Array
    weight: Array
    offsets: Array
    first: NDArray[np.intp]
    start: NDArray[np.intp]
    samples: NDArray[np.intp]

    @cached_property
    def block(self) -> NDArray[np.intp]:
        """(p,), number of the block of each part."""
        return np.repeat(np.arange(len(self.first)), self.count)

    @cached_property
    def count(self) -> NDArray[np.intp]:
        """(n,), number of parts of each block."""
        return np.diff(self.first, append=len(self.rotation))

    @cached_property
    def reach(self) -> Array:
        """(p,) rad, distance from the edge of the profile within which an element is on it for a share of the part."""
        return np.where(np.isfinite(self.offsets), np.abs(self.offsets), 0.0).max(axis=1) + FADE_HALF_WIDTH

    def of_blocks(self, some: NDArray[np.bool_]) -> ElementMotion:
        """The motion in some of the blocks (n,)."""
        at, count = some[self.block], self.count[some]
        of_parts = (self.rotation, self.twist, self.weight, self.offsets)
        rotation, twist, weight, offsets = (values[at] for values in of_parts)
        first = np.cumsum(count) - count
        return ElementMotion(rotation, twist, weight, offsets, first, self.start[at], self.samples[at])

    def twist_from(self, mean: Array) -> Array:
        """(p,) rad, twist in the parts whose mean over each block is `mean` (n,)."""
        return mean[self.block] + self.twist

    def beside_mean(self, values: Array) -> Array:
        """(p,) means over the parts of values of all samples, less those over their blocks."""
        sums = np.concatenate([[0.0], np.cumsum(values)])
        means = (sums[self.start + self.samples] - sums[self.start]) / self.samples
        return means - self.mean(means)[self.block]

    def mean(self, values: Array) -> Array:
        """(n, ...) means over the blocks of values (p, ...) in the parts."""
        return np.add.reduceat(self.weight.reshape(-1, *(1,) * (values.ndim - 1)) * values, self.first, axis=0)


def element_motion(drive: Drive, trace: Trace, blocks: Blocks, time_constant: float = 0.0) -> ElementMotion:
    """The motion of a drive's elements along a record whose channels have passed a filter with a time constant, s.

    The contacts are those of a crank that is twisted from the position that it has without load (paper, section III).
    That position follows the output: where the crank is locked, a twist of the output moves the elements along the
    profile as far as the crank would have to turn for it.
    """
    own, *others = filtered_instants(trace, time_constant)
    found, counted = _at_instant(drive, own, blocks), own.share
    for other in others:
        counted = counted + other.share
        moved = blocks.mean(other.share * np.abs(_rotation(drive, own) - _rotation(drive, other))) > LEAST_CHANGE
        found = _in_turn(found, _at_instant(drive, other, blocks), blocks.mean(other.share / counted) * moved)
    return found


def _rotation(drive: Drive, instant: Instant) -> Array:
    """(samples,) rad, of the crank relative to the cage, as it is without load."""
    return (drive.ratio - 1) * (instant.crank / drive.ratio - instant.twist)


def _at_instant(drive: Drive, instant: Instant, blocks: Blocks) -> ElementMotion:
    """The motion of the elements at one instant of every sample."""
    rotation, twist = _rotation(drive, instant), instant.twist
    samples = blocks.count.astype(np.intp)
    steps = np.maximum(blocks.span(rotation) / SLOW, blocks.span(twist) / (TWIST_STEP * drive.max_twist))
    count = np.clip(np.ceil(steps).astype(np.intp), 1, samples)
    first = np.cumsum(count) - count
    number = np.arange(count.sum()) - np.repeat(first, count)
    start = np.repeat(blocks.first, count) + number * np.repeat(samples, count) // np.repeat(count, count)
    length = np.diff(start, append=len(rotation))

    def means(signal: Array) -> Array:
        return np.add.reduceat(signal, start) / length

    at = means(rotation)
    k = min(int(length.max()), MAX_SAMPLES)
    taken = np.minimum(length, k)[:, None]
    place = np.minimum((np.arange(k) + 0.5) / taken * length[:, None], length[:, None] - 1).astype(np.intp)
    offsets = np.where(np.arange(k) < taken, rotation[start[:, None] + place] - at[:, None], np.inf)
    beside = means(twist) - np.repeat(blocks.mean(twist), count)
    weight = length / np.repeat(samples, count)
    return ElementMotion(at, beside, weight, offsets, first, start, length)


def _in_turn(one: ElementMotion, other: ElementMotion, share: Array) -> ElementMotion:
    """The motion whose blocks have a share (n,) of their parts in another motion, and the rest in one."""
    some = share[other.block] > 0
    block = np.concatenate([one.block, other.block[some]])
    order = np.argsort(block, kind="stable")
    width = max(one.offsets.shape[1], other.offsets.shape[1])

    def joined(of_one: NDArray[Any], of_other: NDArray[Any]) -> NDArray[Any]:
        return np.concatenate([of_one, of_other[some]])[order]

    def padded(offsets: Array) -> Array:
        return np.pad(offsets, ((0, 0), (0, width - offsets.shape[1])), constant_values=np.inf)

    return ElementMotion(
        joined(one.rotation, other.rotation),
        joined(one.twist, other.twist),
        joined(one.weight * (1 - share)[one.block], other.weight * share[other.block]),
        joined(padded(one.offsets), padded(other.offsets)),
        np.searchsorted(block[order], np.arange(len(share))),
        joined(one.start, other.start),
        joined(one.samples, other.samples),
    )


def even_seats(drive: Drive) -> tuple[int, ...]:
    """The seats nearest to an even spacing of a row's elements."""
    row = drive.seats
    return tuple(round(k * row.seats / row.elements) for k in range(row.elements))


def repeating_elements(drive: Drive) -> int:
    """Number of elements of a row after which the gaps between their seats repeat."""
    gaps = np.diff([*even_seats(drive), drive.seats.seats])
    return next(k for k in range(1, len(gaps) + 1) if np.array_equal(gaps, np.roll(gaps, k)))


def spread_starts(drive: Drive, count: int) -> tuple[float, ...]:
    """So many positions of the first element at crank angle 0, rad: evenly spaced over the distance of the elements,
    and each at another element's place on the turn."""
    step = 2 * math.pi / drive.elements
    return tuple(step * (int(drive.elements * (k * GOLDEN % 1.0)) + (k + 0.5) / count) for k in range(count))


@dataclass(frozen=True)
class ElementsOnProfile:
    """k pairs of a part of a motion and an element that is on the profile in it: numbers (k,) of the part, the element
    and the lobe that it meets, and position (k,), rad."""

    part: NDArray[np.intp]
    element: NDArray[np.intp]
    lobe: NDArray[np.intp]
    position: Array


def elements_on_profile(drive: Drive, motion: ElementMotion, start: float, margin: float) -> ElementsOnProfile:
    """The elements that are on the usable profile, or within `margin`, rad, of it, at a sample of a part; start: rad,
    position of the first element at crank angle 0."""
    at, distance = start + motion.rotation, 2 * np.pi / drive.elements
    reach = np.minimum(drive.usable_limit + margin + motion.reach, np.pi)
    # Counted on past a turn, the elements that are on the profile in a part follow one another.
    first = np.floor(-(reach + at) / distance).astype(np.intp) + 1
    count = np.ceil((reach - at) / distance).astype(np.intp) - first
    part = np.repeat(np.arange(len(at)), count)
    number = np.arange(len(part)) - np.repeat(np.cumsum(count) - count - first, count)
    turns, element = np.divmod(number, drive.elements)
    rows = drive.eccentrics
    # Crank and cage of a reversing drive turn in opposite directions: the cage moves on to the next lobe.
    seat = np.array(even_seats(drive))[element // rows] + drive.orientation * turns
    lobe = seat % drive.lobes * rows + element % rows
    return ElementsOnProfile(part, element, lobe, at[part] + distance * number)


def share_inside(drive: Drive, position: Array) -> Array:
    """Share by which elements at positions of any shape, rad, are on the usable profile, at whose edges they fade as in
    the core's tables."""
    return np.clip((drive.usable_limit - np.abs(position)) / (2 * FADE_HALF_WIDTH) + 0.5, 0.0, 1.0)


def inside_profile(drive: Drive, motion: ElementMotion, part: NDArray[np.intp], beta: Array) -> Array:
    """Share (k,) of the parts (k,), by number, that elements at positions beta (k,), rad, spend within the usable
    profile."""
    share = (np.abs(beta) < drive.usable_limit).astype(float)
    # Only those near an edge are inside for a share of the time.
    near = np.flatnonzero(np.abs(np.abs(beta) - drive.usable_limit) < motion.reach[part])
    at = beta[near, None] + motion.offsets[part[near]]
    share[near] = share_inside(drive, at).sum(axis=1) / np.isfinite(at).sum(axis=1)
    return share
