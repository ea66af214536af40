"""The equilibrium of elements: status, contact forces and displacements, and what all solvers share."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..errors import expect
from ..numerics.arrays import Array


class Status(IntEnum):
    """How an element's equilibrium was found, or why it was not."""

    UNLOADED = 0  # no force at gear and crank: the element has clearance
    LOADED = 1  # gear, crank and one cage wall carry: closed form
    ITERATED = 2  # both walls carry or external forces act: Newton iteration, converged
    NOT_CONVERGED = 3
    EXCLUDED = 4  # beyond the usable part of the profile: not solved, carries nothing


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """Solution for n elements at m crank twists; all arrays (m, n).

    gear, crank, cage_plus, cage_minus: contact forces, N; output_torque: eq. 19, N.m; crank_torque: the
    torque that holds the crank, N.m, so that output_torque/(i crank_torque) -> 1 as the twist goes to 0;
    radial, tangential: displacement of the elements' centres, m (of an unloaded element: to the position in
    which it just touches gear and wall); status: of `Status`.
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

    @staticmethod
    def empty(shape: tuple[int, int]) -> Equilibrium:
        """Arrays of one shape, not initialised."""
        numbers = np.empty((8, *shape))
        return Equilibrium(*(numbers[k] for k in range(8)), status=np.empty(shape, np.int8))

    def at_twists(self, part: slice) -> Equilibrium:
        """Views of the arrays at some twists."""
        return Equilibrium(*(getattr(self, name)[part] for name in FIELDS))


FIELDS = tuple(f.name for f in fields(Equilibrium))
"""Names of its arrays; the last is the status."""


def inverse_power(x: Array, exponent: float, out: Array | None = None) -> Array:
    """x^(1/exponent) for x >= 0; for point contacts by the cube root, which is faster than a power."""
    if exponent == 1.5:
        y = np.cbrt(x, out=out)
        y *= y
        return y
    return np.power(x, 1 / exponent, out=out)


def external_forces(force: ArrayLike | None, n: int) -> Array:
    """Radial and tangential external force of n elements, (2, n) N, from (2,), (2, n) or None.

    Raises `InputError` for another shape and for forces that are not finite.
    """
    if force is None:
        return np.zeros((2, n))
    values = np.asarray(force, float)
    expect(
        values.shape in ((2,), (2, n)) and bool(np.isfinite(values).all()),
        f"finite forces of shape (2,) or (2, {n})",
        values.shape,
        "external_force",
    )
    return np.broadcast_to(values[:, None] if values.ndim == 1 else values, (2, n))
