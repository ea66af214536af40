"""Virtual drives: the random deviations of every part, in seeded blocks.

A drive's numbers depend on the seed and on its own index alone: not on how many drives are drawn, nor on
who computes which block.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..errors import expect
from ..numerics.arrays import Array
from .drive import Drive

BLOCK = 16
"""Drives in one seeded block."""


@dataclass(frozen=True, eq=False)
class Deviations:
    """Radii with their deviations, m, and positions of the elements of some virtual drives.

    All arrays have the shape (n_drives, n_elements). beta: position on the profile, rad in (-pi, pi];
    gear: distance of the equidistant q.
    """

    beta: Array
    element: Array
    crank: Array
    cage: Array
    gear: Array


def blocks(n_drives: int) -> Iterator[tuple[int, int]]:
    """(index of the block, drives in it) that make up `n_drives`.

    >>> list(blocks(20))
    [(0, 16), (1, 4)]
    """
    for start in range(0, n_drives, BLOCK):
        yield start // BLOCK, min(BLOCK, n_drives - start)


def check_seed(seed: object, where: str = "seed") -> None:
    """Raise `InputError` unless `seed` is a whole number not below 0."""
    whole = isinstance(seed, (int, np.integer)) and not isinstance(seed, bool)
    expect(whole and int(seed) >= 0, "a whole number not below 0", seed, where)  # type: ignore[call-overload]


def draw(drive: Drive, block: int, n_drives: int, seed: int) -> Deviations:
    """The first `n_drives` virtual drives of one block, section III of the paper.

    Deviations are normal; the first element's position is uniform over the profile's period; the further ones
    are spaced evenly, k = 0 ... n - 1 (eq. 20, whose printed k runs one too far). Elements k, k + n_ecc, ...
    share an eccentric.
    """
    check_seed(seed)
    rng = np.random.Generator(np.random.PCG64(np.random.SeedSequence(int(seed), spawn_key=(block,))))
    shape = (BLOCK, drive.elements)
    start = rng.uniform(-np.pi, np.pi, (BLOCK, 1))
    normal = {part: rng.standard_normal(shape) for part in ("element", "crank", "cage", "gear")}
    if drive.crank_deviation == "eccentric":
        normal["crank"] = normal["crank"][:, np.arange(drive.elements) % drive.eccentrics]
    step = 2 * np.pi / drive.elements
    beta = np.pi - (np.pi - start - step * np.arange(drive.elements)) % (2 * np.pi)

    def radius(part: str, nominal: float) -> Array:
        tolerance = drive.tolerances[part]
        return nominal + tolerance.offset + tolerance.sigma * normal[part][:n_drives]

    return Deviations(
        beta=beta[:n_drives],
        element=radius("element", drive.element_radius),
        crank=radius("crank", drive.crank_radius),
        cage=radius("cage", drive.element_radius),
        gear=radius("gear", drive.element_radius),
    )


def quasi_random_elements(drive: Drive, count: int) -> Deviations:
    """`count` elements spread evenly over deviations and usable positions (Sobol's sequence), shape (1, count).

    The mean of an element's torque over them, times the drive's elements and the usable share of the profile
    (usable_limit/pi), is the mean torque of all drives of the drawing: from eight thousand elements right to
    some 1e-5, where five hundred drawn drives are off by 0.1 to 0.4 %. `count` is best a power of 2. Not for
    percentiles: the elements make up no drives.
    """
    from scipy.special import ndtri
    from scipy.stats import qmc

    # A half step off zero the points of the sequence lie in the middles of their intervals.
    points = qmc.Sobol(5, scramble=False).random(count) + 0.5 / count
    deviate: dict[str, Array] = dict(zip(("element", "crank", "cage", "gear"), ndtri(points[:, 1:].T), strict=True))
    # Within the limit, so that the sharp edge of the profile costs no accuracy.
    beta = drive.usable_limit * (2 * points[:, 0] - 1)

    def radius(part: str, nominal: float) -> Array:
        tolerance = drive.tolerances[part]
        return (nominal + tolerance.offset + tolerance.sigma * deviate[part])[None, :]

    return Deviations(
        beta[None, :],
        radius("element", drive.element_radius),
        radius("crank", drive.crank_radius),
        radius("cage", drive.element_radius),
        radius("gear", drive.element_radius),
    )


def quasi_random_drives(drive: Drive, count: int) -> Deviations:
    """`count` whole drives that stand for all of the drawing, shape (count, n_elements): for what couples elements.

    Starts are spread evenly over a pitch; the deviations of the k-th elements together with it by Sobol's sequence,
    for every k moved on by a further step of a Kronecker sequence, so that all elements together are spread too. The
    mean torque of 256 such drives is right to 2e-4 to 6e-4. `count` is best a power of 2. Not for percentiles.
    """
    from scipy.special import ndtri
    from scipy.stats import qmc

    points = qmc.Sobol(5, scramble=False).random(count) + 0.5 / count
    # Steps of the Kronecker sequence in four dimensions: powers of the root of x^5 = x + 1.
    golden = 1.1673039782614187
    steps = np.arange(drive.elements)[:, None] * golden ** -np.arange(1.0, 5.0)
    deviate = ndtri(np.clip((points[:, None, 1:] + steps) % 1.0, 1e-12, 1 - 1e-12))
    normal: dict[str, Array] = dict(zip(("element", "crank", "cage", "gear"), np.moveaxis(deviate, 2, 0), strict=True))
    if drive.crank_deviation == "eccentric":
        normal["crank"] = normal["crank"][:, np.arange(drive.elements) % drive.eccentrics]
    pitch = 2 * np.pi / drive.elements
    beta = np.pi - (np.pi - pitch * (points[:, :1] + np.arange(drive.elements))) % (2 * np.pi)

    def radius(part: str, nominal: float) -> Array:
        tolerance = drive.tolerances[part]
        return nominal + tolerance.offset + tolerance.sigma * normal[part]

    return Deviations(
        beta,
        radius("element", drive.element_radius),
        radius("crank", drive.crank_radius),
        radius("cage", drive.element_radius),
        radius("gear", drive.element_radius),
    )


def nominal(drive: Drive, n_positions: int = 1) -> Deviations:
    """Drives without deviations (and without mean offsets), at evenly spread positions of the first element.

    Shape (n_positions, n_elements).
    """
    step = 2 * np.pi / drive.elements
    start = step * (np.arange(n_positions)[:, None] + 0.5) / n_positions
    beta = np.pi - (np.pi - start - step * np.arange(drive.elements)) % (2 * np.pi)
    ones = np.ones_like(beta)
    return Deviations(
        beta,
        drive.element_radius * ones,
        drive.crank_radius * ones,
        drive.element_radius * ones,
        drive.element_radius * ones,
    )
