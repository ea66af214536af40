"""Elements inside the outer equilibrium of `coupled` that need an iteration each: larger than their bores, under forces
of inertia, or unsettled by the closed form. Between two rounds the others see them straightened.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..contact.element_contacts import Contacts
from ..numerics.arrays import Array
from .closed_form_elements import Motion
from .newton import BLOCK, crank_tangent, iterate
from .shared_bodies import Centres, Seat, Sums
from .solution import Status

FOOT_SETTLED = 1e-9
"""rad: greatest last move of the nearest point along an exact profile."""
MOST_FEET = 25


@dataclass(frozen=True)
class Pull:
    """The iterated elements' sums, straightened about the centres at which they were solved."""

    sums: Sums
    base: Centres
    drive_of_group: NDArray[np.intp]

    def at(self, centres: Centres) -> Sums:
        """Their sums where the centres have moved."""
        s = self.sums
        d1, d2 = centres.shift - self.base.shift
        s11, s12, s22 = s.stiffness
        force = s.force + np.stack([s11 * d1 + s12 * d2, s12 * d1 + s22 * d2])
        if s.by_twist is None or s.torque_by_shift is None or s.torque_by_twist is None:
            return replace(s, force=force)
        lost = (centres.twist - self.base.twist)[:, self.drive_of_group]
        torque = s.torque + s.torque_by_shift[0] * d1 + s.torque_by_shift[1] * d2 - s.torque_by_twist * lost
        return replace(s, force=force - s.by_twist * lost, torque=torque)


class Special:
    """contacts: of n elements; load: (2, n) N; start: (2, m, n) m."""

    def __init__(self, contacts: Contacts, seat: Seat, motion: Motion, load: Array, start: Array) -> None:
        self._c, self._seat, self._motion = contacts, seat, motion
        m, n = self._shape = motion.centre_r.shape
        self._every = contacts[np.tile(np.arange(n), m)]
        self._twist, self._load = np.repeat(motion.twist, n), np.tile(load, m)
        self._x = start.reshape(2, -1).copy()
        self._foot, self._gear = self._every.beta.copy(), self._every.stiffness_gear.copy()
        self._forces, self._normal = np.zeros((4, m * n)), np.zeros((2, m * n))
        self._converged = np.zeros(m * n, bool)

    def solve(self, centres: Centres, drive_of_group: NDArray[np.intp]) -> Pull:
        """Equilibrium of each with the centres held, and how it follows them."""
        return Pull(self._sums(self.settle(centres)), centres, drive_of_group)

    def settle(self, centres: Centres) -> Array:
        """Equilibrium of each with the centres held; returns the centres' displacement as they see it, (2, m n) m."""
        shift = np.stack(self._motion.shift(self._seat, centres)).reshape(2, -1)
        profile, todo = self._c.profile, np.arange(len(self._every))
        if profile is None:
            self._iterate(todo, self._every, shift)
            return shift
        for _ in range(MOST_FEET):
            # The iteration follows the profile by itself; only the contact's stiffness is held meanwhile.
            some = self._every[todo]
            foot = profile.nearest_point(some.beta, self._x[:, todo], self._foot[todo], steps=3)
            moved = np.abs(foot.beta - self._foot[todo])
            self._foot[todo] = foot.beta
            self._gear[todo] = profile.stiffness(foot, some.element_radius, some.gear_gap)
            self._iterate(todo, replace(some, stiffness_gear=self._gear[todo]), shift)
            todo = todo[moved > FOOT_SETTLED]
            if not len(todo):
                break
        return shift

    def _iterate(self, todo: NDArray[np.intp], some: Contacts, shift: Array) -> None:
        """Solve the contacts `some` of the elements `todo`, a block at a time."""
        for first in range(0, len(todo), BLOCK):
            part = slice(first, first + BLOCK)
            index = todo[part]
            found = iterate(some[part], self._twist[index], self._load[:, index], self._x[:, index], shift[:, index])
            self._x[:, index], self._forces[:, index], self._normal[:, index], self._converged[index] = found
        self._forces[:, ~self._converged] = 0.0

    def _sums(self, shift: Array) -> Sums:
        seat, shape = self._seat, self._shape
        met = replace(self._every, stiffness_gear=self._gear)
        rate, torque_rate = crank_tangent(met, self._twist, self._x, shift)
        rr, rt, tt = (row.reshape(shape) for row in rate)
        f_r, f_t = (self._forces[1] * u for u in self._normal)

        def turned(r: Array, t: Array) -> Array:
            """In the crank's frame, summed over each eccentric."""
            r, t = r.reshape(shape), t.reshape(shape)
            return np.stack([seat.add(r * seat.cos + t * seat.sin), seat.add(t * seat.cos - r * seat.sin)])

        cc, cs, ss = seat.cos**2, seat.cos * seat.sin, seat.sin**2
        stiffness = np.stack(
            [
                seat.add(rr * cc + 2 * rt * cs + tt * ss),
                seat.add((tt - rr) * cs + rt * (cc - ss)),
                seat.add(rr * ss - 2 * rt * cs + tt * cc),
            ]
        )
        path_r, path_t = -self._motion.centre_t, self._motion.centre_r
        torque_r, torque_t = (row.reshape(shape) for row in torque_rate)
        return Sums(
            turned(f_r, f_t),
            stiffness,
            seat.add(self._torque().reshape(shape)),
            turned(rr * path_r + rt * path_t, rt * path_r + tt * path_t),
            turned(torque_r, torque_t),
            seat.add(torque_r * path_r + torque_t * path_t),
        )

    def _torque(self) -> Array:
        return (self._every.path_radius + self._x[0]) * (self._forces[2] - self._forces[3])

    def result(self, centres: Centres) -> dict[str, Array]:
        """The fields of `Equilibrium` but the status."""
        pin_r, pin_t = (pin.ravel() for pin in self._motion.pin(self._seat, centres))
        gear, crank, plus, minus = self._forces
        values = {
            "gear": gear,
            "crank": crank,
            "cage_plus": plus,
            "cage_minus": minus,
            "output_torque": self._torque(),
            "crank_torque": crank * (pin_r * self._normal[1] - pin_t * self._normal[0]),
            "radial": self._x[0],
            "tangential": self._x[1],
        }
        return {name: value.reshape(self._shape) for name, value in values.items()}

    def status(self) -> NDArray[np.int8]:
        """ITERATED, UNLOADED or NOT_CONVERGED."""
        f = self._forces
        carries = np.maximum(f[0], f[1]) > 1e-12 * f.max(axis=0, initial=0.0)
        found = np.where(self._converged, np.where(carries, Status.ITERATED, Status.UNLOADED), Status.NOT_CONVERGED)
        return found.reshape(self._shape).astype(np.int8)
