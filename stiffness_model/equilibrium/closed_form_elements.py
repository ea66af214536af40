"""Elements inside the outer equilibrium of `coupled`, in closed form: one pass over all of them at a time."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..contact.element_contacts import Contacts
from ..contact.laws import bore_law
from ..numerics.arrays import Array
from .shared_bodies import Centres, Seat, Sums
from .solution import Status, root

TURN = 2e-10
"""Greatest turn of the crank's normal, rad, in the last pass; the next is a hundred times smaller."""
CHOOSING = 3
"""Passes that may still change the wall an element leans to."""


@dataclass(frozen=True)
class Motion:
    """The eccentric's centre as n elements see it at m crank twists, unyielding: radial and tangential, (m, n) m."""

    centre_r: Array
    centre_t: Array
    twist: Array

    @staticmethod
    def of(contacts: Contacts, twist: Array) -> Motion:
        """By the addition theorem: cheaper than a sine of every pair."""
        e_cos, e_sin = contacts.eccentricity * np.cos(contacts.beta), contacts.eccentricity * np.sin(contacts.beta)
        cos, sin = np.cos(twist)[:, None], np.sin(twist)[:, None]
        return Motion(cos * e_cos - sin * e_sin, sin * e_cos + cos * e_sin, twist)

    def of_elements(self, index: NDArray[np.intp]) -> Motion:
        """Some elements'."""
        return Motion(self.centre_r[:, index], self.centre_t[:, index], self.twist)

    def shift(self, seat: Seat, centres: Centres) -> tuple[Array, Array]:
        """Radial and tangential displacement of the centre by bearing and housing, (m, n) m."""
        y1, y2 = np.take(centres.shift[0], seat.group, axis=1), np.take(centres.shift[1], seat.group, axis=1)
        r, t = y1 * seat.cos, y1 * seat.sin
        r -= y2 * seat.sin
        t += np.multiply(y2, seat.cos, out=y2)
        if centres.twist.any():
            pin_r, pin_t = self.pin(seat, centres)
            r += pin_r - self.centre_r
            t += pin_t - self.centre_t
        return r, t

    def pin(self, seat: Seat, centres: Centres) -> tuple[Array, Array]:
        """The crank pin's place, turned back by what the housing takes: the crank's torque acts there."""
        if not centres.twist.any():
            return self.centre_r, self.centre_t
        lost = centres.twist[:, seat.drive]
        cos, sin = np.cos(lost), np.sin(lost)
        return cos * self.centre_r + sin * self.centre_t, cos * self.centre_t - sin * self.centre_r


class ClosedForm:
    """Elements that touch gear, crank and one wall; every call of `take_pass` refreshes them once."""

    def __init__(self, contacts: Contacts, seat: Seat, motion: Motion) -> None:
        c, p = contacts, contacts.exponent
        self._c, self._seat, self._motion = c, seat, motion
        self.eccentricity, self.tolerance, self.turn = c.eccentricity, TURN, 0.0
        options = c.beyond
        self._housing = math.isfinite(options.housing_stiffness)
        self._ring, self._wall_give = 1 / options.ring_stiffness, 1 / options.cage_wall_stiffness
        self._bore = bore_law(c) if options.cage_contact == "lamina" else None
        self._power = self._bore is None and self._ring == 0 and self._wall_give == 0
        self._cage_gap = np.maximum(c.cage_gap, 0.0)
        self._cage_give = root(c.stiffness_crank / c.stiffness_cage, p)
        shape = motion.centre_r.shape
        self._s, self._foot = np.zeros(shape), np.broadcast_to(c.beta, shape)
        self._started = False
        self._muted: NDArray[np.intp] | None = None
        self._gear(c.normal_r, c.normal_t, c.gear_gap, c.stiffness_gear)

    def _gear(self, normal_r: Array, normal_t: Array, gap: Array, stiffness: Array) -> None:
        per_n_r = 1 / normal_r
        self._slope, self._gap, self._per_n_r = normal_t * per_n_r, gap * per_n_r, per_n_r
        self._gear_give = root(self._c.stiffness_crank / (stiffness * normal_r), self._c.exponent) * per_n_r

    def mute(self, index: NDArray[np.intp]) -> None:
        """Elements that someone else solves: from now on they do nothing here."""
        self._muted = index

    def take_pass(self, centres: Centres, done: int) -> None:
        """Forces and displacements with the crank's normal of the last pass, and the next normal."""
        c, p, motion = self._c, self._c.exponent, self._motion
        centre_r, centre_t = motion.centre_r, motion.centre_t
        if centres.moved:
            shift_r, shift_t = motion.shift(self._seat, centres)
            shift_r += centre_r
            shift_t += centre_t
            centre_r, centre_t = shift_r, shift_t
        d_r = c.path_radius - centre_r
        if done <= CHOOSING:
            # The wall is the one the neutral position leans to.
            lean = centre_t / d_r
            lean += self._slope
            self._wall = np.copysign(1.0, np.negative(lean, out=lean))
        wall = self._wall
        if done <= CHOOSING or c.profile is not None:
            self._leaning = wall * self._slope
            self._touch = self._gap - self._leaning * self._cage_gap
        slope = self._leaning
        d_r += self._touch
        d_t = self._cage_gap - wall * centre_t
        if not self._started:
            self._t, self._started = d_t / d_r, True
        t = self._t
        w = t - slope
        np.maximum(w, 0.0, out=w)
        per = t * t
        per += 1.0
        np.sqrt(per, out=per)
        cage_give = root(w, p)
        cage_give *= self._cage_give
        give = root(per, p)
        give *= per
        give += self._gear_give
        approach = per * c.radius_sum
        approach -= d_r
        approach -= t * d_t
        if self._power:
            give += w * cage_give
            s = np.maximum(approach, 0.0, out=approach)
            s /= give
            # dF/d(approach along the radius) = p F/(s G), nought without contact.
            rate = np.sqrt(s) if p == 1.5 else s ** (p - 1)
            rate *= c.stiffness_crank
            force = rate * s
            rate *= p
            rate /= give
            x_t = np.multiply(s, cage_give, out=cage_give)
            x_r = s * self._gear_give
        else:
            s, force, rate, x_r, x_t = self._general(approach, give, cage_give, w, done)
        x_r -= slope * x_t
        d_t += x_t
        d_r += x_r
        t_next = np.divide(d_t, d_r, out=d_t)
        turn = np.abs(np.subtract(t_next, t, out=d_r), out=d_r)
        if not self._power:
            np.maximum(turn, self._left, out=turn)
        if self._muted is not None:
            for values in (turn, force, rate):
                values[:, self._muted] = 0.0
        self._turns, self.turn = turn, float(turn.max(initial=0.0))
        self._x, self._s, self._force, self._rate, self._w, self._per = (x_r, x_t), s, force, rate, w, per
        self._used_t, self._t = t, t_next
        if c.profile is not None:
            self._follow()

    def _general(self, approach: Array, give: Array, cage_give: Array, w: Array, done: int) -> tuple[Array, ...]:
        """Newton's step on G(s) = approach where the contacts are no power laws, from the last pass's s."""
        c, p = self._c, self._c.exponent
        ring = self._ring * self._per_n_r**2
        first = np.maximum(approach / (give + (0 if self._bore is not None else w * cage_give)), 0.0)
        s = np.where((self._s > 0) & (approach > 0), self._s, first)
        for _ in range(4 if done == 1 else 2):
            force = c.stiffness_crank * s**p
            by_s = p * c.stiffness_crank * s ** (p - 1)
            yielded, wall_rate = self._wall_yield(s, force, by_s, w, cage_give)
            whole = s * give + force * ring + w * yielded
            slope = give + by_s * ring + w * wall_rate
            s = np.maximum(s - (whole - approach) / slope, 0.05 * s)
            s = np.where(approach > 0, s, 0.0)
        force = c.stiffness_crank * s**p
        by_s = p * c.stiffness_crank * s ** (p - 1)
        yielded, wall_rate = self._wall_yield(s, force, by_s, w, cage_give)
        slope = give + by_s * ring + w * wall_rate
        # An s that still moves turns the normal that the next pass will find.
        self._left = np.where(
            approach > 0, np.abs(s * give + force * ring + w * yielded - approach) / c.radius_sum, 0.0
        )
        return s, force, by_s / slope, s * self._gear_give + force * ring, yielded

    def _wall_yield(self, s: Array, force: Array, by_s: Array, w: Array, cage_give: Array) -> tuple[Array, Array]:
        """Displacement into the wall and its derivative by s."""
        on_wall = force * w
        if self._bore is None:
            yielded, rate = s * cage_give, cage_give
        else:
            yielded, by_force = self._bore.approach(on_wall)
            rate = by_force * w * by_s
        return yielded + on_wall * self._wall_give, rate + w * by_s * self._wall_give

    def _follow(self) -> None:
        """The gear at the point nearest to the elements' new places."""
        c, profile = self._c, self._c.profile
        assert profile is not None
        x = self.displacement()
        foot = profile.nearest_point(c.beta, x, self._foot)
        moved = np.abs(foot.beta - self._foot) / profile.path.lobes
        if self._muted is not None:
            moved[:, self._muted] = 0.0
        self._turns = np.maximum(self._turns, moved)
        self.turn = float(self._turns.max(initial=0.0))
        self._foot = foot.beta
        self._gear(
            foot.normal_r,
            foot.normal_t,
            c.gear_gap + foot.offset,
            profile.stiffness(foot, c.element_radius, c.gear_gap),
        )

    def displacement(self) -> Array:
        """(2, m, n) m."""
        return np.stack([self._x[0] + self._touch, (self._x[1] + self._cage_gap) * self._wall])

    def unsettled(self) -> NDArray[np.bool_]:
        """Elements that the passes did not bring to rest, or that lean to the other wall than the one chosen."""
        still = self._turns <= 1e-9
        wrong = (self._used_t - self._leaning < -1e-9) & (self._s > 0)
        return ~still | wrong

    def sums(self) -> Sums:
        """What the eccentrics and drives feel."""
        seat, t = self._seat, self._wall * self._used_t
        v1, v2 = t * seat.sin, t * seat.cos
        v1 += seat.cos
        v2 -= seat.sin
        force = np.stack([seat.add(self._force * v1), seat.add(self._force * v2)])
        rate_1, rate_2 = self._rate * v1, self._rate * v2
        stiffness = np.stack([seat.add(rate_1 * v1), seat.add(rate_1 * v2), seat.add(rate_2 * v2)])
        if not self._housing:
            return Sums(force, stiffness, np.zeros_like(force[0]))
        # dE/d(crank twist), and how the approach follows it.
        path = self._motion.centre_r * t - self._motion.centre_t
        lever = (self._c.path_radius + self._x[0] + self._touch) * self._w * self._wall
        return Sums(
            force,
            stiffness,
            seat.add(lever * self._force),
            np.stack([seat.add(rate_1 * path), seat.add(rate_2 * path)]),
            np.stack([seat.add(lever * rate_1), seat.add(lever * rate_2)]),
            seat.add(lever * self._rate * path),
        )

    def result(self, centres: Centres) -> dict[str, Array]:
        """The fields of `Equilibrium` but the status."""
        cage = self._force * self._w * self._wall
        t = self._wall * self._used_t
        pin_r, pin_t = self._motion.pin(self._seat, centres)
        x_r, x_t = self.displacement()
        return {
            "gear": self._force * self._per_n_r,
            "crank": self._force * self._per,
            "cage_plus": np.maximum(cage, 0.0),
            "cage_minus": np.maximum(-cage, 0.0),
            "output_torque": (self._c.path_radius + x_r) * cage,
            "crank_torque": self._force * (pin_r * t - pin_t),
            "radial": x_r,
            "tangential": x_t,
        }

    def status(self) -> NDArray[np.int8]:
        """UNLOADED, LOADED or NOT_CONVERGED."""
        found = np.where(self._s > 0, Status.LOADED, Status.UNLOADED)
        return np.where(self.unsettled(), Status.NOT_CONVERGED, found).astype(np.int8)
