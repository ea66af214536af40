"""Elements between moving bodies or with other contact laws, in closed form: one pass over all of them at a time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..contact.element_contacts import Contacts
from ..contact.laws import bore_law
from ..numerics.arrays import Array
from .closed_form_pass import (
    GearContact,
    PassArrays,
    WallContact,
    closing_condition,
    eccentric_centre,
    next_normal,
    select_wall,
    touch_gear_and_wall,
    write_solution,
)
from .shared_bodies import BodyDisplacements, ElementGroups, Resultants
from .solution import Equilibrium, Status

NORMAL_TOLERANCE = 2e-10
"""Greatest rotation of the crank's normal in the last pass, rad; in the next it would be a hundred times smaller."""
MAX_ROTATION = 1e-9
"""Rotation in the last pass, rad, above which an element counts as not converged."""
WALL_PASSES = 3
"""Passes that may still change the wall that an element touches."""


@dataclass(frozen=True, eq=False)
class EccentricMotion:
    """The eccentric's centre in the frames of n elements at m crank twists, with rigid bodies.

    centre_r, centre_t: (m, n) m; twist: (m,) rad.
    """

    centre_r: Array
    centre_t: Array
    twist: Array

    @staticmethod
    def of(contacts: Contacts, twist: Array) -> EccentricMotion:
        """The motion of the contacts' eccentrics."""
        shape = (len(twist), len(contacts))
        centre_r, centre_t, work = np.empty(shape), np.empty(shape), np.empty(shape)
        eccentric_centre(contacts, twist, centre_r, centre_t, work)
        return EccentricMotion(centre_r, centre_t, twist)

    def of_elements(self, index: NDArray[np.intp]) -> EccentricMotion:
        """The motion that some of the elements see."""
        return EccentricMotion(self.centre_r[:, index], self.centre_t[:, index], self.twist)

    def displacement(self, groups: ElementGroups, bodies: BodyDisplacements) -> tuple[Array, Array]:
        """Radial and tangential displacement of the centre by bearing and housing, (m, n) m."""
        y1, y2 = np.take(bodies.centre[0], groups.group, axis=1), np.take(bodies.centre[1], groups.group, axis=1)
        r, t = y1 * groups.cos, y1 * groups.sin
        r -= y2 * groups.sin
        t += np.multiply(y2, groups.cos, out=y2)
        if bodies.twist.any():
            pin_r, pin_t = self.crank_pin(groups, bodies)
            r += pin_r - self.centre_r
            t += pin_t - self.centre_t
        return r, t

    def crank_pin(self, groups: ElementGroups, bodies: BodyDisplacements) -> tuple[Array, Array]:
        """Position of the crank's pin, where the crank's torque acts: rotated back by the housing's twist, (m, n) m."""
        if not bodies.twist.any():
            return self.centre_r, self.centre_t
        lost = bodies.twist[:, groups.drive]
        cos, sin = np.cos(lost), np.sin(lost)
        return cos * self.centre_r + sin * self.centre_t, cos * self.centre_t - sin * self.centre_r


class ClosedFormElements:
    """Elements that touch gear, crank and one wall; every call of `take_pass` refreshes them once.

    rotation: greatest rotation of a crank's normal in the last pass, rad.
    """

    def __init__(self, contacts: Contacts, groups: ElementGroups, motion: EccentricMotion) -> None:
        c, options, shape = contacts, contacts.options, motion.centre_r.shape
        self._c, self._groups, self._motion = c, groups, motion
        self.eccentricity, self.rotation = c.eccentricity, 0.0
        self._housing_yields = math.isfinite(options.housing_stiffness)
        self._ring_compliance, self._wall_compliance = 1 / options.ring_stiffness, 1 / options.cage_wall_stiffness
        self._bore = bore_law(c) if options.cage_contact == "lamina" else None
        self._power_law = self._bore is None and self._ring_compliance == 0 and self._wall_compliance == 0
        self._wall = WallContact.of(c)
        self._gear = GearContact.of(c, c.normal_r, c.normal_t, c.gear_gap, c.stiffness_gear)
        self._a = PassArrays.empty(shape)
        self._s, self._force, self._rate = np.zeros(shape), np.zeros(shape), np.zeros(shape)
        self._rotations, self._s_residual = np.zeros(shape), np.zeros(shape)
        self._foot = np.broadcast_to(c.beta, shape)
        self._started = False
        self._excluded: NDArray[np.intp] | None = None

    def exclude(self, index: NDArray[np.intp]) -> None:
        """From now on elements `index` are solved elsewhere and exert no force here."""
        self._excluded = index

    def take_pass(self, bodies: BodyDisplacements, number: int) -> None:
        """Forces and displacements with the crank's normal of the last pass, and the next normal."""
        a, c, gear, motion = self._a, self._c, self._gear, self._motion
        centre_r, centre_t = motion.centre_r, motion.centre_t
        if bodies.any_nonzero:
            moved_r, moved_t = motion.displacement(self._groups, bodies)
            moved_r += centre_r
            moved_t += centre_t
            centre_r, centre_t = moved_r, moved_t
        np.subtract(c.path_radius, centre_r, out=a.d_r)
        if number <= WALL_PASSES:
            select_wall(a, gear, centre_t)
        touch_gear_and_wall(a, gear, self._wall, centre_t)
        if self._started:
            a.t, a.t_next = a.t_next, a.t
        else:
            np.divide(a.d_t, a.d_r, out=a.t)
            self._started = True
        if self._power_law:
            self._solve_power_law()
        else:
            self._solve_general_law(4 if number == 1 else 2)
        a.x_r -= np.multiply(a.slope, a.x_t, out=a.work)
        self._rotations[:] = next_normal(a)
        if not self._power_law:
            np.maximum(self._rotations, self._s_residual, out=self._rotations)
        if self._excluded is not None:
            for values in (self._rotations, self._force, self._rate):
                values[:, self._excluded] = 0.0
        self.rotation = float(self._rotations.max(initial=0.0))
        if c.profile is not None:
            self._refresh_gear_contact()

    def _solve_power_law(self) -> None:
        """Forces, N, their derivative by the approach, N/m, and displacements for contacts of one power law."""
        a, c, p, s = self._a, self._c, self._c.exponent, self._s
        closing_condition(a, self._gear, self._wall, c, approach=s)
        yielding = a.x_r
        yielding += np.multiply(a.w, a.x_t, out=a.work)
        np.maximum(s, 0.0, out=s)
        s /= yielding
        # dF/d(approach) = p F/(s yielding), zero without contact.
        rate = np.sqrt(s, out=self._rate) if p == 1.5 else np.power(s, p - 1, out=self._rate)
        rate *= c.stiffness_crank
        np.multiply(rate, s, out=self._force)
        rate *= p
        rate /= yielding
        a.x_t *= s
        np.multiply(s, self._gear.yielding, out=a.x_r)

    def _solve_general_law(self, steps: int) -> None:
        """The same for other laws, whose indentations are not linear in s: Newton's method from the last pass's s."""
        a, c, p, k = self._a, self._c, self._c.exponent, self._c.stiffness_crank
        approach = np.empty_like(self._s)
        closing_condition(a, self._gear, self._wall, c, approach)
        yielding, wall_yielding, w = a.x_r, a.x_t, a.w
        ring = self._ring_compliance * self._gear.inverse_n_r**2
        first = np.maximum(approach / (yielding + (0 if self._bore is not None else w * wall_yielding)), 0.0)
        s = np.where((self._s > 0) & (approach > 0), self._s, first)
        for _ in range(steps):
            force, force_by_s = k * s**p, p * k * s ** (p - 1)
            into_wall, wall_rate = self._wall_indentation(s, force, force_by_s)
            total = s * yielding + force * ring + w * into_wall
            slope = yielding + force_by_s * ring + w * wall_rate
            s = np.maximum(s - (total - approach) / slope, 0.05 * s)
            s = np.where(approach > 0, s, 0.0)
        force, force_by_s = k * s**p, p * k * s ** (p - 1)
        into_wall, wall_rate = self._wall_indentation(s, force, force_by_s)
        slope = yielding + force_by_s * ring + w * wall_rate
        # What is left of the closing condition rotates the normal of the next pass.
        residual = np.abs(s * yielding + force * ring + w * into_wall - approach)
        self._s_residual = np.where(approach > 0, residual / c.radius_sum, 0.0)
        self._s, self._force, self._rate = s, force, force_by_s / slope
        np.add(s * self._gear.yielding, force * ring, out=a.x_r)
        a.x_t[:] = into_wall

    def _wall_indentation(self, s: Array, force: Array, force_by_s: Array) -> tuple[Array, Array]:
        """Displacement into the wall, m, and its derivative by s; a.x_t holds the power law's per s."""
        w = self._a.w
        on_wall = force * w
        if self._bore is None:
            indentation, rate = s * self._a.x_t, self._a.x_t
        else:
            indentation, by_force = self._bore.approach(on_wall)
            rate = by_force * w * force_by_s
        return indentation + on_wall * self._wall_compliance, rate + w * force_by_s * self._wall_compliance

    def _refresh_gear_contact(self) -> None:
        """The gear's contact at the points nearest to the elements' new positions."""
        c, profile = self._c, self._c.profile
        assert profile is not None
        point = profile.nearest_point(c.beta, self.displacement(), self._foot)
        moved = np.abs(point.beta - self._foot) / profile.path.lobes
        if self._excluded is not None:
            moved[:, self._excluded] = 0.0
        np.maximum(self._rotations, moved, out=self._rotations)
        self.rotation = float(self._rotations.max(initial=0.0))
        self._foot = point.beta
        stiffness = profile.stiffness(point, c.element_radius, c.gear_gap)
        self._gear = GearContact.of(c, point.normal_r, point.normal_t, c.gear_gap + point.offset, stiffness)

    def displacement(self) -> Array:
        """Displacement of the elements' centres, (2, m, n) m."""
        a = self._a
        return np.stack([a.x_r + a.touch, (a.x_t + self._wall.gap) * a.wall])

    def not_converged(self) -> NDArray[np.bool_]:
        """Elements whose normal still rotates, or that are pushed to the other wall than the selected one, (m, n)."""
        converged = self._rotations <= MAX_ROTATION
        wrong_wall = (self._a.t - self._a.slope < -1e-9) & (self._s > 0)
        return ~converged | wrong_wall

    def resultants(self) -> Resultants:
        """Resultants of the elements' forces on eccentrics and drives."""
        a, groups, t = self._a, self._groups, self._a.wall * self._a.t
        v1, v2 = t * groups.sin, t * groups.cos
        v1 += groups.cos
        v2 -= groups.sin
        force = np.stack([groups.sum(self._force * v1), groups.sum(self._force * v2)])
        rate_1, rate_2 = self._rate * v1, self._rate * v2
        stiffness = np.stack([groups.sum(rate_1 * v1), groups.sum(rate_1 * v2), groups.sum(rate_2 * v2)])
        if not self._housing_yields:
            return Resultants(force, stiffness, np.zeros_like(force[0]))
        # Derivative of the approach by the crank's twist.
        by_twist = self._motion.centre_r * t - self._motion.centre_t
        lever = (self._c.path_radius + a.x_r + a.touch) * a.w * a.wall
        return Resultants(
            force,
            stiffness,
            groups.sum(lever * self._force),
            np.stack([groups.sum(rate_1 * by_twist), groups.sum(rate_2 * by_twist)]),
            np.stack([groups.sum(lever * rate_1), groups.sum(lever * rate_2)]),
            groups.sum(lever * self._rate * by_twist),
        )

    def solution(self, bodies: BodyDisplacements) -> Equilibrium:
        """Forces, torques, displacements and status of the last pass; NOT_CONVERGED where it does not hold."""
        out = Equilibrium.empty(self._motion.centre_r.shape)
        out.status[:] = np.where(self._s > 0, Status.LOADED, Status.UNLOADED)
        out.status[self.not_converged()] = Status.NOT_CONVERGED
        pin = self._motion.crank_pin(self._groups, bodies)
        write_solution(self._a, self._force, self._gear, self._wall, self._c, pin, out)
        return out
