"""Contact laws: force, stiffness and stored energy over the approach, beyond Hertz's power law as well.

A spring in series (the ring under an element, the wall beside a bore) carries the contact's force, so that the
approaches add: d = d_contact(f) + f/k. The springs are local: each yields under its own element only.
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

MAX_STEPS = 60
"""Newton steps of `SeriesSpring`; chosen by judgement, fewer than ten are usual."""


class ContactLaw(Protocol):
    """A law for n contacts."""

    def force(self, approach: Array) -> tuple[Array, Array, Array]:
        """Force, N, stiffness, N/m, and stored energy, J, at approaches (..., n), m; zero without contact."""
        ...


@dataclass(frozen=True, eq=False)
class PowerLaw:
    """F = K d^p, eq. 3. stiffness: K, (n,) N/m^p."""

    stiffness: Array
    exponent: float

    def force(self, approach: Array) -> tuple[Array, Array, Array]:
        """See `ContactLaw`."""
        d, p = np.maximum(approach, 0.0), self.exponent
        f = self.stiffness * d**p
        return f, p * self.stiffness * d ** (p - 1), f * d / (p + 1)


@dataclass(frozen=True, eq=False)
class SeriesSpring:
    """A contact in series with a linear spring, N/m."""

    contact: ContactLaw
    spring: float

    def force(self, approach: Array) -> tuple[Array, Array, Array]:
        """See `ContactLaw`. Newton's method on the contact's part of the approach.

        >>> soft = SeriesSpring(PowerLaw(np.array([1e10]), 1.5), 1e6)
        >>> f, k, _ = soft.force(np.array([1e-5]))
        >>> bool(np.isclose((f / 1e10) ** (2 / 3) + f / 1e6, 1e-5)[0])
        True
        """
        total = np.maximum(approach, 0.0)
        at_contact = total
        for _ in range(MAX_STEPS):
            f, k, _ = self.contact.force(at_contact)
            # The function is convex: from above, Newton's method converges to the root monotonically.
            step = (at_contact + f / self.spring - total) / (1 + k / self.spring)
            at_contact = np.maximum(at_contact - step, 0.0)
            if bool((np.abs(step) <= 1e-14 * total).all()):
                break
        f, k, energy = self.contact.force(at_contact)
        return f, k / (1 + k / self.spring), energy + f**2 / (2 * self.spring)


def contact_laws(contacts: Contacts) -> tuple[ContactLaw, ...] | None:
    """The laws of C1 to C4, or None if all are power laws."""
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
