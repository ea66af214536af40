"""Torques of the single elements of an individual along a path of twists and output angles, one pair at a time.

A bore or a lobe may lie beside its place on the circle of the elements. An element whose bore lies ahead by an angle is
where it would be if the output had turned on by that angle; an element at a lobe that lies ahead is where it would be
if the output had turned back by it. In both cases the crank has not moved, so that the twist of that element differs
as well.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..contact.element_contacts import Contacts
from ..numerics.arrays import Array, Index
from .element_positions import ElementPositions, element_positions
from .individual_contacts import IndividualContacts
from .individual_drive import Individual
from .maps import BATCH_SIZE, solve_torques


@dataclass(frozen=True)
class Places:
    """Angles, rad, by which parts lie ahead of their places in the sense of the output's rotation.

    bore: (n,), of every element; lobe: (eccentrics, lobes).
    """

    bore: Array
    lobe: Array


@dataclass(frozen=True)
class Steps:
    """Small changes of all parts of one kind, m, of the elements' positions and of the twist, rad: for derivatives.

    The stiffness of the contact at the gear changes with a step by its ratio to a radius, some 1e-4, and is left as it
    is; that of a ball in its bore, which fits closely, changes with the bore.
    """

    crank: float = 0.0
    cage: float = 0.0
    gear: float = 0.0
    position: float = 0.0
    twist: float = 0.0


@dataclass(frozen=True)
class ElementPath:
    """The elements of an individual at m points of a path.

    contacts: of the individual; positions: of the elements, (m, width); lead: (m, width) rad, twist of every element;
    clearance: (m,) m, added to the gear's.
    """

    contacts: IndividualContacts
    positions: ElementPositions
    lead: Array
    clearance: Array

    @cached_property
    def torque(self) -> Array:
        """(m, width) N.m, torque of every element on the output."""
        found = np.zeros(self.lead.size)
        weight = self.positions.weight.ravel()
        for some in _batches(np.flatnonzero(weight)):
            found[some] = solve_torques(self._contacts(some)) * weight[some]
        return found.reshape(self.lead.shape)

    def changes(self, steps: Sequence[Steps]) -> Array:
        """(k, m, width) N.m, change of the torque of every element by k steps. Elements that carry nothing are taken
        not to be reached by a step."""
        before, beta = self.torque.ravel(), self.positions.beta.ravel()
        found = np.zeros((len(steps), self.lead.size))
        own = [self._own_contacts(step) for step in steps]
        for some in _batches(np.flatnonzero(before)):
            here, element = self._contacts(some), self.positions.element.ravel()[some]
            for row, step, parts in zip(found, steps, own, strict=True):
                there = self._contacts(some, step.position) if step.position else here
                weight = self.contacts.window.weight(beta[some] + step.position)
                row[some] = solve_torques(_stepped(there, step, parts[element])) * weight - before[some]
        return found.reshape(len(steps), *self.lead.shape)

    def _own_contacts(self, step: Steps) -> Contacts:
        """The contacts of every element with crank and bore, (n,), after a step."""
        one = self.contacts.individual
        if not (step.crank or step.cage):
            return self.contacts.own_contacts
        return IndividualContacts(replace(one, crank=one.crank + step.crank, cage=one.cage + step.cage)).own_contacts

    def _contacts(self, some: Index, moved: float = 0.0) -> Contacts:
        """The contacts of some elements, by their number among all (m width), with the twist in `beta`."""
        at, point = self.positions, some // self.lead.shape[1]
        element, row, lobe = (values.ravel()[some] for values in (at.element, at.row, at.lobe))
        beta, weight = (values.ravel()[some] for values in (at.beta, at.weight))
        placed = ElementPositions(element, row, lobe, beta + moved, weight)
        contacts = self.contacts.contacts(placed, self.clearance[point])
        # The twist moves the eccentric's centre only, to beta + i twist; gear and path keep the untwisted beta.
        return replace(contacts, beta=contacts.beta + contacts.ratio * self.lead.ravel()[some])


def _batches(index: Index) -> list[Index]:
    return [index[first : first + BATCH_SIZE] for first in range(0, len(index), BATCH_SIZE)]


def _stepped(c: Contacts, step: Steps, own: Contacts) -> Contacts:
    """Contacts after a step; own: those with crank and bore."""
    return replace(
        c,
        beta=c.beta + c.ratio * step.twist,
        gear_gap=c.gear_gap + step.gear,
        radius_sum=own.radius_sum,
        cage_gap=own.cage_gap,
        stiffness_crank=own.stiffness_crank,
        stiffness_cage=own.stiffness_cage,
    )


def element_path(
    individual: Individual,
    output_angle: Array,
    twist: Array,
    clearance: Array | float = 0.0,
    places: Places | None = None,
) -> ElementPath:
    """The elements of an individual at m points of a path.

    output_angle, twist: (m,) rad, a twist for every output angle; clearance: (m,) or one number, m, added to the
    gear's; places: of bores and lobes, exact if None. Twists far beyond the drawing's are solved as they are given.

    >>> import numpy as np
    >>> from stiffness_model import load_drive
    >>> from stiffness_model.rotation import draw_individual, turning_map
    >>> drive = load_drive("workshop")
    >>> one, twist = draw_individual(drive, 3), drive.max_twist * np.array([0.5, -0.5])
    >>> along = element_path(one, np.array([0.1, 0.2]), twist).torque.sum(axis=1)
    >>> bool(np.allclose(along, np.diag(turning_map(one, twist, [0.1, 0.2]).torque), rtol=1e-9))
    True
    """
    parts, clearances = IndividualContacts(individual), np.broadcast_to(np.asarray(clearance, float), twist.shape)
    if places is not None:
        at, lead = _displaced(parts, output_angle, twist, places)
        return ElementPath(parts, at, lead, clearances)
    at = element_positions(individual, parts.window, output_angle)
    return ElementPath(parts, at, np.broadcast_to(twist[:, None], at.beta.shape), clearances)


def _displaced(
    parts: IndividualContacts, output_angle: Array, twist: Array, places: Places
) -> tuple[ElementPositions, Array]:
    """Positions and twists of elements whose bores and lobes lie beside their places."""
    drive = parts.individual.drive
    # Elements beside their places reach the profile a little earlier or later.
    margin = abs(drive.ratio - 1) * float(np.abs(places.bore).max() + np.abs(places.lobe).max())
    at = element_positions(parts.individual, parts.window.widened(margin, drive), output_angle)
    of_bore, of_lobe = places.bore[at.element], places.lobe[at.row, at.lobe]
    beta = at.beta + (drive.ratio - 1) * (of_bore - of_lobe)
    lead = twist[:, None] - of_bore + (1 - 1 / drive.ratio) * of_lobe
    return replace(at, beta=beta, weight=parts.window.weight(beta)), lead
