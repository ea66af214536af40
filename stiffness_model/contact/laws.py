"""Force over approach at the contacts where it is not Hertz's power law alone: springs in series, conforming bores.

A spring in series (the ring under an element, the wall beside a bore) takes the contact's force, so that the
approaches add: d = d_contact(f) + f/k. Local springs: each yields under its own element only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from ..elasticity.conformal import Lamina
from ..numerics.arrays import Array

if TYPE_CHECKING:
    from .element_contacts import Contacts


class ContactLaw(Protocol):
    """Force, N, stiffness, N/m, and energy, J, over the approach, m; all nought without contact."""

    def force(self, approach: Array) -> tuple[Array, Array, Array]: ...


@dataclass(frozen=True)
class PowerLaw:
    """F = K d^p, eq. 3. stiffness: (n,) N/m^p."""

    stiffness: Array
    exponent: float

    def force(self, approach: Array) -> tuple[Array, Array, Array]:
        """See `ContactLaw`."""
        d, p = np.maximum(approach, 0.0), self.exponent
        f = self.stiffness * d**p
        return f, p * self.stiffness * d ** (p - 1), f * d / (p + 1)


@dataclass(frozen=True)
class SeriesSpring:
    """A contact and a linear spring (N/m) that carries the same force."""

    contact: ContactLaw
    spring: float

    def force(self, approach: Array) -> tuple[Array, Array, Array]:
        """See `ContactLaw`. Newton's method on the contact's share of the approach.

        >>> soft = SeriesSpring(PowerLaw(np.array([1e10]), 1.5), 1e6)
        >>> f, k, _ = soft.force(np.array([1e-5]))
        >>> bool(np.isclose((f / 1e10) ** (2 / 3) + f / 1e6, 1e-5)[0])
        True
        """
        whole = np.maximum(approach, 0.0)
        own = whole
        for _ in range(60):
            f, k, _ = self.contact.force(own)
            # Convex: from above Newton's steps end at the root without passing it.
            step = (own + f / self.spring - whole) / (1 + k / self.spring)
            own = np.maximum(own - step, 0.0)
            if bool((np.abs(step) <= 1e-14 * whole).all()):
                break
        f, k, energy = self.contact.force(own)
        return f, k / (1 + k / self.spring), energy + f**2 / (2 * self.spring)


def contact_laws(contacts: Contacts) -> tuple[ContactLaw, ...] | None:
    """The laws of C1 to C4, or None where all are power laws."""
    c, options = contacts, contacts.options
    conforming = options.cage_contact == "lamina"
    if math.isinf(options.ring_stiffness) and math.isinf(options.cage_wall_stiffness) and not conforming:
        return None
    gear: ContactLaw = PowerLaw(c.stiffness_gear, c.exponent)
    if math.isfinite(options.ring_stiffness):
        gear = SeriesSpring(gear, options.ring_stiffness)
    cage: ContactLaw = bore_law(c) if conforming else PowerLaw(c.stiffness_cage, c.exponent)
    if math.isfinite(options.cage_wall_stiffness):
        cage = SeriesSpring(cage, options.cage_wall_stiffness)
    return gear, PowerLaw(c.stiffness_crank, c.exponent), cage, cage


def bore_law(contacts: Contacts) -> Lamina:
    """The conforming law of the elements' bores."""
    return Lamina(contacts.element_radius, contacts.cage_gap, contacts.cage_compliance)
