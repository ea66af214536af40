"""The elements that can carry load: those of some virtual drives that lie on the existing part of the profile."""

from __future__ import annotations

from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from ..drawing.drive import Drive
from ..drawing.sampling import Deviations
from ..numerics.arrays import Array
from .element_contacts import Contacts, build_contacts


@dataclass(frozen=True, eq=False)
class UsableElements:
    """Some elements of `n_drives` virtual drives, drive after drive, and their contacts.

    deviations: of these n elements, arrays (n,); drive_index: (n,) the drive of each, in rising order; n_excluded:
    number of elements left out.
    """

    deviations: Deviations
    contacts: Contacts
    drive_index: NDArray[np.intp]
    n_drives: int
    n_excluded: int

    @cached_property
    def starts(self) -> NDArray[np.intp]:
        """Index of the first element of every drive that has elements here."""
        return np.flatnonzero(np.diff(self.drive_index, prepend=-1))

    def reduce_per_drive(self, reduction: np.ufunc, values: Array) -> Array:
        """Values (m, n) reduced over each drive's elements, for example summed by `np.add`: (m, n_drives).

        A drive without elements gets 0.
        """
        reduced = np.zeros((len(values), self.n_drives))
        if self.starts.size:
            reduced[:, self.drive_index[self.starts]] = reduction.reduceat(values, self.starts, axis=1)
        return reduced


def is_usable(drive: Drive, beta: Array) -> NDArray[np.bool_]:
    """Whether positions beta, rad, lie on the part of the profile that exists (`ball_path.usable_limit`)."""
    return np.abs(beta) <= drive.usable_limit


def usable_elements(
    drive: Drive, deviations: Deviations, clearance: float = 0.0, mask: NDArray[np.bool_] | None = None
) -> UsableElements:
    """The usable elements of virtual drives with `deviations` (n_drives, n_elements), and their contacts.

    clearance: m, added to the gear's clearance; mask: (n_drives, n_elements), the elements to keep instead of all
    that `is_usable`. Raises `InputError` as `build_contacts` does.
    """
    kept = is_usable(drive, deviations.beta) if mask is None else mask
    return UsableElements(
        deviations=Deviations(*(getattr(deviations, f.name)[kept] for f in fields(Deviations))),
        contacts=build_contacts(drive, deviations, clearance, kept),
        drive_index=np.nonzero(kept)[0],
        n_drives=len(kept),
        n_excluded=int(kept.size - kept.sum()),
    )
