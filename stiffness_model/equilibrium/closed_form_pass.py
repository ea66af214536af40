"""One pass of the closed form: the equations of a loaded element, for n elements at m crank twists.

A loaded element touches gear, crank and one cage wall. With the gear's outward normal n, the crank's normal
u = d/|d| and a tangential wall, the balance of forces makes every contact force a fixed multiple of the radial F:

    gear: F/n_r        crank: F/u_r        cage: F w, w = u_t/u_r - n_t/n_r        (sign(w) selects the wall)

All contacts share one exponent p, so that with s = (F/K2)^(1/p), K2 the crank's stiffness, all indentations are
linear in s, and so is the closing condition |d| = r_RE + r_crank - d2 projected on u:

    s (1/u_r (1/u_r)^(1/p) + gear_yield + w w^(1/p) wall_yield) = (r_RE + r_crank)/u_r - d_r - u_t/u_r d_t

with d from the eccentric's centre to the element where it just touches gear and wall. Tangential lengths count
positive towards that wall. The functions work in place, because allocating arrays of this size costs more than the
arithmetic: the C library returns them to the system after every call.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..contact.element_contacts import Contacts
from ..numerics.arrays import Array
from .solution import Equilibrium, inverse_power


@dataclass
class PassArrays:
    """Working arrays of a pass, (m, n). Callers may let results take the place of arrays that they no longer need.

    t, t_next: u_t/u_r of this pass and of the next; d_r, d_t: from the eccentric's centre to the element where it just
    touches gear and wall, m; wall: +1 for C3, -1 for C4; slope: n_t/n_r; touch: radial displacement at which the
    element just touches gear and wall, m; w: cage force over F; inverse_u_r: 1/u_r; x_r, x_t: displacement beyond
    touching, m; work: free.
    """

    t: Array
    t_next: Array
    d_r: Array
    d_t: Array
    wall: Array
    slope: Array
    touch: Array
    w: Array
    inverse_u_r: Array
    x_r: Array
    x_t: Array
    work: Array

    @staticmethod
    def empty(shape: tuple[int, ...]) -> PassArrays:
        """Arrays of one shape, not initialised."""
        block = np.empty((12, *shape))
        return PassArrays(*(block[k] for k in range(12)))


@dataclass(frozen=True)
class GearContact:
    """The gear's contact, arrays that broadcast to (m, n).

    inverse_n_r: 1/n_r; slope: n_t/n_r; gap: m, along the radius; yielding: radial indentation per s.
    """

    inverse_n_r: Array
    slope: Array
    gap: Array
    yielding: Array

    @staticmethod
    def of(contacts: Contacts, normal_r: Array, normal_t: Array, gap: Array, stiffness: Array) -> GearContact:
        """From the outward normal, the gap along it, m, and K of the contact, N/m^p."""
        inverse_n_r = 1 / normal_r
        yielding = inverse_power(contacts.stiffness_crank / (stiffness * normal_r), contacts.exponent) * inverse_n_r
        return GearContact(inverse_n_r, normal_t * inverse_n_r, gap * inverse_n_r, yielding)


@dataclass(frozen=True)
class WallContact:
    """The cage wall's contact, (n,). gap: m, 0 for a ball larger than its bore; yielding: indentation per s w^(1/p)."""

    gap: Array
    yielding: Array

    @staticmethod
    def of(contacts: Contacts) -> WallContact:
        """From the contacts' gap and stiffness."""
        yielding = inverse_power(contacts.stiffness_crank / contacts.stiffness_cage, contacts.exponent)
        return WallContact(np.maximum(contacts.cage_gap, 0.0), yielding)


def eccentric_centre(contacts: Contacts, twist: Array, out_r: Array, out_t: Array, work: Array) -> None:
    """The eccentric's centre in the frame of every element, m, at crank twists (m,) rad.

    By the addition theorem: a sine and a cosine of every pair would double the time of the closed form.
    """
    e_cos, e_sin = contacts.eccentricity * np.cos(contacts.beta), contacts.eccentricity * np.sin(contacts.beta)
    cos, sin = np.cos(twist)[:, None], np.sin(twist)[:, None]
    np.multiply(cos, e_cos, out=out_r)
    out_r -= np.multiply(sin, e_sin, out=work)
    np.multiply(sin, e_cos, out=out_t)
    out_t += np.multiply(cos, e_sin, out=work)


def select_wall(a: PassArrays, gear: GearContact, centre_t: Array) -> None:
    """Select the wall towards which crank and gear push the element in its neutral position, a.d_r off the centre.

    A displacement towards that wall only adds to the inclination of the crank's normal.
    """
    np.divide(centre_t, a.d_r, out=a.work)
    a.work += gear.slope
    np.copysign(1.0, np.negative(a.work, out=a.work), out=a.wall)


def touch_gear_and_wall(a: PassArrays, gear: GearContact, wall: WallContact, centre_t: Array) -> None:
    """Displace the element from its neutral position to where it just touches gear and wall."""
    np.multiply(a.wall, gear.slope, out=a.slope)
    np.subtract(gear.gap, np.multiply(a.slope, wall.gap, out=a.work), out=a.touch)
    a.d_r += a.touch
    np.subtract(wall.gap, np.multiply(a.wall, centre_t, out=a.work), out=a.d_t)


def closing_condition(a: PassArrays, gear: GearContact, wall: WallContact, contacts: Contacts, approach: Array) -> None:
    """Set up the closing condition with the crank's normal a.t, except for the wall's share of its left side.

    Fills `approach`, its right side, m; a.w; a.inverse_u_r; a.x_t with the wall's indentation per s; a.x_r with the
    indentation of gear and crank per s.
    """
    p = contacts.exponent
    np.subtract(a.t, a.slope, out=a.w)
    np.maximum(a.w, 0.0, out=a.w)
    inverse_power(a.w, p, out=a.x_t)
    a.x_t *= wall.yielding
    np.multiply(a.t, a.t, out=a.inverse_u_r)
    a.inverse_u_r += 1.0
    np.sqrt(a.inverse_u_r, out=a.inverse_u_r)
    inverse_power(a.inverse_u_r, p, out=a.x_r)
    a.x_r *= a.inverse_u_r
    a.x_r += gear.yielding
    np.multiply(a.inverse_u_r, contacts.radius_sum, out=approach)
    approach -= a.d_r
    approach -= np.multiply(a.t, a.d_t, out=a.work)


def next_normal(a: PassArrays) -> Array:
    """Set a.t_next to the crank's normal of the displaced element; returns its rotation, rad, in a.work."""
    np.add(a.d_t, a.x_t, out=a.t_next)
    a.t_next /= np.add(a.d_r, a.x_r, out=a.work)
    return np.abs(np.subtract(a.t_next, a.t, out=a.work), out=a.work)


def write_solution(
    a: PassArrays,
    force: Array,
    gear: GearContact,
    wall: WallContact,
    contacts: Contacts,
    crank_pin: tuple[Array, Array],
    out: Equilibrium,
) -> None:
    """Forces, torques and displacements from the radial force, N, and the last pass, into `out` (all but the status).

    crank_pin: where the crank's torque acts, radial and tangential, m. Arrays of `out` may share memory: radial and
    tangential with a.x_r and a.x_t, gear with force, crank with a.inverse_u_r, cage_plus with a.w, cage_minus with
    a.touch, crank_torque and output_torque with the radial and tangential part of crank_pin.
    """
    # Moment about the drive's axis of the crank's force, which acts along u through the pin: F (E_r u_t/u_r - E_t).
    np.multiply(crank_pin[0], a.t, out=out.crank_torque)
    out.crank_torque[:] *= a.wall
    out.crank_torque[:] -= crank_pin[1]
    out.crank_torque[:] *= force
    np.multiply(a.inverse_u_r, force, out=out.crank)
    np.add(a.x_r, a.touch, out=out.radial)
    np.add(a.x_t, wall.gap, out=out.tangential)
    out.tangential[:] *= a.wall
    cage = np.multiply(a.w, force, out=a.work)
    cage *= a.wall
    np.multiply(force, gear.inverse_n_r, out=out.gear)
    np.add(contacts.path_radius, out.radial, out=out.output_torque)
    out.output_torque[:] *= cage
    np.maximum(np.negative(cage, out=out.cage_minus), 0.0, out=out.cage_minus)
    np.maximum(cage, 0.0, out=out.cage_plus)
