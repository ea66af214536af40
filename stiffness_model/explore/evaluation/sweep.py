"""The sweep of one design's virtual drives over rising twists, made cheap.

The model is that of `population.simulate`, with the same virtual drives, but for four savings, for an exploration
sweeps thousands of drawings:

* elements where the profile is cut away are left out before their contacts are built;
* elements that the crank leaves are left out once they have play (`_leaves`): they never carry again;
* a ball larger than its bore moves as one that just fits, in closed form and without `newton`. With every other
  ball larger than its bore this changes the metrics of the paper's steel drives by less than 1 %
  (tests/unit/stiffness_model/explore/evaluation/test_response.py);
* nothing is kept that no metric looks at.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...contact.element_contacts import Contacts
from ...contact.usable_elements import UsableElements, usable_elements
from ...drawing import sampling
from ...drawing.drive import Drive
from ...drawing.sampling import Deviations
from ...equilibrium.closed_form import Equilibrium, Status, closed_form, solve
from ...numerics.arrays import Array

Index = NDArray[np.intp]

_STAGES = (0.13, 0.4)
"""Shares of the twists after which unloaded elements are left out; more stages cost as much as they save."""
_LEAN = 0.02
"""Greatest angle, rad, of an element off its neutral direction: its clearance over its distance from the axis."""


@dataclass(frozen=True, eq=False)
class SweepSegment:
    """Some elements at m twists: index: which of `UsableElements`, (n,); the arrays of `result` are (m, n)."""

    index: Index
    contacts: Contacts
    result: Equilibrium
    starts: Index
    drives: Index
    n_drives: int

    def per_drive(self, reduce: np.ufunc, values: Array) -> Array:
        """(m, n_drives), such as the sums with np.add, of values (m, n) not below 0; 0 for drives without elements."""
        made = np.zeros((len(values), self.n_drives))
        made[:, self.drives] = reduce.reduceat(values, self.starts, axis=1)
        return made


def draw_elements(drive: Drive, limit: float, n_drives: int, seed: int) -> UsableElements:
    """The elements within +-`limit` rad of the first `n_drives` virtual drives of `seed`."""
    parts = [sampling.draw(drive, block, count, seed) for block, count in sampling.blocks(n_drives)]
    whole = {f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Deviations)}
    return usable_elements(drive, Deviations(**whole), mask=np.abs(whole["beta"]) <= limit)


def sweep(elements: UsableElements, crank_twist: Array) -> list[SweepSegment]:
    """The equilibrium at crank twists (n_twist,), rad, from zero on in one direction, as segments of one twist or
    several, in order. Elements that are missing in a segment carry nothing there."""
    ends = sorted({*(max(1, int(share * len(crank_twist))) for share in _STAGES), len(crank_twist)})
    leaves = _leaves(elements.contacts, float(crank_twist[-1]))
    active, segments, first = np.arange(len(elements.contacts)), [], 0
    for end in ends:
        contacts = elements.contacts if len(active) == len(elements.contacts) else elements.contacts[active]
        result = _equilibrium(contacts, crank_twist[first:end])
        counts = np.bincount(elements.drive_index[active], minlength=elements.n_drives)
        drives = np.flatnonzero(counts)
        starts = np.concatenate([[0], np.cumsum(counts[drives])[:-1]]).astype(np.intp)
        segments.append(SweepSegment(active, contacts, result, starts, drives, elements.n_drives))
        unloaded = (result.status[-1] == Status.UNLOADED) & leaves[active]
        if not unloaded.all():
            active = active[~unloaded]
        first = end
    return segments


def segment_at(segments: list[SweepSegment], twist: int) -> tuple[SweepSegment, int]:
    """The segment that holds a twist, and the twist's index in it."""
    for segment in segments:
        if twist < len(segment.result.gear):
            return segment, twist
        twist -= len(segment.result.gear)
    raise IndexError(twist)


def _leaves(contacts: Contacts, end: float) -> NDArray[np.bool_]:
    """Elements from which the eccentric only moves away while the crank twists from 0 to `end`, rad.

    Its centre turns by the twist on the radius e, so that the distance to a point in the direction t grows as long
    as sin(beta + twist - t) has the sign of the twist. An element that has play at some twist has a place where
    nothing presses it, and that place stays free. Not for a ball larger than its bore: its walls always press.
    """
    beta = np.sign(end) * contacts.beta
    away = (beta > _LEAN) & (beta + abs(end) < np.pi - _LEAN)
    return away & (contacts.cage_gap >= 0) & (contacts.cage_gap < 0.5 * _LEAN * contacts.path_radius)


def _equilibrium(contacts: Contacts, crank_twist: Array) -> Equilibrium:
    """The closed form; the few elements whose passes do not settle go to the iteration."""
    result = closed_form(contacts, crank_twist)
    bad = (result.status == Status.NOT_CONVERGED).any(axis=0)
    if bad.any():
        exact = solve(contacts[bad], crank_twist)
        for f in fields(Equilibrium):
            values: Any = getattr(result, f.name)
            values[:, bad] = getattr(exact, f.name)
    return result
