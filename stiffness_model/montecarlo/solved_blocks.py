"""Blocks of virtual drives with their equilibrium, for quantities that follow from every element's forces."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..contact.element_contacts import Contacts
from ..contact.usable_elements import usable_elements
from ..drawing import sampling
from ..drawing.drive import Drive
from ..drawing.twist_limits import expect_twists
from ..equilibrium.closed_form import solve
from ..equilibrium.coupled_elements import CoupledEquilibrium
from ..equilibrium.solution import Equilibrium, Status
from ..errors import expect, warn_not_converged
from ..memory import expect_memory
from ..numerics.arrays import Array

_BYTES_PER_PAIR = 500.0
"""Memory per element and twist: its equilibrium, and the arrays of the caller (8 arrays for 4 contacts in
`ratings.efficiency`)."""


@dataclass(frozen=True, eq=False)
class SolvedBlock:
    """A block of drives at m crank twists: the contacts and the equilibrium of their usable elements.

    crank_twist: (m,) rad; drive_index: (n,) the element's drive in the block.
    """

    contacts: Contacts
    crank_twist: Array
    result: Equilibrium
    drive_index: NDArray[np.intp]
    n_drives: int

    @property
    def eccentric(self) -> NDArray[np.intp]:
        """Every element's eccentric, counted through the block from 0, (n,)."""
        return self.contacts.eccentric

    def centre(self) -> tuple[Array, Array]:
        """Position of the crank's pin in every element's frame, radial and tangential, (m, n) m."""
        angle = self.contacts.beta + self.crank_twist[:, None]
        return self.contacts.eccentricity * np.cos(angle), self.contacts.eccentricity * np.sin(angle)

    def crank_normal(self) -> tuple[Array, Array]:
        """Unit vector from the eccentric's centre to the element's, radial and tangential, (m, n)."""
        centre_r, centre_t = self.centre()
        d_r = self.contacts.path_radius + self.result.radial - centre_r
        d_t = self.result.tangential - centre_t
        if isinstance(self.result, CoupledEquilibrium):
            displacement = self.result.centre_displacement
            d_r, d_t = d_r - displacement[0], d_t - displacement[1]
        length = np.hypot(d_r, d_t)
        return d_r / length, d_t / length


def solved_blocks(drive: Drive, twist: ArrayLike, n_drives: int, seed: int) -> Iterator[SolvedBlock]:
    """The first `n_drives` virtual drives at twists (m,), rad at the output, one block after the other.

    Raises `InputError` for twists that are not finite or far beyond max_twist (`twist_limits`), or for less than one
    drive.
    """
    angles = expect_twists(drive, twist)
    expect(n_drives >= 1, "at least one drive", n_drives, "n_drives")
    sampling.check_seed(seed)
    _expect_memory(drive, angles, min(n_drives, sampling.BLOCK))
    failed = 0
    for block, count in sampling.blocks(n_drives):
        solved = _solved(drive, angles, sampling.draw(drive, block, count, seed), count)
        failed += int((solved.result.status == Status.NOT_CONVERGED).sum())
        yield solved
    warn_not_converged(failed, n_drives * drive.elements * len(angles), drive.name)


def spread_block(drive: Drive, twist: ArrayLike, n_drives: int) -> SolvedBlock:
    """Drives that are spread evenly over the drawing (`sampling.quasi_random_drives`), for means over all drives.

    twist: (m,) rad at the output. Raises `InputError` as `solved_blocks`.
    """
    angles = expect_twists(drive, twist)
    _expect_memory(drive, angles, n_drives)
    solved = _solved(drive, angles, sampling.quasi_random_drives(drive, n_drives), n_drives)
    failed = int((solved.result.status == Status.NOT_CONVERGED).sum())
    warn_not_converged(failed, n_drives * drive.elements * len(angles), drive.name)
    return solved


def _solved(drive: Drive, angles: Array, deviations: sampling.Deviations, count: int) -> SolvedBlock:
    elements = usable_elements(drive, deviations)
    crank = angles * drive.ratio
    return SolvedBlock(elements.contacts, crank, solve(elements.contacts, crank), elements.drive_index, count)


def _expect_memory(drive: Drive, angles: Array, n_drives: int) -> None:
    pairs = n_drives * drive.elements * len(angles)
    expect_memory(
        _BYTES_PER_PAIR * pairs, f"forces of every element at {len(angles)} twists", "take fewer twists at once"
    )


def sum_by_group(values: Array, group: NDArray[np.intp], count: int) -> Array:
    """Sums (m, count) of values (m, n) over the elements of each group.

    >>> sum_by_group(np.array([[1.0, 2.0, 4.0]]), np.array([0, 1, 1]), 3)
    array([[1., 6., 0.]])
    """
    return np.stack([np.bincount(group, row, count) for row in values]).astype(float)
