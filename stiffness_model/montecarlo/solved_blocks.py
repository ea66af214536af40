"""SolvedBlock blocks of virtual drives, for what is read from their contact forces."""

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

_PER_PAIR = 500.0
"""Bytes for an element at a twist: its equilibrium, and the arrays of those who read it (`friction`: 4 contacts, 8
arrays)."""


@dataclass(frozen=True)
class SolvedBlock:
    """A block of drives at m crank twists: their usable elements, forces, and who owns which element.

    drive_index: (n,) the element's drive in the block; eccentric: (n,) its eccentric, counted through the block.
    """

    contacts: Contacts
    crank_twist: Array
    result: Equilibrium
    drive_index: NDArray[np.intp]
    n_drives: int

    @property
    def eccentric(self) -> NDArray[np.intp]:
        """(n,), from 0."""
        return self.contacts.eccentric

    def centre(self) -> tuple[Array, Array]:
        """Where each element sees the crank's pin, (m, n) m radial and tangential."""
        angle = self.contacts.beta + self.crank_twist[:, None]
        return self.contacts.eccentricity * np.cos(angle), self.contacts.eccentricity * np.sin(angle)

    def crank_normal(self) -> tuple[Array, Array]:
        """From the eccentric's centre to the element's, unit vectors (m, n)."""
        centre_r, centre_t = self.centre()
        d_r = self.contacts.path_radius + self.result.radial - centre_r
        d_t = self.result.tangential - centre_t
        if isinstance(self.result, CoupledEquilibrium):
            d_r, d_t = d_r - self.result.centre_displacement[0], d_t - self.result.centre_displacement[1]
        length = np.hypot(d_r, d_t)
        return d_r / length, d_t / length


def solved_blocks(drive: Drive, twist: ArrayLike, n_drives: int, seed: int) -> Iterator[SolvedBlock]:
    """The first `n_drives` virtual drives at twists (m,), rad at the output, a block at a time.

    Raises `InputError` for twists that are not finite or far beyond max_twist (`twist_limits`), or for less than one
    drive.
    """
    angles = expect_twists(drive, twist)
    expect(n_drives >= 1, "at least one drive", n_drives, "n_drives")
    sampling.check_seed(seed)
    pairs = min(n_drives, sampling.BLOCK) * drive.elements * len(angles)
    expect_memory(_PER_PAIR * pairs, f"forces of every element at {len(angles)} twists", "take fewer twists at once")
    lost = 0
    for block, count in sampling.blocks(n_drives):
        elements = usable_elements(drive, sampling.draw(drive, block, count, seed))
        crank = angles * drive.ratio
        result = solve(elements.contacts, crank)
        lost += int((result.status == Status.NOT_CONVERGED).sum())
        yield SolvedBlock(elements.contacts, crank, result, elements.drive_index, count)
    warn_not_converged(lost, n_drives * drive.elements * len(angles), drive.name)


def sum_by_group(values: Array, drive_index: NDArray[np.intp], count: int) -> Array:
    """Sums (m, count) of values (m, n) over the elements of each drive_index.

    >>> sum_by_group(np.array([[1.0, 2.0, 4.0]]), np.array([0, 1, 1]), 3)
    array([[1., 6., 0.]])
    """
    return np.stack([np.bincount(drive_index, row, count) for row in values]).astype(float)
