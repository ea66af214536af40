"""The equilibrium of one design's virtual drives over rising twists, fast enough for thousands of designs.

Model and virtual drives are those of `population.simulate`, with four simplifications:

* elements where the profile is cut away are left out before their contacts are built;
* elements that the eccentric moves away from are left out once they are unloaded (`_stays_unloaded`);
* a ball larger than its bore moves as one that just fits, in closed form and without `newton`. With every other
  ball larger than its bore this changes the metrics of the paper's steel drives by less than 1 %
  (tests/unit/stiffness_model/explore/evaluation/test_response.py);
* results that no metric uses are not kept.
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
from ...numerics.arrays import Array, Index

_STAGES = (0.13, 0.4)
"""Shares of the twists after which unloaded elements are left out; further stages cost as much as they save."""
_MAX_TILT = 0.02
"""Greatest angle, rad, between an element's neutral direction and its position in the bore: its clearance over its
distance from the axis. Elements with a larger clearance are never left out. Chosen by judgement."""


@dataclass(frozen=True, eq=False)
class SweepSegment:
    """Some elements at m twists.

    index: which of `UsableElements`, (n,); result: arrays (m, n); drives: the drives that the elements belong to;
    starts: where each of them begins among the elements.
    """

    index: Index
    contacts: Contacts
    result: Equilibrium
    starts: Index
    drives: Index
    n_drives: int

    def per_drive(self, reduce: np.ufunc, values: Array) -> Array:
        """Reduce values, (m, n) from zero on, over each drive's elements to (m, n_drives); 0 for drives without any."""
        made = np.zeros((len(values), self.n_drives))
        made[:, self.drives] = reduce.reduceat(values, self.starts, axis=1)
        return made


def draw_elements(drive: Drive, limit: float, n_drives: int, seed: int) -> UsableElements:
    """The usable elements, |beta| up to `limit` rad, of the first `n_drives` virtual drives of `seed`."""
    parts = [sampling.draw(drive, block, count, seed) for block, count in sampling.blocks(n_drives)]
    whole = {f.name: np.concatenate([getattr(part, f.name) for part in parts]) for f in fields(Deviations)}
    return usable_elements(drive, Deviations(**whole), mask=np.abs(whole["beta"]) <= limit)


def sweep(elements: UsableElements, crank_twist: Array) -> list[SweepSegment]:
    """The equilibrium at crank twists (n_twist,), rad, from zero on in one direction, in segments of several twists.

    Elements that are missing in a segment carry no load there.
    """
    ends = sorted({*(max(1, int(share * len(crank_twist))) for share in _STAGES), len(crank_twist)})
    stays_unloaded = _stays_unloaded(elements.contacts, float(crank_twist[-1]))
    active, segments, first = np.arange(len(elements.contacts)), [], 0
    for end in ends:
        contacts = elements.contacts if len(active) == len(elements.contacts) else elements.contacts[active]
        result = _equilibrium(contacts, crank_twist[first:end])
        counts = np.bincount(elements.drive_index[active], minlength=elements.n_drives)
        drives = np.flatnonzero(counts)
        starts = np.concatenate([[0], np.cumsum(counts[drives])[:-1]]).astype(np.intp)
        segments.append(SweepSegment(active, contacts, result, starts, drives, elements.n_drives))
        unloaded = (result.status[-1] == Status.UNLOADED) & stays_unloaded[active]
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


def _stays_unloaded(contacts: Contacts, end: float) -> NDArray[np.bool_]:
    """Elements that stay unloaded once they are, for the eccentric moves away from them up to the twist `end`, rad.

    The eccentric's centre turns by the twist at the radius e, so its distance from a point in the direction t grows as
    long as sin(beta + twist - t) has the sign of the twist. The free place of an element that is unloaded at some twist
    then stays free. This does not hold for a ball larger than its bore, whose walls are always in contact.
    """
    beta = np.sign(end) * contacts.beta
    away = (beta > _MAX_TILT) & (beta + abs(end) < np.pi - _MAX_TILT)
    return away & (contacts.cage_gap >= 0) & (contacts.cage_gap < 0.5 * _MAX_TILT * contacts.path_radius)


def _equilibrium(contacts: Contacts, crank_twist: Array) -> Equilibrium:
    """The closed form, and the iteration for the few elements for which it does not converge."""
    result = closed_form(contacts, crank_twist)
    bad = (result.status == Status.NOT_CONVERGED).any(axis=0)
    if bad.any():
        exact = solve(contacts[bad], crank_twist)
        for f in fields(Equilibrium):
            values: Any = getattr(result, f.name)
            values[:, bad] = getattr(exact, f.name)
    return result
