"""Static equilibrium of every rolling element, in closed form.

A loaded element touches gear, crank and one cage wall. With the gear's outward normal n, the crank's normal
u = d/|d| and a tangential wall, the balance of forces makes every force a fixed multiple of the radial F:

    gear: F/n_r        crank: F/u_r        cage: F w, w = u_t/u_r - n_t/n_r        (sign(w) picks the wall)

All contacts share one exponent p, so with s = (F/K2)^(1/p) all indentations are linear in s, and so is the
closing condition |d| = r_RE + r_crank - d2 projected on u: one division. u depends weakly on the element's
displacement (by displacement/|d|), so passes that refresh u converge fast. The first takes u where the
element just touches gear and wall; the torque is right to about 1e-6 after two and to 1e-10 after three.
s <= 0 is play: no force.

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
TOLERANCE = 1e-11
"""Greatest turn of the crank's normal, rad, that one more pass would bring: of that order are the errors of
the forces, as shares of the crank's."""


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

    gear, crank, cage_plus, cage_minus: contact forces, N; output_torque: eq. 19, N.m; crank_torque: the
    torque that holds the crank, N.m, so that output_torque/(i crank_torque) -> 1 as the twist goes to 0;
    radial, tangential: displacement of the elements' centres, m (where there is play: of the position in
    which gear and wall just touch); status: of `Status`.
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
    expect(twist.ndim == 1 and bool(np.isfinite(twist).all()), "finite twists in one dimension", crank_twist,
           "twist")
    result = closed_form(contacts, twist)
    special = np.ones(len(contacts), bool)
    if extra_force is None:
        special = (contacts.cage_gap < 0) | (result.status == Status.NOT_CONVERGED).any(axis=0)
    if special.any():
        _iterated(contacts, twist, np.flatnonzero(special), extra_force, result)
    return result


def root(x: Array, exponent: float, out: Array | None = None) -> Array:
    """x^(1/exponent) for x >= 0; by the cube root for point contacts, which is faster than a power."""
    if exponent == 1.5:
        y = np.cbrt(x, out=out)
        y *= y
        return y
    return np.power(x, 1 / exponent, out=out)


def power(x: Array, exponent: float) -> Array:
    """x^exponent for x >= 0; by the square root for point contacts."""
    return x * np.sqrt(x) if exponent == 1.5 else x**exponent


def closed_form(contacts: Contacts, crank_twist: Array) -> Equilibrium:
    """The closed form for n elements at m twists, arrays (m, n).

    An element with cage_gap < 0 gets the result of one that just fits its bore: a start for the iteration.
    One whose passes do not settle is marked `Status.NOT_CONVERGED`, for the same.
    """
    c, p = contacts, contacts.exponent
    # What the twist leaves alone, (n,).
    cage_gap = np.maximum(c.cage_gap, 0.0)
    slope, per_n_r = c.normal_t / c.normal_r, 1 / c.normal_r
    gear_give = root(c.stiffness_crank / (c.stiffness_gear * c.normal_r), p) * per_n_r
    cage_give = root(c.stiffness_crank / c.stiffness_cage, p)

    # The eccentric's centre by the addition theorem: a sine and a cosine of every pair would double the time.
    e_cos, e_sin = c.eccentricity * np.cos(c.beta), c.eccentricity * np.sin(c.beta)
    cos, sin = np.cos(crank_twist)[:, None], np.sin(crank_twist)[:, None]
    centre_r = cos * e_cos - sin * e_sin
    centre_t = sin * e_cos + cos * e_sin
    d_r = c.path_radius - centre_r
    # The wall is the one the neutral position leans to: a displacement towards it only adds to the lean.
    # From here on tangential lengths count positive towards that wall.
    wall = np.copysign(1.0, -centre_t / d_r - slope)
    slope = wall * slope
    # Where the element just touches gear and wall: its displacement, and d there.
    touch = c.gear_gap * per_n_r - slope * cage_gap
    d_r += touch
    d_t = cage_gap - wall * centre_t

    # In place, so that the arrays of one call fit the processor's cache; x_t and x_r first hold other things.
    t = d_t / d_r
    t_next, w, per_u_r, s, x_r, x_t, spare = (np.empty_like(t) for _ in range(7))
    turn = spare
    for done in range(1, MOST_PASSES + 1):
        np.subtract(t, slope, out=w)
        np.maximum(w, 0.0, out=w)
        give = root(w, p, out=x_t)
        give *= cage_give
        np.multiply(t, t, out=per_u_r)
        per_u_r += 1.0
        np.sqrt(per_u_r, out=per_u_r)
        compliance = root(per_u_r, p, out=x_r)
        compliance *= per_u_r
        compliance += gear_give
        compliance += np.multiply(w, give, out=spare)
        # Closing condition: s * compliance = approach.
        np.multiply(per_u_r, c.reach, out=s)
        s -= d_r
        s -= np.multiply(t, d_t, out=spare)
        s /= compliance
        np.maximum(s, 0.0, out=s)
        # Displacement beyond touching, and the direction of d there.
        np.subtract(gear_give, np.multiply(slope, give, out=spare), out=x_r)
        x_r *= s
        x_t *= s
        np.add(d_t, x_t, out=t_next)
        t_next /= np.add(d_r, x_r, out=spare)
        np.abs(np.subtract(t_next, t, out=turn), out=turn)
        if done >= PASSES and turn.max(initial=0.0) <= TOLERANCE:
            break
        t, t_next = t_next, t

    force = power(s, p)
    force *= c.stiffness_crank
    x_r += touch
    x_t += cage_gap
    x_t *= wall
    w *= force
    w *= wall
    cage_plus = np.maximum(w, 0.0)
    output_torque = c.path_radius + x_r
    output_torque *= w
    # Moment about the drive's axis of the crank force, which acts along u through the eccentric's centre:
    # F (E_r u_t/u_r - E_t).
    centre_r *= t
    centre_r *= wall
    centre_r -= centre_t
    centre_r *= force
    per_u_r *= force
    status = np.where(s > 0, np.int8(Status.LOADED), np.int8(Status.PLAY))
    status[~(turn <= TOLERANCE)] = Status.NOT_CONVERGED
    return Equilibrium(
        gear=force * per_n_r, crank=per_u_r, cage_plus=cage_plus, cage_minus=cage_plus - w,
        output_torque=output_torque, crank_torque=centre_r, radial=x_r, tangential=x_t, status=status,
    )


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
    of_contacts = (result.gear, result.crank, result.cage_plus, result.cage_minus)
    for values, force in zip(of_contacts, forces, strict=True):
        values[:, index] = force.reshape(pairs)
    result.radial[:, index], result.tangential[:, index] = x[0].reshape(pairs), x[1].reshape(pairs)
    output_torque = (every.path_radius + x[0]) * (forces[2] - forces[3])
    result.output_torque[:, index] = output_torque.reshape(pairs)
    angle = every.beta + phi
    lever = every.eccentricity * (np.cos(angle) * normal_2[1] - np.sin(angle) * normal_2[0])
    result.crank_torque[:, index] = (forces[1] * lever).reshape(pairs)
    # An element that rests between its walls may touch the gear by a rounding error.
    carries = np.maximum(forces[0], forces[1]) > 1e-12 * forces.max(axis=0, initial=0.0)
    status = np.where(converged, np.where(carries, Status.ITERATED, Status.PLAY), Status.NOT_CONVERGED)
    result.status[:, index] = status.reshape(pairs)
