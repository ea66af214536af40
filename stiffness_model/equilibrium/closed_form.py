"""Static equilibrium of every rolling element, in closed form where its contacts allow it.

`closed_form_pass` derives the equations. For given direction of the crank's normal an element's force follows from one
division. That direction depends weakly on the element's displacement (by displacement/|d|), so that passes which
refresh it converge fast. The first takes it where the element just touches gear and wall; the torque is right to about
1e-6 after two passes and to 1e-10 after three. s <= 0 means clearance: no force.

Two cases are iterated instead (`newton.minimise_energy`): a ball larger than its bore, where both walls may touch, and
external forces on the element (the "additional forces" of eq. 15). What a drawing switches on beyond the paper's model
is solved in `coupled_elements`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..contact.element_contacts import Contacts
from ..errors import expect
from ..numerics.arrays import Array
from .closed_form_pass import (
    GearContact,
    PassArrays,
    WallContact,
    closing_condition,
    eccentric_centre,
    next_normal,
    select_wall,
    touch_gear_and_wall,
    write_solution,
)
from .coupled_elements import solve_coupled
from .newton import MAX_ELEMENTS, minimise_energy
from .solution import Equilibrium, Status, external_forces

MIN_PASSES = 3
MAX_PASSES = 12
"""Passes after which an element whose normal still rotates is handed to the Newton iteration."""
BLOCK_PAIRS = 16384
"""Pairs of element and twist per block: few enough that the arrays stay in the processor's cache, enough that the cost
of calls does not count. Between 8000 and 60 000 the measured time changes by a tenth."""
MAX_PAIRS = 2**19
"""Pairs of element and twist whose equilibrium is held in memory at once, at 65 bytes each."""
TOLERANCE = 1e-11
"""Greatest rotation of the crank's normal, rad, in the last pass: the order of the relative error of the forces."""


def solve(contacts: Contacts, crank_twist: ArrayLike, external_force: ArrayLike | None = None) -> Equilibrium:
    """Equilibrium of n elements at m crank twists (rad at the crank, cage and gear fixed).

    external_force: (2,) or (2, n), N, radial (outwards) and tangential force on every element, or None. Raises
    `InputError` for twists or forces that are not finite or of another shape. An element without an equilibrium gets
    `Status.NOT_CONVERGED` and no force.
    """
    twist = np.atleast_1d(np.asarray(crank_twist, float))
    expect(twist.ndim == 1 and bool(np.isfinite(twist).all()), "finite twists in one dimension", crank_twist, "twist")
    if not contacts.options.is_plain:
        return solve_coupled(contacts, twist, external_force)
    solution = closed_form(contacts, twist)
    iterated = np.ones(len(contacts), bool)
    if external_force is None:
        iterated = (contacts.cage_gap < 0) | (solution.status == Status.NOT_CONVERGED).any(axis=0)
    if iterated.any():
        load = external_forces(external_force, len(contacts))
        _iterate_elements(contacts, twist, np.flatnonzero(iterated), load, solution)
    return solution


def solve_chunks(contacts: Contacts, crank_twist: Array) -> Iterator[tuple[slice, Equilibrium]]:
    """`solve` in chunks of the twists (m,): the slice of each chunk and its equilibrium.

    For callers that reduce the result at once: however many twists there are, at most `MAX_PAIRS` pairs of element and
    twist are held in memory.
    """
    rows = max(1, MAX_PAIRS // max(1, len(contacts)))
    for first in range(0, len(crank_twist), rows):
        chunk = slice(first, min(first + rows, len(crank_twist)))
        yield chunk, solve(contacts, crank_twist[chunk])


def closed_form(contacts: Contacts, crank_twist: Array) -> Equilibrium:
    """The closed form for n elements at m twists, arrays (m, n), without the Newton iteration of other cases.

    An element with cage_gap < 0 gets the solution of one that just fits its bore. An element whose passes do not
    converge gets `Status.NOT_CONVERGED`.
    """
    shape = (len(crank_twist), len(contacts))
    solution = Equilibrium.empty(shape)
    gear = GearContact.of(contacts, contacts.normal_r, contacts.normal_t, contacts.gear_gap, contacts.stiffness_gear)
    wall = WallContact.of(contacts)
    rows = max(1, math.ceil(shape[0] / max(1, round(shape[0] * shape[1] / BLOCK_PAIRS))))
    scratch = np.empty((7, rows, shape[1]))
    for first in range(0, shape[0], rows):
        part = slice(first, first + rows)
        block = solution.at_twists(part)
        _solve_block(contacts, gear, wall, crank_twist[part], block, scratch[:, : len(block.gear)])
    return solution


def _solve_block(
    c: Contacts, gear: GearContact, wall: WallContact, twist: Array, out: Equilibrium, scratch: Array
) -> None:
    """The closed form for a block of twists; until the end the arrays of `out` serve as working arrays."""
    t, t_next, d_r, d_t, side, slope, work = scratch
    centre_r, centre_t, s = out.crank_torque, out.output_torque, out.gear
    a = PassArrays(
        t, t_next, d_r, d_t, side, slope, out.cage_minus, out.cage_plus, out.crank, out.radial, out.tangential, work
    )
    eccentric_centre(c, twist, centre_r, centre_t, work)
    np.subtract(c.path_radius, centre_r, out=d_r)
    select_wall(a, gear, centre_t)
    touch_gear_and_wall(a, gear, wall, centre_t)
    np.divide(d_t, d_r, out=a.t)
    rotation = work
    for done in range(1, MAX_PASSES + 1):
        closing_condition(a, gear, wall, c, approach=s)
        wall_yielding = a.x_t
        a.x_r += np.multiply(a.w, wall_yielding, out=work)
        s /= a.x_r
        np.maximum(s, 0.0, out=s)
        np.subtract(gear.yielding, np.multiply(slope, wall_yielding, out=work), out=a.x_r)
        a.x_r *= s
        a.x_t *= s
        rotation = next_normal(a)
        if done >= MIN_PASSES and rotation.max(initial=0.0) <= TOLERANCE:
            break
        a.t, a.t_next = a.t_next, a.t

    out.status[:] = s > 0  # UNLOADED or LOADED
    out.status[~(rotation <= TOLERANCE)] = Status.NOT_CONVERGED
    force = s
    force *= np.sqrt(s, out=work) if c.exponent == 1.5 else np.power(s, c.exponent - 1, out=work)
    force *= c.stiffness_crank
    write_solution(a, force, gear, wall, c, (centre_r, centre_t), out)


def _iterate_elements(
    contacts: Contacts, twist: Array, index: NDArray[np.intp], load: Array, solution: Equilibrium
) -> None:
    """Overwrite the columns `index` of `solution` by the Newton iteration under external forces `load` (2, n) N."""
    some = contacts[index]
    # Every pair of element and twist is a problem of its own.
    rows = min(len(twist), max(1, MAX_ELEMENTS // len(some)))
    repeated = some[np.tile(np.arange(len(some)), rows)]
    for first in range(0, len(twist), rows):
        part = slice(first, min(first + rows, len(twist)))
        block = solution.at_twists(part)
        count = len(block.gear)
        pairs = repeated[slice(0, count * len(some))]
        _iterate_pairs(pairs, twist[part], np.tile(load[:, index], count), index, block)


def _iterate_pairs(pairs: Contacts, twist: Array, load: Array, index: NDArray[np.intp], out: Equilibrium) -> None:
    """The same for all pairs of a few twists with the elements: `pairs` repeats the elements for each twist."""
    shape = (len(twist), len(index))
    phi = np.repeat(twist, len(index))
    start = np.stack([out.radial[:, index].ravel(), out.tangential[:, index].ravel()])
    x, forces, normal_2, converged = minimise_energy(pairs, phi, load, start)
    forces[:, ~converged] = 0.0
    for values, force in zip((out.gear, out.crank, out.cage_plus, out.cage_minus), forces, strict=True):
        values[:, index] = force.reshape(shape)
    out.radial[:, index], out.tangential[:, index] = x[0].reshape(shape), x[1].reshape(shape)
    output_torque = (pairs.path_radius + x[0]) * (forces[2] - forces[3])
    out.output_torque[:, index] = output_torque.reshape(shape)
    angle = pairs.beta + phi
    lever = pairs.eccentricity * (np.cos(angle) * normal_2[1] - np.sin(angle) * normal_2[0])
    out.crank_torque[:, index] = (forces[1] * lever).reshape(shape)
    # Rounding may leave a force at the gear on an element that both walls hold.
    carries = np.maximum(forces[0], forces[1]) > 1e-12 * forces.max(axis=0, initial=0.0)
    status = np.where(converged, np.where(carries, Status.ITERATED, Status.UNLOADED), Status.NOT_CONVERGED)
    out.status[:, index] = status.reshape(shape)
