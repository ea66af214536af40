"""Torque of an individual over twist and output angle.

The contacts are those of the paper: cage and gear are fixed at the output angle, and the crank is twisted out of its
kinematic position, which is i times the output angle.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from ..contact.element_contacts import Contacts
from ..display import one_line
from ..drawing.twist_limits import MAX_OUTPUT_ANGLE, expect_twists
from ..equilibrium.closed_form import Equilibrium, Status, solve
from ..errors import expect, expect_number, warn_not_converged
from ..numerics.arrays import Array
from .element_positions import ElementPositions, element_positions
from .individual_contacts import IndividualContacts
from .individual_drive import Individual

BATCH_SIZE = 6000
"""Contacts solved at once; chosen by judgement so that their arrays fit a core's cache."""
TWIST_BATCH_SIZE = 128
"""Twists of a map whose equilibria are held at once, 50 MB."""


@dataclass(frozen=True)
class TurningMap:
    """Torques and forces of an individual at n_angle output angles and n_twist twists.

    output_angle: (n_angle,) rad; twist: (n_twist,) rad at the output. torque: (n_angle, n_twist) N.m on the output.
    crank_torque: (n_angle, n_twist) N.m that holds the crank. max_force: (n_angle, n_twist) N, greatest contact force.
    """

    individual: Individual
    output_angle: Array
    twist: Array
    torque: Array
    crank_torque: Array
    max_force: Array

    def __repr__(self) -> str:
        return one_line(self)

    @property
    def crank_turns(self) -> Array:
        """Turns of the untwisted crank at the output angles, (n_angle,), with the sign of the output angle."""
        return self.output_angle * self.individual.drive.transmission_ratio / (2 * np.pi)


def turning_map(
    individual: Individual, twist: ArrayLike, output_angle: ArrayLike, *, clearance: float = 0.0
) -> TurningMap:
    """Solve an `individual` at every pair of output angle and twist.

    output_angle: (n_angle,) rad. twist: (n_twist,) rad at the output. clearance: m, added to the gear's clearance
    (positive: play). Raises `InputError` for angles that are not finite and one-dimensional, and for twists far beyond
    the drawing's max_twist (`twist_limits`); warns with `NotConvergedWarning` of elements without an equilibrium.

    >>> from stiffness_model import ARCMIN, load_drive
    >>> from stiffness_model.rotation import draw_individual
    >>> one = draw_individual(load_drive("drive_1"), 7)
    >>> turning_map(one, np.array([3.0, 6.0, 8.0]) * ARCMIN, [0.0, 0.1]).torque.shape
    (2, 3)
    """
    twists, angle = expect_twists(individual.drive, twist), expect_angles(output_angle, "output angle")
    torque, crank_torque, force = (np.empty((len(angle), len(twists))) for _ in range(3))
    lost, whole = 0, 0
    for part, batch in angle_batches(individual, angle, clearance):
        for first in range(0, len(twists), TWIST_BATCH_SIZE):
            some = slice(first, first + TWIST_BATCH_SIZE)
            numbers = _solve_grouped(batch.contacts, twists[some] * individual.drive.ratio, _torques_and_force)
            numbers = numbers.reshape(4, -1, *batch.positions.beta.shape)
            torque[part, some], crank_torque[part, some] = np.einsum(
                "qtaw,aw->qat", numbers[:2], batch.positions.weight
            )
            carries = batch.positions.weight > 0
            force[part, some] = (numbers[2] * carries).max(axis=2).T
            lost, whole = lost + int((numbers[3] * carries).sum()), whole + numbers.shape[1] * int(carries.sum())
    warn_not_converged(lost, whole, individual.drive.name)
    return TurningMap(individual, angle, twists, torque, crank_torque, force)


@dataclass(frozen=True)
class AngleBatch:
    """An individual at a few output angles, n of them, with everything that does not depend on the twist."""

    positions: ElementPositions
    contacts: Contacts
    ratio: float

    def torque(self, twist: Array) -> Array:
        """Torque, (n,) N.m on the output, at twists, (n,) rad, one for every angle."""
        # The twist moves the eccentric's centre only, to beta + i twist; gear and path keep the untwisted beta.
        lead = np.repeat(self.ratio * twist, self.positions.beta.shape[1])
        moved = replace(self.contacts, beta=self.contacts.beta + lead)
        return (solve_torques(moved).reshape(self.positions.beta.shape) * self.positions.weight).sum(axis=1)


def expect_angles(values: ArrayLike, name: str) -> Array:
    """The values as a one-dimensional array of angles, rad. Raises `InputError` for others, and beyond
    +-`twist_limits.MAX_OUTPUT_ANGLE`.
    """
    try:
        array = np.asarray(values, float)
    except (TypeError, ValueError):
        array = np.array(np.nan)
    expect(
        array.ndim == 1 and array.size > 0 and bool(np.isfinite(array).all()),
        "a one-dimensional array of finite angles in rad",
        values,
        name,
    )
    expect(float(np.abs(array).max()) <= MAX_OUTPUT_ANGLE, f"angles within +-{MAX_OUTPUT_ANGLE:g} rad", values, name)
    return array


def angle_batches(individual: Individual, angle: Array, clearance: float = 0.0) -> Iterator[tuple[slice, AngleBatch]]:
    """Batches of output angles, (n,) rad, each with its slice of them."""
    expect_number(clearance, "a finite clearance in m", "clearance")
    parts = IndividualContacts(individual)
    step = max(1, BATCH_SIZE // parts.window.width)
    for first in range(0, len(angle), step):
        part = slice(first, min(first + step, len(angle)))
        at = element_positions(individual, parts.window, angle[part])
        yield part, AngleBatch(at, parts.contacts(at, clearance), individual.drive.ratio)


def _solve_grouped(contacts: Contacts, crank_twist: Array, numbers: Callable[[Equilibrium], Array]) -> Array:
    """Quantities (q, n_twist, n) of the equilibrium. Balls larger than their bore are solved separately, since they
    need an iteration.
    """
    tight = contacts.cage_gap < 0
    if not tight.any():
        return numbers(solve(contacts, crank_twist))
    groups = [(some, numbers(solve(contacts[some], crank_twist))) for some in (~tight, tight)]
    found = np.empty((len(groups[0][1]), len(crank_twist), len(contacts)))
    for some, values in groups:
        found[:, :, some] = values
    return found


def solve_torques(contacts: Contacts) -> Array:
    """Torques of n elements on the output, (n,) N.m, at the crank's twist that `beta` holds."""
    return _solve_grouped(contacts, np.zeros(1), _torque)[0, 0]


def _torque(result: Equilibrium) -> Array:
    return result.output_torque[None]


def _torques_and_force(result: Equilibrium) -> Array:
    force = np.maximum(np.maximum(result.gear, result.crank), np.maximum(result.cage_plus, result.cage_minus))
    return np.stack([result.output_torque, result.crank_torque, force, result.status == Status.NOT_CONVERGED])
