"""Equilibrium of whole drives beyond the paper's model: elements that share bodies, and other contact laws.

An outer equilibrium surrounds the closed form of every element (`closed_form_pass`). Each eccentric is supported by its
bearing, a radial spring k; its centre is displaced by y until

    k y + sum of the elements' forces on it = 0,

and with a compliant housing (torsional, k_h at the output) the contacts see a crank twist reduced by D with
k_h D/i = i T, T the drive's torque. Both are solved by Newton's method in the same passes that refresh the crank's
normals: an element's force F follows the centre along its normal at dF/d(approach), which the closed form gives, and
every further pass costs one evaluation of it. In the frame that turns with the crank all elements of an eccentric see
the same y, each rotated by its own beta.

Where contacts do not follow power laws of one exponent (springs in series, conforming bores), the closing condition is
not linear in s and takes one Newton step per pass; with the gear's exact profile the normal, the gap and the stiffness
at the nearest point are refreshed in every pass. Elements under inertia forces, larger than their bores or not
converged after all passes are solved by `newton.minimise_energy`, inside the same outer equilibrium.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..contact.element_contacts import Contacts
from ..numerics.arrays import Array
from .closed_form_elements import NORMAL_TOLERANCE, ClosedFormElements, EccentricMotion
from .iterated_elements import IteratedElements, LinearisedResultants
from .shared_bodies import BodyDisplacements, ElementGroups, SharedBodies
from .solution import FIELDS, Equilibrium, Status, external_forces

MAX_PASSES = 60
FULL_STEP_PASSES = 25
"""Passes with whole Newton steps; more than are usually needed. Then the iteration oscillates, and steps are halved."""
BLOCK_PAIRS = 16384
"""Pairs of element and twist per block, for the processor's cache."""
BODY_TOLERANCE = 1e-14
"""Greatest last step of an eccentric's centre, and of the housing's twist times the eccentricity, m. The error that
remains is smaller by the next, quadratically convergent step."""
NEAR = 2e-9
"""The same, m, where the iterated elements take over, and between two rounds of them, whose derivatives are exact. On
an exact profile they are not, for they leave out how the contact's stiffness changes along it."""
MAX_LAST_STEP = 1e-9
"""Last step, m, above which a drive's outer equilibrium counts as not found."""
MAX_ROUNDS = 30
"""Alternations of iterated elements and bodies; chosen by judgement, two or three usually suffice."""


@dataclass(frozen=True, eq=False)
class CoupledEquilibrium(Equilibrium):
    """An `Equilibrium` and the displacements of the shared bodies.

    bodies_converged: whether the outer equilibrium of the element's drive was found, (m, n); bodies: displacements of
    eccentrics and drives in the order of their numbers; groups: the elements' eccentrics and drives; contacts, twist:
    what was solved.
    """

    bodies_converged: NDArray[np.bool_]
    bodies: BodyDisplacements
    groups: ElementGroups
    contacts: Contacts
    twist: Array

    @property
    def centre_displacement(self) -> Array:
        """Displacement of the eccentric's centre by bearing and housing in each element's frame, radial and
        tangential, (2, m, n) m.
        """
        return np.stack(EccentricMotion.of(self.contacts, self.twist).displacement(self.groups, self.bodies))

    def bodies_for(self, contacts: Contacts, part: slice) -> BodyDisplacements:
        """Displacements at some of the twists for other contacts whose eccentrics have the same numbers."""
        own, other = SharedBodies(self.contacts), SharedBodies(contacts)
        known = np.isin(other.numbers, own.numbers)
        at = np.searchsorted(own.numbers, other.numbers[known])
        bodies = other.undisplaced(len(self.twist[part]))
        bodies.centre[:, :, known] = self.bodies.centre[:, part][:, :, at]
        bodies.twist[:] = self.bodies.twist[part][:, np.searchsorted(own.drives, other.drives)]
        return bodies


def solve_coupled(
    contacts: Contacts,
    twist: Array,
    external_force: ArrayLike | None = None,
    prescribed: BodyDisplacements | None = None,
) -> CoupledEquilibrium:
    """Equilibrium of n elements, whole drives, at m crank twists (rad); see `closed_form.solve`.

    prescribed: displacements of the bodies, for contacts whose options do not couple elements.
    """
    given, order = contacts, np.argsort(contacts.eccentric, kind="stable")
    contacts = contacts[order]
    load = contacts.load.T.copy()
    if external_force is not None:
        load += external_forces(external_force, len(contacts))[:, order]
    shared = SharedBodies(contacts)
    back = np.argsort(order)
    shape = (len(twist), len(contacts))
    bodies = shared.undisplaced(shape[0])
    values = {name: np.zeros(shape) for name in FIELDS[:-1]}
    status, converged = np.zeros(shape, np.int8), np.zeros(shape, bool)
    rows = max(1, math.ceil(shape[0] / max(1, round(shape[0] * shape[1] / BLOCK_PAIRS))))
    last = shared.undisplaced(1)
    for first in range(0, shape[0] if len(contacts) else 0, rows):
        part = slice(first, first + rows)
        here = twist[part]
        # The displacements at the last twist are a good start where the twists are ordered.
        start = last.scaled(_growth(twist, first, here)) if prescribed is None else prescribed.at_twists(part)
        block = _solve_block(contacts, shared, here, load, start)
        last = block.bodies.last()
        for name, found in values.items():
            np.take(getattr(block.solution, name), back, axis=1, out=found[part], mode="clip")
        status[part], converged[part] = block.solution.status[:, back], block.bodies_converged[:, back]
        bodies.centre[:, part], bodies.twist[part] = block.bodies.centre, block.bodies.twist
    return CoupledEquilibrium(
        **values,
        status=status,
        bodies_converged=converged,
        bodies=bodies,
        groups=shared.groups_of(np.arange(len(contacts))).reordered(back),
        contacts=given,
        twist=twist,
    )


def _growth(twist: Array, first: int, here: Array) -> Array:
    """Factors by which the displacements grow from the last solved twist: roughly as the torque does."""
    last = twist[first - 1] if first else 0.0
    return np.clip(here / last, 0.0, 3.0) ** 1.4 if last != 0 else np.ones(len(here))


@dataclass(frozen=True, eq=False)
class _BlockSolution:
    """Solution at some twists, elements in the order of the shared bodies."""

    solution: Equilibrium
    bodies_converged: NDArray[np.bool_]
    bodies: BodyDisplacements


def _solve_block(
    contacts: Contacts, shared: SharedBodies, twist: Array, load: Array, bodies: BodyDisplacements
) -> _BlockSolution:
    motion = EccentricMotion.of(contacts, twist)
    regular = ClosedFormElements(contacts, shared.groups_of(np.arange(len(contacts))), motion)
    needs_iteration = (contacts.cage_gap < 0) | (load != 0).any(axis=0)
    # The iterated elements start from displacements near by.
    tolerance = NEAR if needs_iteration.any() else BODY_TOLERANCE
    bodies, done = _newton_on_bodies(shared, regular, None, bodies, tolerance)
    if not needs_iteration.any():
        needs_iteration = regular.not_converged().any(axis=0)
    iterated, index = None, np.zeros(0, np.intp)
    while needs_iteration.any():
        index = np.flatnonzero(needs_iteration)
        start = regular.displacement()[..., index]
        some_motion = motion.of_elements(index)
        iterated = IteratedElements(contacts[index], shared.groups_of(index), some_motion, load[:, index], start)
        regular.exclude(index)
        near = NEAR if contacts.profile is None else BODY_TOLERANCE
        bodies, done = _alternate(shared, regular, iterated, bodies, near)
        late = regular.not_converged().any(axis=0) & ~needs_iteration
        if not late.any():
            break
        needs_iteration |= late
    solution = regular.solution(bodies)
    if iterated is not None:
        found = iterated.solution(bodies)
        for name in FIELDS:
            getattr(solution, name)[:, index] = getattr(found, name)
    converged = done[:, shared.drive_of_group[shared.group]]
    solution.status[~converged] = Status.NOT_CONVERGED
    for name in ("gear", "crank", "cage_plus", "cage_minus", "output_torque", "crank_torque"):
        getattr(solution, name)[~converged] = 0.0
    return _BlockSolution(solution, converged, bodies)


def _alternate(
    shared: SharedBodies,
    regular: ClosedFormElements,
    iterated: IteratedElements,
    bodies: BodyDisplacements,
    near: float,
) -> tuple[BodyDisplacements, NDArray[np.bool_]]:
    """The outer equilibrium with iterated elements, which enter linearised between two of their iterations."""
    done, before = np.ones((bodies.n_twists, shared.n_drives), bool), bodies
    for _ in range(MAX_ROUNDS):
        before = bodies
        linearised = iterated.solve_linearised(bodies, shared.drive_of_group)
        bodies, done = _newton_on_bodies(shared, regular, linearised, bodies, BODY_TOLERANCE)
        if not shared.couples_elements:
            return bodies, done
        if float(bodies.minus(before).max_per_drive(regular.eccentricity).max(initial=0.0)) <= near:
            iterated.solve(bodies)  # at the final displacements
            return bodies, done
    return bodies, done & (bodies.minus(before).max_per_drive(regular.eccentricity) <= MAX_LAST_STEP)


def _newton_on_bodies(
    shared: SharedBodies,
    regular: ClosedFormElements,
    linearised: LinearisedResultants | None,
    bodies: BodyDisplacements,
    tolerance: float,
) -> tuple[BodyDisplacements, NDArray[np.bool_]]:
    """Passes over the elements, with a step of the bodies in each, until neither changes.

    Returns the displacements and which drives have found them, (m, n_drives).
    """
    moved = np.full(1, math.inf)
    for number in range(1, MAX_PASSES + 1):
        regular.take_pass(bodies, number)
        if shared.couples_elements:
            resultants = regular.resultants()
            if linearised is not None:
                resultants = resultants.plus(linearised.at(bodies))
            step = shared.newton_step(resultants, bodies, 1.0 if number <= FULL_STEP_PASSES else 0.5)
            moved = step.max_per_drive(regular.eccentricity)
            bodies = bodies.plus(step)
        max_rotation = NORMAL_TOLERANCE * max(1.0, tolerance / BODY_TOLERANCE)
        if regular.rotation <= max_rotation and (not shared.couples_elements or moved.max() <= tolerance):
            break
    if not shared.couples_elements:
        return bodies, np.ones((bodies.n_twists, shared.n_drives), bool)
    return bodies, moved <= MAX_LAST_STEP
