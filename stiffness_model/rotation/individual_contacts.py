"""The contacts of an individual's elements at the positions to which they have turned.

Quantities of the element alone (crank, bore) are computed once. The gear's contact stiffness, which depends on the
position and the lobe, is interpolated in a table along the profile, since one turn of the output has a million
contacts.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from ..contact.element_contacts import Contacts, build_contacts
from ..drawing.drive import Drive
from ..drawing.sampling import Deviations
from ..drawing.twist_limits import clearance_reach
from ..numerics.arrays import Array
from ..numerics.bspline import Axis, fit, locate, weights
from .element_positions import ElementPositions, Window
from .individual_drive import Individual

N_CELLS = 96
"""Cells of the table along half the profile. The stiffness is then right to 2e-5 and the torque to 3e-6; the deviation
of the ball's radius is neglected in the gear's curvature sum (a test covers both).
"""


@dataclass(frozen=True)
class GearComplianceTable:
    """K1^(-1/p) of the gear's contact, m/N^(1/p), over |beta|, rad, and the equidistant's distance q, m.

    values: (axis.cells + 1, 3) at the axis' nodes: the value at q = middle, its slope and half its curvature with
    respect to q; cubic B-splines between the nodes.
    """

    axis: Axis
    middle: float
    exponent: float
    values: Array

    @cached_property
    def _columns(self) -> Array:
        return np.ascontiguousarray(fit(self.axis, self.values, 0).T)

    def stiffness(self, beta: Array, q: Array) -> Array:
        """K1, N/m^p, at positions and distances of one shape."""
        cell, f = locate(self.axis, np.abs(beta))
        basis = weights(f, f)
        value, slope, half_curvature = (
            sum(w * column[cell + k] for k, w in enumerate(basis)) for column in self._columns
        )
        offset = q - self.middle
        return np.asarray(value + offset * (slope + offset * half_curvature)) ** -self.exponent


def gear_compliance_table(drive: Drive, reach: float) -> GearComplianceTable:
    """The table of a drawing, from the profile's crest to |beta| = reach, rad."""
    step = reach / N_CELLS
    # Two more cells at both ends, since natural end conditions are less accurate; the table is even about the crest.
    axis = Axis(-2 * step, step, N_CELLS + 4)
    tolerance = drive.tolerances["gear"]
    middle = drive.element_radius + tolerance.offset
    span = clearance_reach(drive)
    one = np.ones(axis.cells + 1)
    compliances, exponent = [], 0.0
    for q in (middle - span, middle, middle + span):
        contacts = build_contacts(
            drive,
            Deviations(
                axis.nodes, drive.element_radius * one, drive.crank_radius * one, drive.element_radius * one, q * one
            ),
        )
        exponent = contacts.exponent
        compliances.append(contacts.stiffness_gear ** (-1 / exponent))
    low, at, high = compliances
    values = np.stack([at, (high - low) / (2 * span), (high - 2 * at + low) / (2 * span**2)], axis=1)
    return GearComplianceTable(axis, middle, exponent, values)


@dataclass(frozen=True)
class IndividualContacts:
    """An individual's contact quantities that do not change as it turns."""

    individual: Individual

    @cached_property
    def window(self) -> Window:
        """The drawing's window."""
        return Window.of_drive(self.individual.drive)

    @cached_property
    def own_contacts(self) -> Contacts:
        """The contacts of every element, (n,), with crank and bore only; the gear's are placeholders."""
        one = self.individual
        zero = np.zeros(one.drive.elements)
        return build_contacts(
            one.drive, Deviations(zero, one.element, one.crank, one.cage, zero + one.drive.element_radius)
        )

    @cached_property
    def gear_table(self) -> GearComplianceTable:
        """The table of the gear's contact."""
        return gear_compliance_table(self.individual.drive, self.window.reach)

    def contacts(self, at: ElementPositions, clearance: Array | float = 0.0) -> Contacts:
        """The contacts at given positions, flattened, angle after angle; clearance: m, added to the gear's, one number
        or one for every contact."""
        one, own, number = self.individual, self.own_contacts, at.element.ravel()
        beta, q = at.beta.ravel(), one.lobe[at.row, at.lobe].ravel() + clearance
        path_radius, normal_r, normal_t = one.drive.path.radius_and_normal(beta, one.drive.orientation)
        placed = own[number]
        ball = one.drive.element == "ball"
        return replace(
            placed,
            beta=beta,
            path_radius=path_radius,
            normal_r=normal_r,
            normal_t=normal_t,
            gear_gap=q - one.element[number],
            stiffness_gear=self.gear_table.stiffness(beta, q) if ball else placed.stiffness_gear,
        )
