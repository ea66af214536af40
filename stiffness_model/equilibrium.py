"""Static equilibrium of every rolling element, in closed form.

A loaded element touches gear, crank and one cage wall. With the gear's outward normal n, the crank's normal
u = d/|d| and a tangential wall, the balance of forces makes every force a fixed multiple of the gear force f1:

    crank: f1 n_r/u_r        cage: f1 w, w = n_r u_t/u_r - n_t        (sign(w) picks the wall)

All contacts share one exponent p, so with s = f1^(1/p) all indentations are linear in s, and so is the closing
condition |d| = r_RE + r_crank - d2 projected on u: one division. u depends weakly on the element's
displacement (by displacement/|d|), so passes that refresh u converge fast: the torque is right to about 1e-6
after two and to 1e-10 after three. s <= 0 is play: no force.

Two cases go to a Newton iteration instead (`newton.iterate`): a ball larger than its bore, where both walls
may touch, and further forces on the element (the "additional forces" of eq. 15).
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from .contacts import Contacts
from .errors import expect
from .newton import iterate

Array = NDArray[np.float64]

PASSES = 3
MOST_PASSES = 12
TOLERANCE = 1e-10
"""Greatest change of s in the last pass, as a share of the greatest s."""


class Status(IntEnum):
    """What became of an element."""

    PLAY = 0  # no force at gear and crank: the element has play
    LOADED = 1  # gear, crank and one cage wall carry: closed form
    ITERATED = 2  # both walls or further forces: Newton iteration, converged
    NOT_CONVERGED = 3
    EXCLUDED = 4  # on the part of the profile that is cut away: not solved, carries nothing


@dataclass(frozen=True)
class Equilibrium:
    """Result for n elements at m crank twists; all arrays (m, n).

    gear, crank, cage_plus, cage_minus: contact forces, N; output_torque: eq. 19, N.m; crank_torque: the torque
    that holds the crank, N.m, so that output_torque/(i crank_torque) -> 1 as the twist goes to 0;
    radial, tangential: displacement of the elements' centres, m (where there is play: of the position in which
    gear and wall just touch); status: of `Status`.
    """

    gear: Array
    crank: Array
    cage_plus: Array
    cage_minus: Array
    output_torque: Array
    crank_torque: Array
    radial: Array
    tangential: Array
    status: NDArray[np.int8]


def solve(contacts: Contacts, crank_twist: ArrayLike, extra_force: ArrayLike | None = None) -> Equilibrium:
    """Equilibrium of n elements at m crank twists (rad at the crank, cage and gear fixed).

    extra_force: (2,) or (2, n), N, radial (outwards) and tangential force on every element, or None.
    An element that finds no equilibrium gets `Status.NOT_CONVERGED` and no force; it never raises for all.
    """
    twist = np.atleast_1d(np.asarray(crank_twist, float))
    expect(twist.ndim == 1 and bool(np.isfinite(twist).all()), "finite twists in one dimension", crank_twist, "twist")
    result = closed_form(contacts, twist)
    special = contacts.cage_gap < 0 if extra_force is None else np.ones(len(contacts), bool)
    if special.any():
        _iterated(contacts, twist, np.flatnonzero(special), extra_force, result)
    return result


def root(x: Array, exponent: float) -> Array:
    """x^(1/exponent) for x >= 0; by the cube root for point contacts, which is faster than a power."""
    if exponent == 1.5:
        y = np.cbrt(x)
        y *= y
        return y
    return x ** (1 / exponent)


def power(x: Array, exponent: float) -> Array:
    """x^exponent for x >= 0; by the square root for point contacts."""
    return x * np.sqrt(x) if exponent == 1.5 else x**exponent


def closed_form(contacts: Contacts, crank_twist: Array) -> Equilibrium:
    """The closed form for n elements at m twists, arrays (m, n). Right for cage_gap >= 0 only.

    Written with t = u_t/u_r; 1/u_r = sqrt(1 + t^2). Statements work in place: the arrays of one call should
    fit the processor's cache, which halves the time.
    """
    c, p = contacts, contacts.exponent
    a_gear, a_crank, a_cage = (k ** (-1 / p) for k in (c.stiffness_gear, c.stiffness_crank, c.stiffness_cage))
    per_n_r = 1 / c.normal_r
    a_gear_n, a_cage_n, gap_cage_n = a_gear * per_n_r, a_cage * per_n_r, c.cage_gap * per_n_r
    a_crank_n = a_crank * root(c.normal_r, p)
    slope = c.normal_t * per_n_r

    phi = crank_twist[:, None]
    centre_r = np.cos(c.beta) * np.cos(phi) - np.sin(c.beta) * np.sin(phi)
    centre_r *= c.eccentricity
    centre_t = np.sin(c.beta) * np.cos(phi) + np.cos(c.beta) * np.sin(phi)
    centre_t *= c.eccentricity
    # From the eccentric's centre to the element's neutral position: d of eq. 9 without x.
    d_r = c.path_radius - centre_r
    d_t = -centre_t
    rest = d_r + c.gear_gap * per_n_r
    t = d_t / d_r
    # The wall is the one the neutral position leans to. A displacement towards it only adds to the lean.
    wall = np.where(c.normal_r * t >= c.normal_t, 1.0, -1.0)

    s_before = 0.0
    for done in range(1, MOST_PASSES + 1):
        w = np.multiply(c.normal_r, t)
        w -= c.normal_t
        w *= wall
        np.maximum(w, 0.0, out=w)
        w_root = root(w, p)
        h = t * t
        h += 1.0
        per_u_r = np.sqrt(h)
        h_root = root(per_u_r, p) if p != 1.5 else np.cbrt(h)
        # Closing condition: s * compliance = approach
        compliance = w_root * w
        compliance *= a_cage_n
        compliance += a_gear_n
        h_root *= per_u_r
        h_root *= a_crank_n
        compliance += h_root
        s = c.reach * per_u_r
        s -= rest
        s -= t * d_t
        s -= gap_cage_n * w
        s /= compliance
        np.maximum(s, 0.0, out=s)
        x_t = w_root
        x_t *= a_cage
        x_t *= s
        x_t += c.cage_gap
        x_t *= wall
        x_r = a_gear_n * s
        x_r += c.gear_gap * per_n_r
        x_r -= slope * x_t
        if done >= PASSES and np.abs(s - s_before).max(initial=0.0) <= TOLERANCE * s.max(initial=0.0):
            break
        s_before = s
        t = (d_t + x_t) / (d_r + x_r)
    gear = power(s, p)
    crank = gear * c.normal_r
    crank *= per_u_r
    cage = w * gear
    cage_plus = np.where(wall > 0, cage, 0.0)
    output_torque = (c.path_radius + x_r) * wall
    output_torque *= cage
    # Moment about the drive's axis of the crank force, which acts along u through the eccentric's centre:
    # f2 (E_r u_t - E_t u_r), u_t = t u_r, f2 u_r = f1 n_r.
    crank_torque = centre_r * t
    crank_torque -= centre_t
    crank_torque *= gear * c.normal_r
    status = np.where(s > 0, np.int8(Status.LOADED), np.int8(Status.PLAY))
    return Equilibrium(gear, crank, cage_plus, cage - cage_plus, output_torque, crank_torque, x_r, x_t, status)


def _iterated(contacts: Contacts, twist: Array, index: NDArray[np.intp], extra_force: ArrayLike | None,
              result: Equilibrium) -> None:
    """Overwrite the columns `index` of `result` with the Newton iteration's."""
    some = contacts[index]
    load = np.zeros((2, len(some)))
    if extra_force is not None:
        force = np.asarray(extra_force, float)
        expect(force.shape in ((2,), (2, len(contacts))) and bool(np.isfinite(force).all()),
               f"finite forces of shape (2,) or (2, {len(contacts)})", force.shape, "extra_force")
        load[:] = force[:, None] if force.ndim == 1 else force[:, index]
    # Every pair of element and twist is one problem of its own; all are iterated together.
    pairs = (len(twist), len(some))
    phi = np.repeat(twist, len(some))
    every = some[np.tile(np.arange(len(some)), len(twist))]
    start = np.stack([result.radial[:, index].ravel(), result.tangential[:, index].ravel()])
    x, forces, normal_2, converged = iterate(every, phi, np.tile(load, len(twist)), start)
    forces[:, ~converged] = 0.0
    for values, force in zip((result.gear, result.crank, result.cage_plus, result.cage_minus), forces, strict=True):
        values[:, index] = force.reshape(pairs)
    result.radial[:, index], result.tangential[:, index] = x[0].reshape(pairs), x[1].reshape(pairs)
    output_torque = (every.path_radius + x[0]) * (forces[2] - forces[3])
    result.output_torque[:, index] = output_torque.reshape(pairs)
    angle = every.beta + phi
    lever = every.eccentricity * (np.cos(angle) * normal_2[1] - np.sin(angle) * normal_2[0])
    result.crank_torque[:, index] = (forces[1] * lever).reshape(pairs)
    carries = (forces[0] > 0) | (forces[1] > 0)
    status = np.where(converged, np.where(carries, Status.ITERATED, Status.PLAY), Status.NOT_CONVERGED)
    result.status[:, index] = status.reshape(pairs)
