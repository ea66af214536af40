"""Cycloidal drives in equilibrium: discs on one crank that turn one output, and the housing in series.

The discs share the crank and the output; their torques add. Where the housing is elastic, the output's carrier turns by
gamma = torque/housing stiffness against the locked flange, and relieves the discs by this angle.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array
from .cycloidal_drive import CycloidalDrive
from .discs.disc_contacts import DiscContacts, build_disc_contacts
from .discs.disc_equilibrium import DiscEquilibrium, DiscStatus, solve_discs
from .part_deviations import PartDeviations

HOUSING_STEPS = 40
"""Newton steps for the housing's angle; chosen by judgement, some five are usual."""
HOUSING_TOLERANCE = 1e-6
"""Error of the housing's angle relative to the greatest twist; chosen by judgement, far below any measurement."""


@dataclass(frozen=True, eq=False)
class GearEquilibrium:
    """n cycloidal drives in equilibrium at T twists.

    torque: (n, T) N.m on the output; crank_torque: (n, T) N.m that holds the crank; stiffness: (n, T) N.m/rad, of the
    output while the crank is held; energy: (n, T) J, of contacts, bearings and housing. pin_force and roller_force:
    (n, T, M, N) and (n, T, M, m) N, of the contacts of M discs; pin_torque: (n, T, M, N) N.m, moments of the pins'
    forces about the discs' centres; roller_torque: (n, T, M, m) N.m on the output; bearing_force: (n, T, M) N. status:
    (n, T), of `DiscStatus`, the worst of the discs.
    """

    torque: Array
    crank_torque: Array
    stiffness: Array
    energy: Array
    pin_force: Array
    roller_force: Array
    pin_torque: Array
    roller_torque: Array
    bearing_force: Array
    status: NDArray[np.int8]


def solve_gears(
    drive: CycloidalDrive, deviations: PartDeviations, twist: Array, clearance: float = 0.0
) -> GearEquilibrium:
    """Equilibrium of n drives at twists (T,), or (n, T) in the same order for all drives, rad.

    clearance: m, added to the profile's clearance.
    """
    contacts = build_disc_contacts(drive, deviations, clearance)
    shape = (len(deviations), drive.discs, np.shape(twist)[-1])
    twist = np.repeat(np.broadcast_to(twist, (shape[0], shape[2])), drive.discs, axis=0)
    housing = drive.housing_stiffness * deviations.stiffness[:, None]
    if np.isinf(drive.housing_stiffness):
        discs, gamma, settled = solve_discs(contacts, twist), np.zeros((shape[0], shape[2])), np.True_
    else:
        discs, gamma, settled = _with_housing(housing, contacts, twist, shape)
    pins = drive.pins

    def of_discs(values: Array) -> Array:
        """(n, M, T, ...) from (n M, T, ...)."""
        return values.reshape(*shape, *values.shape[2:])

    stiffness = of_discs(discs.stiffness).sum(1)
    force, torques = (np.moveaxis(of_discs(values), 1, 2) for values in (discs.force, discs.contact_torque))
    status = discs.status.reshape(shape)
    # A disc that did not converge weighs more than one at its limit.
    worst = np.where((status == DiscStatus.NOT_CONVERGED).any(1), DiscStatus.NOT_CONVERGED, status.max(1))
    return GearEquilibrium(
        torque=of_discs(discs.torque).sum(1),
        crank_torque=of_discs(discs.crank_torque).sum(1),
        stiffness=stiffness / (1.0 + stiffness / housing),
        energy=of_discs(discs.energy).sum(1) + (0.0 if np.isinf(drive.housing_stiffness) else housing * gamma**2 / 2),
        pin_force=force[..., :pins],
        roller_force=force[..., pins:],
        pin_torque=torques[..., :pins],
        roller_torque=torques[..., pins:],
        bearing_force=np.moveaxis(of_discs(discs.bearing_force), 1, 2),
        status=np.where(settled, worst, DiscStatus.NOT_CONVERGED).astype(np.int8),
    )


def _with_housing(
    k: Array, contacts: DiscContacts, twist: Array, shape: tuple[int, int, int]
) -> tuple[DiscEquilibrium, Array, NDArray[np.bool_]]:
    """The discs on housings of stiffness k, (n, 1) N.m/rad; the carrier's angle gamma, (n, T) rad; whether the torque
    balances it, (n, T).

    Newton's method on gamma - torque(gamma)/k, which rises with gamma; a bracket catches steps that go too far.
    """
    n, discs, _ = shape
    gamma, settled = np.zeros((n, shape[2])), np.zeros((n, shape[2]), bool)
    low, high = np.full(gamma.shape, -np.inf), np.full(gamma.shape, np.inf)
    scale = HOUSING_TOLERANCE * max(float(np.abs(twist).max()), 1e-6)
    found = solve_discs(contacts, twist)
    drives, part = np.arange(n), found
    for _ in range(HOUSING_STEPS):
        inner = (len(drives), discs, shape[2])
        torque, stiffness = part.torque.reshape(inner).sum(1), part.stiffness.reshape(inner).sum(1)
        excess = gamma[drives] - torque / k[drives]
        settled[drives] = np.abs(excess) <= scale
        unsettled = ~settled[drives].all(1)
        if not unsettled.any():
            break
        drives, excess, stiffness = drives[unsettled], excess[unsettled], stiffness[unsettled]
        at = gamma[drives]
        low[drives], high[drives] = np.where(excess < 0, at, low[drives]), np.where(excess > 0, at, high[drives])
        below, above = low[drives], high[drives]
        newton = at - excess / (1.0 + np.maximum(stiffness, 0.0) / k[drives])
        bounded = np.isfinite(below) & np.isfinite(above)
        middle = np.where(bounded, np.where(bounded, below, 0.0) / 2 + np.where(bounded, above, 0.0) / 2, newton)
        new = np.where((newton > below) & (newton < above), newton, middle)
        gamma[drives] = np.where(settled[drives], at, new)
        rows = (drives[:, None] * discs + np.arange(discs)).ravel()
        output = -np.repeat(gamma[drives], discs, axis=0)
        part = solve_discs(contacts[rows], twist[rows], output, found.pose[rows, :, :3])
        found = found.replaced(rows, part)
    return found, gamma, settled
