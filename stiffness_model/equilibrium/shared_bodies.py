"""The bodies that elements share, eccentrics in their bearings and drives in their housings, and their Newton step."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..contact.element_contacts import Contacts
from ..numerics.arrays import Array


@dataclass(frozen=True, eq=False)
class BodyDisplacements:
    """Displacements of the bodies at m twists.

    centre: (2, m, n_groups) m, of each eccentric's centre in the crank's frame (along the eccentricity at zero twist,
    and normal to it); twist: (m, n_drives) rad, crank twist taken by the housing.
    """

    centre: Array
    twist: Array

    @property
    def any_nonzero(self) -> bool:
        """Whether any body is displaced."""
        return bool(self.centre.any() or self.twist.any())

    @property
    def n_twists(self) -> int:
        """m."""
        return len(self.twist)

    def plus(self, step: BodyDisplacements) -> BodyDisplacements:
        """The sum with a step."""
        return BodyDisplacements(self.centre + step.centre, self.twist + step.twist)

    def minus(self, other: BodyDisplacements) -> BodyDisplacements:
        """The difference from other displacements."""
        return BodyDisplacements(self.centre - other.centre, self.twist - other.twist)

    def max_per_drive(self, eccentricity: float) -> Array:
        """Greatest displacement in each drive, (m, n_drives) m; the housing's counts at the eccentric's centre."""
        per_drive = self.centre.shape[2] // max(1, self.twist.shape[1])
        greatest = np.abs(self.centre).max(axis=0)
        if per_drive * self.twist.shape[1] == greatest.shape[1]:
            greatest = greatest.reshape(self.n_twists, self.twist.shape[1], per_drive).max(axis=2)
        else:
            greatest = np.broadcast_to(greatest.max(axis=1, keepdims=True, initial=0.0), self.twist.shape)
        return np.maximum(greatest, np.abs(self.twist) * eccentricity)

    def last(self) -> BodyDisplacements:
        """Those of the last twist."""
        return self.at_twists(slice(-1, None))

    def at_twists(self, part: slice) -> BodyDisplacements:
        """Those of some twists."""
        return BodyDisplacements(self.centre[:, part], self.twist[part])

    def scaled(self, factors: Array) -> BodyDisplacements:
        """Those of a single twist times m factors."""
        return BodyDisplacements(self.centre * factors[:, None], self.twist * factors[:, None])


@dataclass(frozen=True, eq=False)
class ElementGroups:
    """The assignment of n elements to eccentrics (groups) and drives, all (n,) but the last three fields.

    group, drive: indices; cos, sin: of the angle from the crank's frame to the element's. starts: first element of each
    group that has elements; present: those groups; n_groups: number of all groups.
    """

    group: NDArray[np.intp]
    drive: NDArray[np.intp]
    cos: Array
    sin: Array
    starts: NDArray[np.intp]
    present: NDArray[np.intp]
    n_groups: int

    def reordered(self, index: NDArray[np.intp]) -> ElementGroups:
        """The same elements in another order, in which `sum` is not possible."""
        none = np.zeros(0, np.intp)
        return ElementGroups(
            self.group[index], self.drive[index], self.cos[index], self.sin[index], none, none, self.n_groups
        )

    def sum(self, values: Array) -> Array:
        """Sum over the elements of every eccentric, (m, n) -> (m, n_groups)."""
        if len(self.present) == self.n_groups:
            return np.add.reduceat(values, self.starts, axis=1)
        total = np.zeros((len(values), self.n_groups))
        if len(self.present):
            total[:, self.present] = np.add.reduceat(values, self.starts, axis=1)
        return total


@dataclass(frozen=True, eq=False)
class Resultants:
    """Resultants of the elements' forces on every eccentric, (m, n_groups), and their derivatives.

    force: (2, ...) N on the eccentric's elements, in the crank's frame; stiffness: (3, ...) N/m, its derivative by the
    centre's displacement, components 11, 12, 22; torque: N.m on the output. With a compliant housing: force_by_twist:
    (2, ...) N/rad, by the crank's twist; torque_by_centre: (2, ...) N; torque_by_twist: N.m/rad.
    """

    force: Array
    stiffness: Array
    torque: Array
    force_by_twist: Array | None = None
    torque_by_centre: Array | None = None
    torque_by_twist: Array | None = None

    def plus(self, other: Resultants) -> Resultants:
        """The sum of both."""
        return Resultants(
            self.force + other.force,
            self.stiffness + other.stiffness,
            self.torque + other.torque,
            _sum(self.force_by_twist, other.force_by_twist),
            _sum(self.torque_by_centre, other.torque_by_centre),
            _sum(self.torque_by_twist, other.torque_by_twist),
        )


def _sum(a: Array | None, b: Array | None) -> Array | None:
    return None if a is None or b is None else a + b


class SharedBodies:
    """Eccentrics and drives of contacts that are sorted by their eccentric."""

    def __init__(self, contacts: Contacts) -> None:
        options = contacts.options
        self.bearing, self.housing = options.bearing_stiffness, options.housing_stiffness
        self.couples_elements = options.couples_elements
        self.numbers, self.group = np.unique(contacts.eccentric, return_inverse=True)
        self.drives, self.drive_of_group = np.unique(self.numbers // contacts.eccentrics, return_inverse=True)
        self.n_groups, self.n_drives = len(self.numbers), len(self.drives)
        self._first = np.flatnonzero(np.diff(self.drive_of_group, prepend=-1))
        # Torque on the output per crank twist taken by the housing.
        self._housing_per_crank_twist = self.housing / contacts.ratio
        self._cos, self._sin = np.cos(contacts.beta), np.sin(contacts.beta)

    def undisplaced(self, n_twists: int) -> BodyDisplacements:
        """Zero displacements at some twists."""
        return BodyDisplacements(np.zeros((2, n_twists, self.n_groups)), np.zeros((n_twists, self.n_drives)))

    def groups_of(self, index: NDArray[np.intp]) -> ElementGroups:
        """The groups of the elements `index`, in rising order."""
        group = self.group[index]
        starts = np.flatnonzero(np.diff(group, prepend=-1))
        return ElementGroups(
            group, self.drive_of_group[group], self._cos[index], self._sin[index], starts, group[starts], self.n_groups
        )

    def newton_step(self, resultants: Resultants, bodies: BodyDisplacements, fraction: float) -> BodyDisplacements:
        """A fraction of Newton's step of the bodies towards equilibrium."""
        centre, twist = np.zeros_like(bodies.centre), np.zeros_like(bodies.twist)
        yields = math.isfinite(self.bearing)
        none = np.zeros(1)
        inverse, by_twist = (none, none, none), none
        if yields:
            s11, s12, s22 = resultants.stiffness
            a11, a22 = s11 + self.bearing, s22 + self.bearing
            scale = 1 / (a11 * a22 - s12 * s12)
            inverse = scale * a22, -scale * s12, scale * a11
            centre = -_multiply(inverse, self.bearing * bodies.centre + resultants.force)
        if math.isfinite(self.housing):
            assert resultants.force_by_twist is not None
            assert resultants.torque_by_centre is not None
            assert resultants.torque_by_twist is not None
            residual = self._sum_per_drive(resultants.torque) - self._housing_per_crank_twist * bodies.twist
            slope = resultants.torque_by_twist
            if yields:
                # Eliminates the centres: their step is linear in the housing's.
                by_twist = _multiply(inverse, resultants.force_by_twist)
                slope = slope - (resultants.torque_by_centre * by_twist).sum(axis=0)
                residual = residual + self._sum_per_drive((resultants.torque_by_centre * centre).sum(axis=0))
            twist = residual / (self._housing_per_crank_twist + self._sum_per_drive(slope))
            if yields:
                centre = centre + by_twist * twist[:, self.drive_of_group]
        return BodyDisplacements(fraction * centre, fraction * twist)

    def _sum_per_drive(self, values: Array) -> Array:
        return np.add.reduceat(values, self._first, axis=1)


def _multiply(matrix: tuple[Array, Array, Array], vector: Array) -> Array:
    """Product of symmetric 2 x 2 matrices (11, 12, 22) and vectors (2, ...)."""
    m11, m12, m22 = matrix
    return np.stack([m11 * vector[0] + m12 * vector[1], m12 * vector[0] + m22 * vector[1]])
