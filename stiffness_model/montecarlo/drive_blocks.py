"""The torques and forces of one block of virtual drives."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..contact.usable_elements import UsableElements, usable_elements
from ..drawing import sampling
from ..drawing.drive import Drive
from ..equilibrium.closed_form import Equilibrium, Status, solve_chunks
from ..numerics.arrays import Array


class BlockResult(NamedTuple):
    """Results of one block of drives, as those of `population.Population`."""

    torque: Array
    crank_torque: Array
    force: Array
    share: Array
    counts: NDArray[np.int64]
    capped_count: int
    interference_count: int


def simulate_block(drive: Drive, twist: Array, seed: int, clearance: float, task: tuple[int, int]) -> BlockResult:
    """Results of `task`, the number of a block and its drives, at twists (n_twist,), rad at the output.

    clearance: m, added to the gear's clearance in all drives.
    """
    block, n_drives = task
    deviations = sampling.draw(drive, block, n_drives, seed)
    elements = usable_elements(drive, deviations, clearance)
    shape = (n_drives, len(twist))
    torque, crank_torque, greatest, force = np.zeros(shape), np.zeros(shape), np.zeros(shape), np.zeros((*shape, 4))
    counts = np.zeros(len(Status), np.int64)
    counts[Status.EXCLUDED] = elements.n_excluded * len(twist)
    for part, result in solve_chunks(elements.contacts, twist * drive.ratio):
        torque[:, part], crank_torque[:, part], greatest[:, part] = _torques(result, elements)
        for k, values in enumerate((result.gear, result.crank, result.cage_plus, result.cage_minus)):
            force[:, part, k] = elements.reduce_per_drive(np.maximum, values).T
        counts += np.bincount(result.status.ravel(), minlength=len(Status))
    with np.errstate(invalid="ignore", divide="ignore"):
        share = np.where(torque != 0, greatest / np.abs(torque), np.nan)
    interfering = int((deviations.cage < deviations.element).sum())
    return BlockResult(torque, crank_torque, force, share, counts, int(elements.contacts.capped.sum()), interfering)


def _torques(result: Equilibrium, elements: UsableElements) -> tuple[Array, Array, Array]:
    """Sums of output and crank torque, and the greatest contribution in the sum's direction, (n_drives, m) N.m."""
    torque = elements.reduce_per_drive(np.add, result.output_torque).T
    crank_torque = elements.reduce_per_drive(np.add, result.crank_torque).T
    highest = elements.reduce_per_drive(np.maximum, result.output_torque).T
    lowest = elements.reduce_per_drive(np.minimum, result.output_torque).T
    return torque, crank_torque, np.where(torque >= 0, highest, -lowest)
