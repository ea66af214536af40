"""Stored energy of discs at given poses, with its first and second derivatives, vectorised over rows and twists.

The contacts follow F = K d^(10/9) of the approach d = -g (`elasticity.hertz.line_stiffness`), in series with a linear
spring where bodies behind the contact are elastic. The force field is conservative: torque on the output, forces and
moment on a disc are the derivatives of one energy.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...elasticity.hertz import LINE_EXPONENT
from ...numerics.arrays import Array, Index
from .disc_contacts import DiscContacts

PAIRS = tuple((i, j) for i in range(4) for j in range(i, 4))
"""Indices of the ten independent second derivatives."""
SERIES_STEPS = 3
"""Newton steps for the contact's part of the approach where a spring is in series. The first guess is off by less than
a tenth and the error is squared by each step, so that three leave rounding errors."""


@dataclass(frozen=True, eq=False)
class DiscStates:
    """Energy and derivatives at poses of D rows at T twists each.

    energy: (D, T) J; gradient: (D, T, 4) N, by the pose; hessian: (D, T, 10) N/m, in the order of `PAIRS`;
    total_force: (D, T) N, the sum of the contact forces.
    """

    energy: Array
    gradient: Array
    hessian: Array
    total_force: Array

    def copy(self) -> DiscStates:
        """States with arrays of their own."""
        return DiscStates(self.energy.copy(), self.gradient.copy(), self.hessian.copy(), self.total_force.copy())

    def at(self, place: tuple[Index, Index]) -> DiscStates:
        """The states at `place`, indices of rows (D', 1) and twists (D', T')."""
        return DiscStates(self.energy[place], self.gradient[place], self.hessian[place], self.total_force[place])

    def put(self, place: tuple[Index, Index], states: DiscStates) -> None:
        """Overwrite the states at `place`, as for `at`."""
        self.energy[place], self.gradient[place] = states.energy, states.gradient
        self.hessian[place], self.total_force[place] = states.hessian, states.total_force

    def where(self, condition: NDArray[np.bool_], others: DiscStates) -> DiscStates:
        """These states where the condition (D, T) holds, the others elsewhere."""
        wide = condition[..., None]
        return DiscStates(
            np.where(condition, self.energy, others.energy),
            np.where(wide, self.gradient, others.gradient),
            np.where(wide, self.hessian, others.hessian),
            np.where(condition, self.total_force, others.total_force),
        )


@dataclass(frozen=True, eq=False)
class ContactStates:
    """What the poses mean for the contacts: (D, T, C).

    force: N. moment: N.m, of the pins' forces on the disc about its centre, of the rollers' on the output. turning:
    |k t|/(1 + k n), the tangent of the angle by which the normal of a contact under load turned; 0 without load.
    """

    force: Array
    moment: Array
    turning: Array


class DiscEnergy:
    """The energy of the discs of some rows of contacts."""

    def __init__(self, contacts: DiscContacts, products: Array | None = None) -> None:
        self._contacts = contacts
        self._has_series = bool(contacts.series.any())
        self._derivatives = np.concatenate([contacts.normal, contacts.tangent], -1).swapaxes(1, 2)
        self._products = _products(contacts) if products is None else products

    def rows(self, index: Index) -> DiscEnergy:
        """The energy of some of the rows, (k,) indices."""
        return DiscEnergy(self._contacts[index], self._products[index])

    def _approaches(self, pose: Array) -> tuple[Array, Array, Array, Array]:
        """Approaches (D, T, C), m, zero without contact; 1 + k n, k t, and the root of the sum of their squares."""
        c = self._contacts
        n, t = pose @ c.normal, pose @ c.tangent
        bent_n, bent_t = 1.0 + c.curvature * n, c.curvature * t
        distance = np.sqrt(bent_n * bent_n + bent_t * bent_t)
        # (distance - 1)/k without its cancellation, and for a straight flank too.
        opening = (n + n * bent_n + t * bent_t) / (1.0 + distance)
        return np.maximum(-opening - c.gap, 0.0), bent_n, bent_t, distance

    def contacts_at(self, pose: Array) -> ContactStates:
        """The contacts at poses (D, T, 4)."""
        approach, bent_n, bent_t, distance = self._approaches(pose)
        force, c = self._law(approach)[0], self._contacts
        # Derivatives of n and t by the disc's rotation for pins, by the output's, which is negative, for rollers.
        lever_n, lever_t = (np.concatenate([d[:, 2, : c.pins], -d[:, 3, c.pins :]], -1) for d in (c.normal, c.tangent))
        lever = (bent_n * lever_n[:, None] + bent_t * lever_t[:, None]) / distance
        return ContactStates(
            force=force,
            moment=force * lever * c.radius,
            turning=np.where(approach > 0, np.abs(bent_t / bent_n), 0.0),
        )

    def at(self, pose: Array, centre: Array) -> DiscStates:
        """Energy and derivatives at poses (D, T, 4), with the eccentric's centre displaced by `centre`, (D, T, 2) m."""
        approach, bent_n, bent_t, distance = self._approaches(pose)
        force, stiffness, energy = self._law(approach)
        contacts = self._contacts.gap.shape[-1]
        inverse = 1.0 / distance
        by_n, by_t = np.multiply(bent_n, inverse, out=bent_n), np.multiply(bent_t, inverse, out=bent_t)
        weights = np.empty((*pose.shape[:2], 3 * contacts))
        along, mixed, across = (weights[..., k * contacts : (k + 1) * contacts] for k in range(3))
        np.multiply(force, by_n, out=along)
        np.multiply(force, by_t, out=mixed)
        gradient = weights[..., : 2 * contacts] @ self._derivatives
        np.negative(gradient, out=gradient)
        # The stiffness along the normal and the turning of the normal under the force: k by_n^2 - turning by_t^2 and
        # its likes, with by_n^2 + by_t^2 = 1.
        turning = np.multiply(force, self._contacts.curvature, out=distance)
        turning *= inverse
        stiffness += turning
        turned = np.multiply(stiffness, by_t, out=inverse)
        np.multiply(turned, by_n, out=mixed)
        np.subtract(np.multiply(turned, by_t, out=across), turning, out=across)
        np.subtract(stiffness, across, out=along)
        along -= 2.0 * turning
        hessian = weights @ self._products
        ones = np.ones(contacts)
        return DiscStates(
            energy=energy @ ones + self._add_bearing(pose[..., :2] - centre, gradient, hessian),
            gradient=gradient,
            hessian=hessian,
            total_force=force @ ones,
        )

    def _law(self, approach: Array) -> tuple[Array, Array, Array]:
        """Force, stiffness and energy at approaches (D, T, C), m."""
        c, p = self._contacts, LINE_EXPONENT
        if not self._has_series:
            slope = c.stiffness * approach ** (p - 1)
            force = slope * approach
            return force, p * slope, force * approach / (p + 1)
        # At the contact d of the approach, K d^p series + d = approach; K d^(p - 1) hardly changes with d.
        soft = c.stiffness * c.series
        local = approach / (1.0 + soft * approach ** (p - 1))
        for _ in range(SERIES_STEPS):
            slope = soft * local ** (p - 1)
            local = (approach + (p - 1) * slope * local) / (1.0 + p * slope)
        slope = c.stiffness * local ** (p - 1)
        force = slope * local
        stiffness = p * slope / (1.0 + p * slope * c.series)
        return force, stiffness, force * local / (p + 1) + c.series * force * force / 2

    def _add_bearing(self, offset: Array, gradient: Array, hessian: Array) -> Array:
        """Add the bearing to gradient and Hessian in place; its energy, (D, T) J. A rigid bearing stores none.

        offset: (D, T, 2) m, of the disc's centre from the eccentric's.
        """
        k, play = self._contacts.bearing_stiffness, self._contacts.bearing_clearance
        if self._contacts.is_rigid:
            return np.zeros(offset.shape[:2])
        radius = np.hypot(offset[..., 0], offset[..., 1])
        safe = np.maximum(radius, 1e-300)
        pressed = np.maximum(radius - play, 0.0)
        cos, sin = offset[..., 0] / safe, offset[..., 1] / safe
        # Along the load the stiffness of the bearing, across it that of a pendulum, force over radius.
        along = np.where(radius >= play, k, 0.0)
        across = k * pressed / safe if play > 0 else along
        gradient[..., 0] += k * pressed * cos
        gradient[..., 1] += k * pressed * sin
        hessian[..., 0] += across + (along - across) * cos * cos
        hessian[..., 1] += (along - across) * cos * sin
        hessian[..., 4] += across + (along - across) * sin * sin
        return k * pressed * pressed / 2


def _products(contacts: DiscContacts) -> Array:
    """Products of derivatives by the pose, (D, 3C, 10): of the normal, mixed and of the tangent, for the Hessian."""
    n, t = contacts.normal, contacts.tangent
    i, j = (list(index) for index in zip(*PAIRS, strict=True))
    parts = (n[:, i] * n[:, j], n[:, i] * t[:, j] + t[:, i] * n[:, j], t[:, i] * t[:, j])
    return np.concatenate(parts, -1).swapaxes(1, 2)
