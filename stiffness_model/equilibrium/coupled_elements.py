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

from ..contact.element_contacts import Contacts
from ..errors import expect
from ..numerics.arrays import Array
from .closed_form_elements import ClosedForm, Motion
from .iterated_elements import Pull, Special
from .shared_bodies import Centres, Frame, Seat
from .solution import NAMES, Equilibrium, Status

MAX_PASSES = 60
BLOCK = 16384
"""Elements times twists worked on at once, for the processor's cache."""
SETTLED = 1e-14
"""m: greatest last step of an eccentric's centre, and of the housing's twist times the eccentricity. What is left is
by the next, quadratic step smaller."""
NEAR = 2e-9
"""m: the same where the iterated elements take over, and between two rounds of them, whose tangents are exact. On an
exact profile they are not, for they leave out how the contact's stiffness changes along it."""
MOST_ROUNDS = 30


@dataclass(frozen=True)
class CoupledEquilibrium(Equilibrium):
    """An `Equilibrium` and what its drives' bodies do.

    settled: whether the outer equilibrium of the element's drive was found, (m, n); centres: of eccentrics and
    drives in the order of their numbers; seat: the elements' places in them; contacts, twist: what was solved.
    """

    settled: NDArray[np.bool_]
    centres: Centres
    seat: Seat
    contacts: Contacts
    twist: Array

    @property
    def centre_displacement(self) -> Array:
        """Displacement of the eccentric's centre by bearing and housing as each element sees it, radial and
        tangential, (2, m, n) m.
        """
        return np.stack(Motion.of(self.contacts, self.twist).shift(self.seat, self.centres))

    def bodies_for(self, contacts: Contacts, part: slice) -> Centres:
        """Where the eccentrics and drives of other contacts with the same numbers are at some of the twists."""
        mine, theirs = Frame(self.contacts), Frame(contacts)
        known = np.isin(theirs.numbers, mine.numbers)
        at = np.searchsorted(mine.numbers, theirs.numbers[known])
        held = theirs.rest(len(self.twist[part]))
        held.shift[:, :, known] = self.centres.shift[:, part][:, :, at]
        held.twist[:] = self.centres.twist[part][:, np.searchsorted(mine.drives, theirs.drives)]
        return held


def solve_coupled(
    contacts: Contacts, twist: Array, external_force: ArrayLike | None = None, prescribed: Centres | None = None
) -> CoupledEquilibrium:
    """Equilibrium of n elements, whole drives, at m crank twists (rad); see `equilibrium.solve`.

    prescribed: where the bodies are, for contacts that nothing couples.
    """
    given, order = contacts, np.argsort(contacts.eccentric, kind="stable")
    contacts = contacts[order]
    load = contacts.load.T.copy()
    if external_force is not None:
        force = np.asarray(external_force, float)
        expect(
            force.shape in ((2,), (2, len(contacts))) and bool(np.isfinite(force).all()),
            f"finite forces of shape (2,) or (2, {len(contacts)})",
            force.shape,
            "external_force",
        )
        load += force[:, None] if force.ndim == 1 else force[:, order]
    frame = Frame(contacts)
    back = np.argsort(order)
    shape = (len(twist), len(contacts))
    every = frame.rest(shape[0])
    values = {name: np.zeros(shape) for name in NAMES[:-1]}
    status, settled = np.zeros(shape, np.int8), np.zeros(shape, bool)
    rows = max(1, math.ceil(shape[0] / max(1, round(shape[0] * shape[1] / BLOCK))))
    centres = frame.rest(1)
    for first in range(0, shape[0] if len(contacts) else 0, rows):
        part = slice(first, first + rows)
        here = twist[part]
        # The last twist's centres are a good start where twists come in their order.
        start = centres.repeated(_growth(twist, first, here)) if prescribed is None else prescribed.of_rows(part)
        found = _solve_rows(contacts, frame, here, load, start)
        centres = found.centres.last()
        for name, found_here in found.values.items():
            np.take(found_here, back, axis=1, out=values[name][part], mode="clip")
        status[part], settled[part] = found.status[:, back], found.settled[:, back]
        every.shift[:, part], every.twist[part] = found.centres.shift, found.centres.twist
    seat = frame.of(np.arange(len(contacts))).reordered(back)
    return CoupledEquilibrium(
        **values, status=status, settled=settled, centres=every, seat=seat, contacts=given, twist=twist
    )


def _growth(twist: Array, first: int, here: Array) -> Array:
    """How the centres move on from the last twist solved: about as the torque does."""
    last = twist[first - 1] if first else 0.0
    return np.clip(here / last, 0.0, 3.0) ** 1.4 if last != 0 else np.ones(len(here))


@dataclass(frozen=True)
class _Rows:
    """Results of some twists, elements in the order of the frame."""

    values: dict[str, Array]
    status: NDArray[np.int8]
    settled: NDArray[np.bool_]
    centres: Centres


def _solve_rows(contacts: Contacts, frame: Frame, twist: Array, load: Array, centres: Centres) -> _Rows:
    motion = Motion.of(contacts, twist)
    every = np.arange(len(contacts))
    regular = ClosedForm(contacts, frame.of(every), motion)
    special = (contacts.cage_gap < 0) | (load != 0).any(axis=0)
    # The iterated elements take over from a place near by.
    centres, done = _outer(frame, regular, None, centres, NEAR if special.any() else SETTLED)
    if not special.any():
        special = regular.unsettled().any(axis=0)
    iterated, index = None, every[:0]
    while special.any():
        index = np.flatnonzero(special)
        iterated = Special(
            contacts[index],
            frame.of(index),
            motion.of_elements(index),
            load[:, index],
            regular.displacement()[..., index],
        )
        regular.mute(index)
        centres, done = _rounds(frame, regular, iterated, centres, NEAR if contacts.profile is None else SETTLED)
        late = regular.unsettled().any(axis=0) & ~special
        if not late.any():
            break
        special |= late
    values, status = regular.result(centres), regular.status()
    if iterated is not None:
        for name, found in iterated.result(centres).items():
            values[name][:, index] = found
        status[:, index] = iterated.status()
    settled = done[:, frame.drive_of_group[frame.group]]
    status[~settled] = Status.NOT_CONVERGED
    for name in ("gear", "crank", "cage_plus", "cage_minus", "output_torque", "crank_torque"):
        values[name][~settled] = 0.0
    return _Rows(values, status, settled, centres)


def _rounds(
    frame: Frame, regular: ClosedForm, iterated: Special, centres: Centres, near: float
) -> tuple[Centres, NDArray[np.bool_]]:
    """The outer equilibrium with iterated elements: between two iterations the others see them straightened."""
    done, before = np.ones((centres.rows, frame.n_drives), bool), centres
    for _ in range(MOST_ROUNDS):
        before = centres
        pull = iterated.solve(centres, frame.drive_of_group)
        centres, done = _outer(frame, regular, pull, centres, SETTLED)
        if not frame.couples:
            return centres, done
        if centres.distance(before, regular.eccentricity) <= near:
            iterated.settle(centres)  # at the centres as they are now
            return centres, done
    return centres, done & frame.close(centres, before, regular.eccentricity, 1e-9)


def _outer(
    frame: Frame, regular: ClosedForm, pull: Pull | None, centres: Centres, settled: float
) -> tuple[Centres, NDArray[np.bool_]]:
    """Passes over the elements, with a step of the centres in each, until neither moves.

    Returns the centres and which drives found them, (m, n_drives).
    """
    moved = np.full(1, math.inf)
    for done in range(1, MAX_PASSES + 1):
        regular.take_pass(centres, done)
        if frame.couples:
            sums = regular.sums()
            if pull is not None:
                sums = sums.plus(pull.at(centres))
            # Past the usual count something swings: half steps end that.
            step = frame.step(sums, centres, 1.0 if done <= 25 else 0.5)
            moved = step.size(regular.eccentricity)
            centres = centres.plus(step)
        turn = regular.tolerance * max(1.0, settled / SETTLED)
        if regular.turn <= turn and (not frame.couples or moved.max() <= settled):
            break
    if not frame.couples:
        return centres, np.ones((centres.rows, frame.n_drives), bool)
    return centres, moved <= 1e-9
