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
may touch, and further forces on the element (the "additional forces" of eq. 15). What a drawing switches on beyond
the paper's model is solved in `coupled_elements`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..contact.element_contacts import Contacts
from ..errors import expect
from ..numerics.arrays import Array
from .coupled_elements import solve_coupled
from .newton import BLOCK as NEWTON_BLOCK
from .newton import iterate
from .solution import NAMES, Equilibrium, Status, root

MIN_PASSES = 3
MAX_PASSES = 12
BLOCK = 16384
"""Elements times twists worked on at once: few enough that the arrays stay in the processor's cache, enough that
the calls do not count. From 8000 to 60 000 the time changes by a tenth."""
MAX_PAIRS = 2**19
"""Elements times twists whose equilibrium is held at once, at 65 bytes each."""
TOLERANCE = 1e-11
"""Greatest turn of the crank's normal, rad, that one more pass would bring: of that order are the errors of
the forces, as shares of the crank's."""


def solve(contacts: Contacts, crank_twist: ArrayLike, external_force: ArrayLike | None = None) -> Equilibrium:
    """Equilibrium of n elements at m crank twists (rad at the crank, cage and gear fixed).

    external_force: (2,) or (2, n), N, radial (outwards) and tangential force on every element, or None.
    An element that finds no equilibrium gets `Status.NOT_CONVERGED` and no force; it never raises for all.
    """
    twist = np.atleast_1d(np.asarray(crank_twist, float))
    expect(twist.ndim == 1 and bool(np.isfinite(twist).all()), "finite twists in one dimension", crank_twist, "twist")
    if not contacts.beyond.is_plain:
        return solve_coupled(contacts, twist, external_force)
    result = closed_form(contacts, twist)
    special = np.ones(len(contacts), bool)
    if external_force is None:
        special = (contacts.cage_gap < 0) | (result.status == Status.NOT_CONVERGED).any(axis=0)
    if special.any():
        _iterated(contacts, twist, np.flatnonzero(special), external_force, result)
    return result


def solve_chunks(contacts: Contacts, crank_twist: Array) -> Iterator[tuple[slice, Equilibrium]]:
    """`solve` for those who reduce the result at once: some of the twists (m,) and their equilibrium, in turn.

    Whatever the number of twists, no more than `MAX_PAIRS` elements times twists are held.
    """
    rows = max(1, MAX_PAIRS // max(1, len(contacts)))
    for first in range(0, len(crank_twist), rows):
        part = slice(first, min(first + rows, len(crank_twist)))
        yield part, solve(contacts, crank_twist[part])


def closed_form(contacts: Contacts, crank_twist: Array) -> Equilibrium:
    """The closed form for n elements at m twists, arrays (m, n).

    An element with cage_gap < 0 gets the result of one that just fits its bore: a start for the iteration.
    One whose passes do not settle is marked `Status.NOT_CONVERGED`, for the same.
    """
    shape = (len(crank_twist), len(contacts))
    numbers = dict(zip(NAMES, np.empty((8, *shape)), strict=False))
    result = Equilibrium(**numbers, status=np.empty(shape, np.int8))
    fixed = _Fixed(contacts)
    rows = max(1, math.ceil(shape[0] / max(1, round(shape[0] * shape[1] / BLOCK))))
    # One allocation each for results and scratch: the C library gives single arrays of this size back to the
    # system, and fresh pages for every array of every call cost more than the arithmetic.
    scratch = np.empty((7, rows, shape[1]))
    for first in range(0, shape[0], rows):
        part = slice(first, first + rows)
        here = Equilibrium(*(getattr(result, name)[part] for name in NAMES))
        _solve_block(contacts, fixed, crank_twist[part], here, scratch[:, : len(here.gear)])
    return result


class _Fixed:
    """What the twist leaves alone, (n,)."""

    def __init__(self, c: Contacts) -> None:
        self.cage_gap = np.maximum(c.cage_gap, 0.0)
        self.per_n_r = 1 / c.normal_r
        self.slope = c.normal_t * self.per_n_r
        self.gear_gap = c.gear_gap * self.per_n_r
        # Indentations per unit of s, seen along the radius.
        self.gear_give = root(c.stiffness_crank / (c.stiffness_gear * c.normal_r), c.exponent) * self.per_n_r
        self.cage_give = root(c.stiffness_crank / c.stiffness_cage, c.exponent)
        self.e_cos, self.e_sin = c.eccentricity * np.cos(c.beta), c.eccentricity * np.sin(c.beta)


def _solve_block(c: Contacts, fixed: _Fixed, twist: Array, out: Equilibrium, scratch: Array) -> None:
    """The closed form for twists whose arrays fit the processor's cache; in place, the results' arrays too."""
    p = c.exponent
    t, t_next, d_r, d_t, wall, slope, spare = scratch
    centre_r, centre_t, touch, w = out.crank_torque, out.output_torque, out.cage_minus, out.cage_plus
    x_r, x_t, per_u_r, s = out.radial, out.tangential, out.crank, out.gear

    # The eccentric's centre by the addition theorem: a sine and a cosine of every pair would double the time.
    cos, sin = np.cos(twist)[:, None], np.sin(twist)[:, None]
    np.multiply(cos, fixed.e_cos, out=centre_r)
    centre_r -= np.multiply(sin, fixed.e_sin, out=spare)
    np.multiply(sin, fixed.e_cos, out=centre_t)
    centre_t += np.multiply(cos, fixed.e_sin, out=spare)
    np.subtract(c.path_radius, centre_r, out=d_r)
    # The wall is the one the neutral position leans to: a displacement towards it only adds to the lean.
    # From here on tangential lengths count positive towards that wall.
    np.divide(centre_t, d_r, out=t)
    t += fixed.slope
    np.copysign(1.0, np.negative(t, out=t), out=wall)
    np.multiply(wall, fixed.slope, out=slope)
    # Where the element just touches gear and wall: its displacement, and d there.
    np.subtract(fixed.gear_gap, np.multiply(slope, fixed.cage_gap, out=spare), out=touch)
    d_r += touch
    np.subtract(fixed.cage_gap, np.multiply(wall, centre_t, out=spare), out=d_t)

    np.divide(d_t, d_r, out=t)
    for done in range(1, MAX_PASSES + 1):
        np.subtract(t, slope, out=w)
        np.maximum(w, 0.0, out=w)
        give = root(w, p, out=x_t)
        give *= fixed.cage_give
        np.multiply(t, t, out=per_u_r)
        per_u_r += 1.0
        np.sqrt(per_u_r, out=per_u_r)
        compliance = root(per_u_r, p, out=x_r)
        compliance *= per_u_r
        compliance += fixed.gear_give
        compliance += np.multiply(w, give, out=spare)
        # Closing condition: s * compliance = approach.
        np.multiply(per_u_r, c.radius_sum, out=s)
        s -= d_r
        s -= np.multiply(t, d_t, out=spare)
        s /= compliance
        np.maximum(s, 0.0, out=s)
        # Displacement beyond touching, and the direction of d there.
        np.subtract(fixed.gear_give, np.multiply(slope, give, out=spare), out=x_r)
        x_r *= s
        x_t *= s
        np.add(d_t, x_t, out=t_next)
        t_next /= np.add(d_r, x_r, out=spare)
        turn = np.abs(np.subtract(t_next, t, out=spare), out=spare)
        if done >= MIN_PASSES and turn.max(initial=0.0) <= TOLERANCE:
            break
        t, t_next = t_next, t

    out.status[:] = s > 0  # UNLOADED and LOADED
    out.status[~(spare <= TOLERANCE)] = Status.NOT_CONVERGED
    force = s
    force *= np.sqrt(s, out=spare) if p == 1.5 else np.power(s, p - 1, out=spare)
    force *= c.stiffness_crank
    x_r += touch
    x_t += fixed.cage_gap
    x_t *= wall
    # Moment about the drive's axis of the crank force, which acts along u through the eccentric's centre:
    # F (E_r u_t/u_r - E_t).
    centre_r *= t
    centre_r *= wall
    centre_r -= centre_t
    centre_r *= force
    per_u_r *= force
    cage = w
    cage *= force
    cage *= wall
    force *= fixed.per_n_r
    np.add(c.path_radius, x_r, out=out.output_torque)
    out.output_torque[:] *= cage
    np.maximum(np.negative(cage, out=spare), 0.0, out=out.cage_minus)
    np.maximum(cage, 0.0, out=out.cage_plus)


def _iterated(
    contacts: Contacts, twist: Array, index: NDArray[np.intp], external_force: ArrayLike | None, result: Equilibrium
) -> None:
    """Overwrite the columns `index` of `result` with the Newton iteration's."""
    some = contacts[index]
    load = np.zeros((2, len(some)))
    if external_force is not None:
        force = np.asarray(external_force, float)
        expect(
            force.shape in ((2,), (2, len(contacts))) and bool(np.isfinite(force).all()),
            f"finite forces of shape (2,) or (2, {len(contacts)})",
            force.shape,
            "external_force",
        )
        load[:] = force[:, None] if force.ndim == 1 else force[:, index]
    # Every pair of element and twist is one problem of its own.
    rows = min(len(twist), max(1, NEWTON_BLOCK // len(some)))
    every = some[np.tile(np.arange(len(some)), rows)]
    for first in range(0, len(twist), rows):
        part = slice(first, min(first + rows, len(twist)))
        here = Equilibrium(*(getattr(result, name)[part] for name in NAMES))
        count = len(here.gear)
        _iterated_block(every[slice(0, count * len(some))], twist[part], np.tile(load, count), index, here)


def _iterated_block(every: Contacts, twist: Array, load: Array, index: NDArray[np.intp], result: Equilibrium) -> None:
    """The same for all pairs of a few twists with the elements: `every` holds those of each twist in turn."""
    pairs = (len(twist), len(index))
    phi = np.repeat(twist, len(index))
    start = np.stack([result.radial[:, index].ravel(), result.tangential[:, index].ravel()])
    x, forces, normal_2, converged = iterate(every, phi, load, start)
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
    status = np.where(converged, np.where(carries, Status.ITERATED, Status.UNLOADED), Status.NOT_CONVERGED)
    result.status[:, index] = status.reshape(pairs)
