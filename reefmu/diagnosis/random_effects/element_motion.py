"""Where the elements are along a record: their motion past the crank, block by block."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array

from ..preprocessing.trace import Blocks, Trace
from .seating import Seating

N_HARMONICS = 3
"""Harmonics of the elements' passing that are random effects. Chosen by judgement: higher ones average out over the
samples of a block."""
STANDSTILL = 0.125
"""Rotation within a block, over the pitch of the elements, up to which the crank counts as standing. Chosen by
judgement."""
MAX_EDGE_WIDTH = 0.3
"""rad, greatest rotation within a block over which an element's passing of the profile's edge is averaged. Chosen by
judgement: blocks that rotate more are represented by their middle."""


@dataclass(frozen=True)
class ElementMotion:
    """Motion of the elements past the crank, by block.

    rotation: (n,) rad, of the crank relative to the cage; span: (n,) rad, rotation within a block and since the sample
    before; within: (n,) rad, rotation between the samples of a block; waves: (2 N_HARMONICS, n), cosines and sines of
    the elements' passing averaged over the block, 0 where the crank stands; eccentric_waves: (2 m, n), the same for the
    orders at which only the elements of one eccentric pass, none for a single eccentric; count: (n,) samples.
    """

    rotation: Array
    span: Array
    within: Array
    waves: Array
    eccentric_waves: Array
    count: Array

    def is_standing(self, drive: Drive) -> NDArray[np.bool_]:
        """(n,), whether the crank stands during a block."""
        return self.span <= STANDSTILL * (2 * np.pi / drive.elements)


def element_motion(drive: Drive, trace: Trace, blocks: Blocks) -> ElementMotion:
    """The motion of a drive's elements along the crank angle of a record."""
    # Twist does not move the elements: they keep their places while the crank stands.
    rotation = trace.crank * (1 - 1 / drive.ratio)
    within = np.maximum.reduceat(rotation, blocks.first) - np.minimum.reduceat(rotation, blocks.first)
    step = np.abs(np.diff(rotation, prepend=rotation[0]))
    step[trace.start] = 0.0
    span = within + step[blocks.first]
    moving = span > STANDSTILL * 2 * np.pi / drive.elements
    rows = drive.eccentrics
    waves: list[Array] = []
    eccentric_waves: list[Array] = []
    for harmonic in range(1, N_HARMONICS * rows + 1):
        of_all = harmonic % rows == 0
        if not of_all and drive.crank_deviation != "eccentric":
            continue
        passing = np.exp(1j * harmonic * drive.elements / rows * rotation)
        # The harmonics of a step, as which elements enter and leave, fall off with their number.
        number = harmonic / rows if of_all else harmonic
        mean = np.add.reduceat(passing, blocks.first) / blocks.count * moving / (np.pi * number)
        (waves if of_all else eccentric_waves).extend([mean.real, mean.imag])
    of_eccentrics = np.reshape(eccentric_waves, (-1, len(span)))
    return ElementMotion(blocks.mean(rotation), span, within, np.array(waves), of_eccentrics, blocks.count)


def at_blocks(motion: ElementMotion, blocks: NDArray[np.intp]) -> ElementMotion:
    """The motion in some blocks alone."""
    return ElementMotion(
        motion.rotation[blocks],
        motion.span[blocks],
        motion.within[blocks],
        motion.waves[:, blocks],
        motion.eccentric_waves[:, blocks],
        motion.count[blocks],
    )


def element_positions(drive: Drive, motion: ElementMotion, seating: Seating) -> tuple[Array, NDArray[np.intp], Array]:
    """Positions of the elements, rad, the lobes that they meet, and the share of each block that they spend within the
    usable profile, (n, elements) each."""
    n = np.arange(drive.elements)
    angle = seating.start + 2 * np.pi * n / len(n) + motion.rotation[:, None] + np.pi
    turns = np.floor(angle / (2 * np.pi)).astype(np.intp)
    beta = angle - 2 * np.pi * turns - np.pi
    rows = drive.eccentrics
    # Crank and cage of a reversing drive turn in opposite directions: the cage moves on to the next lobe.
    lobe = (np.array(seating.seats)[n // rows] - drive.orientation * turns) % drive.lobes * rows + n % rows
    width = np.clip(motion.within, 1e-6, MAX_EDGE_WIDTH)[:, None]
    return beta, lobe, np.clip((drive.usable_limit - np.abs(beta)) / width + 0.5, 0.0, 1.0)
