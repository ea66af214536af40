"""Equilibrium of whole drives beyond the plain model: elements that share bodies, and softer or truer contacts.

Around the closed form of every element (see `equilibrium`) stands an outer equilibrium. Each eccentric rests in its
bearing, a radial spring k; its centre yields by y until

    k y + sum of the elements' forces on it = 0,

and with a soft housing (torsional, k_h at the output) the contacts see a crank twist less by D with k_h D/i = i T,
T the drive's torque. Both are solved by Newton's method in the same passes that refresh the crank normals: an
element's force F follows the centre along its normal at dF/d(approach), which the closed form gives, and every
further pass costs one evaluation of it. In the frame that turns with the crank all elements of an eccentric see one
y, each turned by its own beta.

Where contacts are not power laws of one exponent (springs in series, conforming bores), the closing condition
G(s) = approach is no longer linear in s and gets one Newton step a pass; with the gear's exact profile the normal, the
gap and the stiffness at the nearest point are refreshed in every pass. Elements under forces of inertia, larger than
their bores or unsettled after all passes go to `newton.iterate`, inside the same outer equilibrium.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..contacts import Contacts
from ..element_state import NAMES, Equilibrium, Status
from ..errors import expect
from .elements import ClosedForm, Motion
from .frame import Centres, Frame
from .special import Pull, Special

Array = NDArray[np.float64]

MOST_PASSES = 60
BLOCK = 16384
"""Elements times twists worked on at once, for the processor's cache."""
SETTLED = 1e-14
"""m: greatest last step of an eccentric's centre, and of the housing's twist times the eccentricity. What is left is
by the next, quadratic step smaller."""
ROUND_SETTLED = 1e-10
"""m: the same between two rounds of the iterated elements, whose tangents are exact; on an exact profile, whose
tangents leave out how the contact's stiffness changes along it, they must settle as the others do."""
MOST_ROUNDS = 30


@dataclass(frozen=True)
class CoupledEquilibrium(Equilibrium):
    """An `Equilibrium` and what its drives' bodies do.

    centre_shift: (2, m, n) m, radial and tangential displacement of the eccentric's centre as each element sees it,
    by bearing and housing; settled: whether the outer equilibrium of the element's drive was found, (m, n).
    """

    centre_shift: Array
    settled: NDArray[np.bool_]


def solve_beyond(contacts: Contacts, twist: Array, extra_force: ArrayLike | None = None) -> CoupledEquilibrium:
    """Equilibrium of n elements, whole drives, at m crank twists (rad); see `equilibrium.solve`."""
    order = np.argsort(contacts.eccentric, kind="stable")
    contacts = contacts[order]
    load = contacts.load.T.copy()
    if extra_force is not None:
        force = np.asarray(extra_force, float)
        expect(force.shape in ((2,), (2, len(contacts))) and bool(np.isfinite(force).all()),
               f"finite forces of shape (2,) or (2, {len(contacts)})", force.shape, "extra_force")
        load += force[:, None] if force.ndim == 1 else force[:, order]
    frame = Frame(contacts)
    back = np.argsort(order)
    shape = (len(twist), len(contacts))
    values = {name: np.zeros(shape) for name in NAMES[:-1]}
    status, settled = np.zeros(shape, np.int8), np.zeros(shape, bool)
    shift = np.zeros((2, *shape))
    rows = max(1, BLOCK // max(1, len(contacts)))
    centres = frame.rest(1)
    for first in range(0, shape[0] if len(contacts) else 0, rows):
        part = slice(first, first + rows)
        here = twist[part]
        # The last twist's centres are a good start where twists come in their order.
        found = _solve_rows(contacts, frame, here, load, centres.repeated(len(here)))
        centres = found.centres.last()
        for name, found_here in found.values.items():
            values[name][part] = found_here[:, back]
        status[part], settled[part] = found.status[:, back], found.settled[:, back]
        shift[:, part] = found.shift[..., back]
    return CoupledEquilibrium(**values, status=status, centre_shift=shift, settled=settled)


@dataclass(frozen=True)
class _Rows:
    """Results of some twists, elements in the order of the frame."""

    values: dict[str, Array]
    status: NDArray[np.int8]
    settled: NDArray[np.bool_]
    shift: Array
    centres: Centres


def _solve_rows(contacts: Contacts, frame: Frame, twist: Array, load: Array, centres: Centres) -> _Rows:
    motion = Motion.of(contacts, twist)
    every = np.arange(len(contacts))
    regular = ClosedForm(contacts, frame.of(every), motion)
    centres, done = _outer(frame, regular, None, centres)
    special = (contacts.cage_gap < 0) | (load != 0).any(axis=0) | regular.unsettled().any(axis=0)
    values, status = regular.result(centres), regular.status()
    if special.any():
        index = np.flatnonzero(special)
        iterated = Special(contacts[index], frame.of(index), motion.of_elements(index), load[:, index],
                           regular.displacement()[..., index])
        regular.mute(index)
        near = ROUND_SETTLED if contacts.profile is None else SETTLED
        before = centres
        for _ in range(MOST_ROUNDS):
            before = centres
            pull = iterated.solve(centres, frame.drive_of_group)
            if not frame.couples:
                break
            centres, done = _outer(frame, regular, pull, centres)
            if centres.distance(before, contacts.eccentricity) <= near:
                iterated.solve(centres, frame.drive_of_group)  # at the centres as they are now
                break
        else:
            done &= frame.close(centres, before, contacts.eccentricity, 1e-9)
        if frame.couples:
            values, status = regular.result(centres), regular.status()
        for name, found in iterated.result(centres).items():
            values[name][:, index] = found
        status[:, index] = iterated.status()
    settled = done[:, frame.drive_of_group[frame.group]]
    status[~settled] = Status.NOT_CONVERGED
    for name in ("gear", "crank", "cage_plus", "cage_minus", "output_torque", "crank_torque"):
        values[name][~settled] = 0.0
    return _Rows(values, status, settled, np.stack(motion.shift(frame.of(every), centres)), centres)


def _outer(frame: Frame, regular: ClosedForm, pull: Pull | None, centres: Centres
           ) -> tuple[Centres, NDArray[np.bool_]]:
    """Passes over the elements, with a step of the centres in each, until neither moves.

    Returns the centres and which drives found them, (m, n_drives).
    """
    moved = np.full(1, math.inf)
    for done in range(1, MOST_PASSES + 1):
        regular.take_pass(centres, done)
        if frame.couples:
            sums = regular.sums()
            if pull is not None:
                sums = sums.plus(pull.at(centres))
            # Past the usual count something swings: half steps end that.
            step = frame.step(sums, centres, 1.0 if done <= 25 else 0.5)
            moved = step.size(regular.eccentricity)
            centres = centres.plus(step)
        if regular.turn <= regular.tolerance and (not frame.couples or moved.max() <= SETTLED):
            break
    if not frame.couples:
        return centres, np.ones((centres.rows, frame.n_drives), bool)
    return centres, moved <= 1e-9
