"""What the equilibrium of elements is: the status, forces and displacements of each, and what all solvers share."""

from __future__ import annotations

from dataclasses import dataclass, fields
from enum import IntEnum

import numpy as np
from numpy.typing import NDArray

from ..numerics.arrays import Array


class Status(IntEnum):
    """What became of an element."""

    UNLOADED = 0  # no force at gear and crank: the element has play
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


NAMES = tuple(f.name for f in fields(Equilibrium))
"""Its fields; the last is the status."""


def root(x: Array, exponent: float, out: Array | None = None) -> Array:
    """x^(1/exponent) for x >= 0; by the cube root for point contacts, which is faster than a power."""
    if exponent == 1.5:
        y = np.cbrt(x, out=out)
        y *= y
        return y
    return np.power(x, 1 / exponent, out=out)
