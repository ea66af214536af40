"""Discs in equilibrium: torque and its derivative, crank torque, forces and a status for each state."""

from __future__ import annotations

import enum
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...numerics.arrays import Array
from .disc_contacts import DiscContacts
from .disc_energy import PAIRS, DiscEnergy, DiscStates
from .disc_minimum import Minimum, least_energy

TURNING_LIMIT = 0.5
"""Greatest tangent of the angle by which the normal of a contact under load may turn. Beyond it, some 27 deg, the
osculating circle does not describe the flank; chosen by judgement."""
MAX_PAIRS = 2**16
"""Contacts at twists that are iterated together, so that the arrays stay in the processor's cache."""


class DiscStatus(enum.IntEnum):
    """How the search for the equilibrium of a disc at a twist ended."""

    CONVERGED = 0
    NOT_CONVERGED = 1
    LIMIT = 2
    """In equilibrium, but beyond the validity of the contact geometry (`TURNING_LIMIT`)."""


@dataclass(frozen=True, eq=False)
class DiscEquilibrium:
    """Discs in equilibrium: D rows at T twists.

    pose: (D, T, 4) m; torque: (D, T) N.m on the output; stiffness: (D, T) N.m/rad, derivative of the torque by the
    twist; crank_torque: (D, T) N.m that holds the crank; energy: (D, T) J; force: (D, T, C) N, of the contacts;
    contact_torque:
    (D, T, C) N.m, moments of the pins' forces on the disc about its centre and of the rollers' forces on the output;
    bearing_force: (D, T) N; status: (D, T), of `DiscStatus`; steps: Newton steps of the slowest state.
    """

    pose: Array
    torque: Array
    stiffness: Array
    crank_torque: Array
    energy: Array
    force: Array
    contact_torque: Array
    bearing_force: Array
    status: NDArray[np.int8]
    steps: int

    def replaced(self, rows: NDArray[np.intp], others: DiscEquilibrium) -> DiscEquilibrium:
        """These results, in place, with those of some rows, (k,) indices, from others."""
        for name in _ARRAYS:
            getattr(self, name)[rows] = getattr(others, name)
        return self


_ARRAYS = (
    "pose",
    "torque",
    "stiffness",
    "crank_torque",
    "energy",
    "force",
    "contact_torque",
    "bearing_force",
    "status",
)


def solve_discs(
    contacts: DiscContacts, twist: Array, output: Array | None = None, start: Array | None = None
) -> DiscEquilibrium:
    """Equilibrium of D rows at twists (T,), or (D, T) in the same order in all rows, rad: the crank's lead.

    output: (D, T) rad, further twist by a rotation of the output in the opposite sense; start: (D, T, 3) m, poses to
    start from.
    """
    twists = np.broadcast_to(twist, (len(contacts), np.shape(twist)[-1]))
    further = np.zeros(twists.shape) if output is None else output
    chunk = max(1, MAX_PAIRS // (twists.shape[1] * contacts.gap.shape[-1]))
    parts: list[DiscEquilibrium] = []
    for first in range(0, len(contacts), chunk):
        rows = slice(first, first + chunk)
        minimum = least_energy(contacts[rows], twists[rows], further[rows], None if start is None else start[rows])
        parts.append(_results(contacts[rows], twists[rows], minimum))
    joined = [np.concatenate([getattr(p, name) for p in parts]) for name in _ARRAYS]
    return DiscEquilibrium(*joined, steps=max(p.steps for p in parts))


def _results(contacts: DiscContacts, twist: Array, minimum: Minimum) -> DiscEquilibrium:
    """Torques, forces and status of poses in equilibrium."""
    state, touching = minimum.state, DiscEnergy(contacts).contacts_at(minimum.pose)
    centre = contacts.centre(twist)
    bearing = _bearing_force(contacts, minimum.pose[..., :2] - centre, state)
    # The eccentric's centre from the drive's axis.
    lever = centre + np.array([contacts.eccentricity, 0.0])
    is_valid = (touching.turning <= TURNING_LIMIT).all(-1)
    status = np.where(is_valid, DiscStatus.CONVERGED, DiscStatus.LIMIT)
    status = np.where(minimum.converged, status, DiscStatus.NOT_CONVERGED).astype(np.int8)
    return DiscEquilibrium(
        pose=minimum.pose,
        torque=state.gradient[..., 3] * contacts.radius,
        stiffness=_stiffness(state, contacts.is_rigid) * contacts.radius**2,
        crank_torque=lever[..., 0] * bearing[..., 1] - lever[..., 1] * bearing[..., 0],
        energy=state.energy,
        force=touching.force,
        contact_torque=touching.moment,
        bearing_force=np.hypot(bearing[..., 0], bearing[..., 1]),
        status=status,
        steps=minimum.steps,
    )


def _bearing_force(contacts: DiscContacts, offset: Array, state: DiscStates) -> Array:
    """Force of the bearing on each disc, (D, T, 2) N, whose centre is displaced from the eccentric's by `offset`, m.

    A rigid bearing balances the contacts: their force on the disc is minus the gradient.
    """
    if contacts.is_rigid:
        return state.gradient[..., :2]
    radius = np.hypot(offset[..., 0], offset[..., 1])[..., None]
    pressed = np.maximum(radius - contacts.bearing_clearance, 0.0)
    return -contacts.bearing_stiffness[..., None] * pressed / np.maximum(radius, 1e-300) * offset


def _stiffness(state: DiscStates, rigid: bool) -> Array:
    """Second derivative of the least energy by the output's coordinate, (D, T) N/m: the Schur complement."""
    h = state.hessian
    (xx, xy, xs, xo), (yy, ys, yo), (ss, so), oo = (
        [h[..., k] for k in group] for group in ((0, 1, 2, 3), (4, 5, 6), (7, 8), (9,))
    )
    if rigid:
        return oo[0] - so * so / np.where(ss > 0, ss, np.inf)
    a, b, c = yy * ss - ys * ys, xs * ys - xy * ss, xy * ys - yy * xs
    d, e, f = xx * ss - xs * xs, xy * xs - xx * ys, xx * yy - xy * xy
    determinant, trace = xx * a + xy * b + xs * c, xx + yy + ss
    regular = determinant > 1e-9 * trace**3
    given = a * xo * xo + d * yo * yo + f * so * so + 2 * (b * xo * yo + c * xo * so + e * yo * so)
    result = oo[0] - given / np.where(regular, determinant, np.inf)
    # Discs that may move freely in some direction; without any contact the stiffness is zero.
    loose = ~regular & (trace > 0)
    if loose.any():
        matrix = np.empty((int(loose.sum()), 4, 4))
        for k, (i, j) in enumerate(PAIRS):
            matrix[:, i, j] = matrix[:, j, i] = h[loose, k]
        ridge = 1e-11 * trace[loose][:, None, None] * np.eye(3)
        column = matrix[:, :3, 3]
        solved = np.linalg.solve(matrix[:, :3, :3] + ridge, column[..., None])[..., 0]
        result[loose] = matrix[:, 3, 3] - (column * solved).sum(-1)
    return result
