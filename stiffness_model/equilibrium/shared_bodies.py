"""The bodies that elements share: eccentrics in their bearings, drives in their housings, and their Newton step."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..contact.element_contacts import Contacts
from ..numerics.arrays import Array


@dataclass(frozen=True)
class Centres:
    """Where the bodies are at m twists. shift: (2, m, n_groups) m, of each eccentric's centre in the crank's frame
    (along the eccentricity at no twist, and across); twist: (m, n_drives) rad, crank twist lost in the housing.
    """

    shift: Array
    twist: Array

    @property
    def moved(self) -> bool:
        """Whether anything is off its place."""
        return bool(self.shift.any() or self.twist.any())

    @property
    def rows(self) -> int:
        """m."""
        return len(self.twist)

    def plus(self, step: Centres) -> Centres:
        """Moved by a step."""
        return Centres(self.shift + step.shift, self.twist + step.twist)

    def size(self, eccentricity: float) -> Array:
        """Greatest displacement, m, in each drive, (m, n_drives); the housing's at the eccentric's centre."""
        per_drive = self.shift.shape[2] // max(1, self.twist.shape[1])
        greatest = np.abs(self.shift).max(axis=0)
        if per_drive * self.twist.shape[1] == greatest.shape[1]:
            greatest = greatest.reshape(self.rows, self.twist.shape[1], per_drive).max(axis=2)
        else:
            greatest = np.broadcast_to(greatest.max(axis=1, keepdims=True, initial=0.0), self.twist.shape)
        return np.maximum(greatest, np.abs(self.twist) * eccentricity)

    def distance(self, other: Centres, eccentricity: float) -> float:
        """Greatest displacement from other centres, m."""
        return float(Centres(self.shift - other.shift, self.twist - other.twist).size(eccentricity).max(initial=0.0))

    def last(self) -> Centres:
        """The last twist's."""
        return self.of_rows(slice(-1, None))

    def of_rows(self, part: slice) -> Centres:
        """Some twists'."""
        return Centres(self.shift[:, part], self.twist[part])

    def repeated(self, growth: Array) -> Centres:
        """One twist's, times m factors."""
        return Centres(self.shift * growth[:, None], self.twist * growth[:, None])


@dataclass(frozen=True)
class Seat:
    """Where some elements sit: their eccentric (index into the groups), and the turn of their frame in the crank's."""

    group: NDArray[np.intp]
    drive: NDArray[np.intp]
    cos: Array
    sin: Array
    starts: NDArray[np.intp]
    present: NDArray[np.intp]
    n_groups: int

    def reordered(self, index: NDArray[np.intp]) -> Seat:
        """The same seats in another order, in which sums cannot be taken."""
        none = np.zeros(0, np.intp)
        return Seat(self.group[index], self.drive[index], self.cos[index], self.sin[index], none, none, self.n_groups)

    def add(self, values: Array) -> Array:
        """Sum over the elements of every eccentric, (m, n) -> (m, n_groups)."""
        if len(self.present) == self.n_groups:
            return np.add.reduceat(values, self.starts, axis=1)
        total = np.zeros((len(values), self.n_groups))
        if len(self.present):
            total[:, self.present] = np.add.reduceat(values, self.starts, axis=1)
        return total


@dataclass(frozen=True)
class Sums:
    """Sums over the elements of every eccentric, (m, n_groups): what they do to the bodies and how it changes.

    force: (2, ...) N on the eccentric's elements, in the crank's frame; stiffness: (3, ...) N/m, 11, 12, 22; torque:
    N.m on the output. With a housing: by_twist (2, ...), stiffness times the centre's path with the crank, N/rad;
    torque_by_shift (2, ...) N; torque_by_twist, N.m/rad.
    """

    force: Array
    stiffness: Array
    torque: Array
    by_twist: Array | None = None
    torque_by_shift: Array | None = None
    torque_by_twist: Array | None = None

    def plus(self, other: Sums) -> Sums:
        """Both together."""
        return Sums(
            self.force + other.force,
            self.stiffness + other.stiffness,
            self.torque + other.torque,
            _both(self.by_twist, other.by_twist),
            _both(self.torque_by_shift, other.torque_by_shift),
            _both(self.torque_by_twist, other.torque_by_twist),
        )


def _both(a: Array | None, b: Array | None) -> Array | None:
    return None if a is None or b is None else a + b


class Frame:
    """Eccentrics and drives of contacts that are sorted by their eccentric."""

    def __init__(self, contacts: Contacts) -> None:
        options = contacts.beyond
        self.bearing, self.housing = options.bearing_stiffness, options.housing_stiffness
        self.couples = options.couples_elements
        self.numbers, self.group = np.unique(contacts.eccentric, return_inverse=True)
        self.drives, self.drive_of_group = np.unique(self.numbers // contacts.eccentrics, return_inverse=True)
        self.n_groups, self.n_drives = len(self.numbers), len(self.drives)
        self._first = np.flatnonzero(np.diff(self.drive_of_group, prepend=-1))
        # Crank twist lost in the housing: i T/k_h.
        self._per_torque = self.housing / contacts.ratio
        self._cos, self._sin = np.cos(contacts.beta), np.sin(contacts.beta)

    def rest(self, rows: int) -> Centres:
        """Where nothing has yielded."""
        return Centres(np.zeros((2, rows, self.n_groups)), np.zeros((rows, self.n_drives)))

    def of(self, index: NDArray[np.intp]) -> Seat:
        """The seats of some elements, in rising order."""
        group = self.group[index]
        starts = np.flatnonzero(np.diff(group, prepend=-1))
        return Seat(
            group, self.drive_of_group[group], self._cos[index], self._sin[index], starts, group[starts], self.n_groups
        )

    def close(self, centres: Centres, before: Centres, eccentricity: float, within: float) -> NDArray[np.bool_]:
        """Which drives have moved less than `within` m."""
        moved = Centres(centres.shift - before.shift, centres.twist - before.twist)
        return moved.size(eccentricity) <= within

    def step(self, sums: Sums, centres: Centres, share: float) -> Centres:
        """Newton's step of the centres towards equilibrium."""
        shift, twist = np.zeros_like(centres.shift), np.zeros_like(centres.twist)
        soft = math.isfinite(self.bearing)
        none = np.zeros(1)
        inverse, along = (none, none, none), none
        if soft:
            s11, s12, s22 = sums.stiffness
            a11, a22 = s11 + self.bearing, s22 + self.bearing
            scale = 1 / (a11 * a22 - s12 * s12)
            inverse = scale * a22, -scale * s12, scale * a11
            shift = -_apply(inverse, self.bearing * centres.shift + sums.force)
        if math.isfinite(self.housing):
            assert sums.by_twist is not None
            assert sums.torque_by_shift is not None
            assert sums.torque_by_twist is not None
            missing = self._drives(sums.torque) - self._per_torque * centres.twist
            slope = sums.torque_by_twist
            if soft:
                along = _apply(inverse, sums.by_twist)
                slope = slope - (sums.torque_by_shift * along).sum(axis=0)
                missing = missing + self._drives((sums.torque_by_shift * shift).sum(axis=0))
            twist = missing / (self._per_torque + self._drives(slope))
            if soft:
                shift = shift + along * twist[:, self.drive_of_group]
        return Centres(share * shift, share * twist)

    def _drives(self, values: Array) -> Array:
        return np.add.reduceat(values, self._first, axis=1)


def _apply(matrix: tuple[Array, Array, Array], vector: Array) -> Array:
    m11, m12, m22 = matrix
    return np.stack([m11 * vector[0] + m12 * vector[1], m12 * vector[0] + m22 * vector[1]])
