"""The contacts of an individual's elements at the places to which they have turned.

What belongs to the element alone (crank, bore) is computed once; the gear's stiffness, which changes with the
place and the lobe, comes from a table along the profile. A turn of the output has a million contacts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..contact.element_contacts import Contacts, build_contacts
from ..drawing.drive import Drive
from ..drawing.sampling import Deviations
from ..numerics.arrays import Array
from ..numerics.bspline import Axis, fit, locate, weights
from .element_positions import ElementPositions, Window
from .individual import Individual

N_CELLS = 96
"""Cells of the table along half the profile. The stiffness is right to 2e-5, the torque to 3e-6: the deviation of the
ball's own radius is left out of the gear's curvature sum (a test holds both)."""


@dataclass(frozen=True)
class GearComplianceTable:
    """K1^(-1/p) of the gear's contact, m/N^(1/p), over |beta|, rad, and the equidistant's distance q, m.

    values: (axis.cells + 1, 3) at the axis' nodes: value at q = middle, slope and half the curvature along q. Between
    them go cubic B-splines.
    """

    axis: Axis
    middle: float
    exponent: float
    values: Array

    @cached_property
    def _columns(self) -> Array:
        return np.ascontiguousarray(fit(self.axis, self.values, 0).T)

    def stiffness(self, beta: Array, q: Array) -> Array:
        """K1, N/m^p, at places and distances of one shape."""
        cell, f = locate(self.axis, np.abs(beta))
        basis = weights(f, f)
        value, slope, bend = (sum(w * column[cell + k] for k, w in enumerate(basis)) for column in self._columns)
        off = q - self.middle
        return np.asarray(value + off * (slope + off * bend)) ** -self.exponent


def gear_compliance_table(drive: Drive, reach: float) -> GearComplianceTable:
    """The table of a drawing, from the profile's crest to |beta| = reach, rad."""
    step = reach / N_CELLS
    # Two cells beyond both ends, for natural ends are poorer; all is even about the crest.
    axis = Axis(-2 * step, step, N_CELLS + 4)
    tolerance = drive.tolerances["gear"]
    middle = drive.element_radius + tolerance.offset
    span = max(4 * tolerance.sigma, 0.5 * drive.eccentricity * abs(drive.ratio) * drive.max_twist)
    one = np.ones(axis.cells + 1)
    gives, exponent = [], 0.0
    for q in (middle - span, middle, middle + span):
        contacts = build_contacts(
            drive,
            Deviations(
                axis.nodes, drive.element_radius * one, drive.crank_radius * one, drive.element_radius * one, q * one
            ),
        )
        exponent = contacts.exponent
        gives.append(contacts.stiffness_gear ** (-1 / exponent))
    low, at, high = gives
    values = np.stack([at, (high - low) / (2 * span), (high - 2 * at + low) / (2 * span**2)], axis=1)
    return GearComplianceTable(axis, middle, exponent, values)


@dataclass(frozen=True)
class IndividualContacts:
    """An individual's parts with all that does not change as they turn."""

    individual: Individual

    @cached_property
    def window(self) -> Window:
        """The drawing's window."""
        return Window.of_drive(self.individual.drive)

    @cached_property
    def own_contacts(self) -> Contacts:
        """The contacts of every element, (n,), as far as they are its own: crank and bore."""
        one = self.individual
        zero = np.zeros(one.drive.elements)
        return build_contacts(
            one.drive, Deviations(zero, one.element, one.crank, one.cage, zero + one.drive.element_radius)
        )

    @cached_property
    def gear_table(self) -> GearComplianceTable:
        """The gear's table."""
        return gear_compliance_table(self.individual.drive, self.window.reach)

    def contacts(self, at: ElementPositions, clearance: float = 0.0) -> Contacts:
        """The contacts at some places, flattened, angle after angle; clearance: m, added to the gear's clearance."""
        one, own, number = self.individual, self.own_contacts, at.element.ravel()
        beta, q = at.beta.ravel(), one.lobe[at.row, at.lobe].ravel() + clearance
        path = one.drive.path
        normal_r, normal_t = path.normal(beta, one.drive.orientation)
        placed = own[number]
        ball = one.drive.element == "ball"
        return replace(
            placed,
            beta=beta,
            path_radius=path.radius(beta),
            normal_r=normal_r,
            normal_t=normal_t,
            gear_gap=q - one.element[number],
            stiffness_gear=self.gear_table.stiffness(beta, q) if ball else placed.stiffness_gear,
        )
