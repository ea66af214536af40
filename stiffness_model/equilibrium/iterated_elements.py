"""Elements that need an iteration inside the equilibrium of the shared bodies.

These are elements larger than their bores, under inertia or external forces, or whose closed form does not converge.
Between two iterations their forces on the bodies are linearised.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ..contact.element_contacts import Contacts
from ..numerics.arrays import Array
from .closed_form_elements import EccentricMotion
from .newton import MAX_ELEMENTS, crank_tangent, minimise_energy
from .shared_bodies import BodyDisplacements, ElementGroups, Resultants
from .solution import Equilibrium, Status

POINT_TOLERANCE = 1e-9
"""Greatest last change of the nearest point along an exact profile, rad."""
MAX_POINT_STEPS = 25
"""Refreshes of the contact's stiffness at the nearest point; chosen by judgement, a handful usually suffice."""


@dataclass(frozen=True, eq=False)
class LinearisedResultants:
    """Resultants of the iterated elements, linearised about the displacements `base` at which they were solved."""

    resultants: Resultants
    base: BodyDisplacements
    drive_of_group: NDArray[np.intp]

    def at(self, bodies: BodyDisplacements) -> Resultants:
        """The resultants at other displacements of the bodies."""
        s = self.resultants
        d1, d2 = bodies.centre - self.base.centre
        s11, s12, s22 = s.stiffness
        force = s.force + np.stack([s11 * d1 + s12 * d2, s12 * d1 + s22 * d2])
        if s.force_by_twist is None or s.torque_by_centre is None or s.torque_by_twist is None:
            return replace(s, force=force)
        lost = (bodies.twist - self.base.twist)[:, self.drive_of_group]
        torque = s.torque + s.torque_by_centre[0] * d1 + s.torque_by_centre[1] * d2 - s.torque_by_twist * lost
        return replace(s, force=force - s.force_by_twist * lost, torque=torque)


class IteratedElements:
    """n elements at m twists, each pair solved by `newton.minimise_energy`."""

    def __init__(
        self, contacts: Contacts, groups: ElementGroups, motion: EccentricMotion, load: Array, start: Array
    ) -> None:
        """load: (2, n) external forces, N; start: (2, m, n) first displacements, m."""
        self._c, self._groups, self._motion = contacts, groups, motion
        m, n = self._shape = motion.centre_r.shape
        self._pairs = contacts[np.tile(np.arange(n), m)]
        self._twist, self._load = np.repeat(motion.twist, n), np.tile(load, m)
        self._x = start.reshape(2, -1).copy()
        self._foot, self._gear = self._pairs.beta.copy(), self._pairs.stiffness_gear.copy()
        self._forces, self._normal = np.zeros((4, m * n)), np.zeros((2, m * n))
        self._converged = np.zeros(m * n, bool)

    def solve_linearised(self, bodies: BodyDisplacements, drive_of_group: NDArray[np.intp]) -> LinearisedResultants:
        """Solve every element with the bodies fixed; returns the resultants and their derivatives."""
        return LinearisedResultants(self._resultants(self.solve(bodies)), bodies, drive_of_group)

    def solve(self, bodies: BodyDisplacements) -> Array:
        """Solve every element with the bodies fixed; returns the centre's displacement for each pair, (2, m n) m."""
        displacement = np.stack(self._motion.displacement(self._groups, bodies)).reshape(2, -1)
        profile, active = self._c.profile, np.arange(len(self._pairs))
        if profile is None:
            self._iterate(active, self._pairs, displacement)
            return displacement
        for _ in range(MAX_POINT_STEPS):
            # The iteration itself follows the profile; only the contact's stiffness is constant meanwhile.
            some = self._pairs[active]
            point = profile.nearest_point(some.beta, self._x[:, active], self._foot[active], steps=3)
            moved = np.abs(point.beta - self._foot[active])
            self._foot[active] = point.beta
            self._gear[active] = profile.stiffness(point, some.element_radius, some.gear_gap)
            self._iterate(active, replace(some, stiffness_gear=self._gear[active]), displacement)
            active = active[moved > POINT_TOLERANCE]
            if not len(active):
                break
        return displacement

    def _iterate(self, active: NDArray[np.intp], some: Contacts, displacement: Array) -> None:
        """Solve the contacts `some` of the pairs `active`, a block at a time."""
        for first in range(0, len(active), MAX_ELEMENTS):
            part = slice(first, first + MAX_ELEMENTS)
            index = active[part]
            found = minimise_energy(
                some[part], self._twist[index], self._load[:, index], self._x[:, index], displacement[:, index]
            )
            self._x[:, index], self._forces[:, index], self._normal[:, index], self._converged[index] = found
        self._forces[:, ~self._converged] = 0.0

    def _resultants(self, displacement: Array) -> Resultants:
        groups, shape = self._groups, self._shape
        contacts = replace(self._pairs, stiffness_gear=self._gear)
        rate, torque_rate = crank_tangent(contacts, self._twist, self._x, displacement)
        rr, rt, tt = (row.reshape(shape) for row in rate)
        f_r, f_t = (self._forces[1] * u for u in self._normal)

        def in_crank_frame(r: Array, t: Array) -> Array:
            """Vectors rotated into the crank's frame and summed over each eccentric."""
            r, t = r.reshape(shape), t.reshape(shape)
            return np.stack([groups.sum(r * groups.cos + t * groups.sin), groups.sum(t * groups.cos - r * groups.sin)])

        cc, cs, ss = groups.cos**2, groups.cos * groups.sin, groups.sin**2
        stiffness = np.stack(
            [
                groups.sum(rr * cc + 2 * rt * cs + tt * ss),
                groups.sum((tt - rr) * cs + rt * (cc - ss)),
                groups.sum(rr * ss - 2 * rt * cs + tt * cc),
            ]
        )
        path_r, path_t = -self._motion.centre_t, self._motion.centre_r
        torque_r, torque_t = (row.reshape(shape) for row in torque_rate)
        return Resultants(
            in_crank_frame(f_r, f_t),
            stiffness,
            groups.sum(self._torque().reshape(shape)),
            in_crank_frame(rr * path_r + rt * path_t, rt * path_r + tt * path_t),
            in_crank_frame(torque_r, torque_t),
            groups.sum(torque_r * path_r + torque_t * path_t),
        )

    def _torque(self) -> Array:
        return (self._pairs.path_radius + self._x[0]) * (self._forces[2] - self._forces[3])

    def solution(self, bodies: BodyDisplacements) -> Equilibrium:
        """Forces, torques, displacements and status; no force where the iteration did not converge."""
        pin_r, pin_t = (pin.ravel() for pin in self._motion.crank_pin(self._groups, bodies))
        gear, crank, plus, minus = f = self._forces
        carries = np.maximum(gear, crank) > 1e-12 * f.max(axis=0, initial=0.0)
        status = np.where(self._converged, np.where(carries, Status.ITERATED, Status.UNLOADED), Status.NOT_CONVERGED)
        crank_torque = crank * (pin_r * self._normal[1] - pin_t * self._normal[0])
        values = (gear, crank, plus, minus, self._torque(), crank_torque, self._x[0], self._x[1])
        return Equilibrium(
            *(value.reshape(self._shape) for value in values), status=status.reshape(self._shape).astype(np.int8)
        )
