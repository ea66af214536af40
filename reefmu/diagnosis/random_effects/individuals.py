"""Individual drives of the population along a record, each with its own deviations: the null distribution."""

from __future__ import annotations

import numpy as np

from stiffness_model.numerics.arrays import Array

from .element_motion import element_positions, inside_profile
from .responses import locate_cells
from .scatter import PLACES, Scatter, place_deviations
from .seating import Seating, even_seats

N_INDIVIDUALS = 48
"""Individual drives that are simulated. Chosen by judgement: a few dozen give the spread within 10 %."""


def simulate_individuals(
    scatter: Scatter, count: int = N_INDIVIDUALS, seed: int = 0, places: tuple[float, float] = (0.0, PLACES)
) -> Array:
    """(count, n) N.m, torque of individual drives less that of the mean drive, at the blocks of the record.

    The elements are seated as the scatter says, from a random position at crank angle 0 where it does not. Deviations
    of balls and cranks move with the element, those of lobes stay in the gear. The torque is not linearised in the
    clearance; bores have their mean radius. places: range of the deviation of a drive's places of bores and lobes, over
    that of their sizes, in which any is as likely, since drawings do not state it. A bore or a lobe beside its place
    moves and twists its element, as in `stiffness_model.rotation`; a lobe farther out acts as a larger one.
    """
    drive, r = scatter.drive, scatter.responses
    rng = np.random.default_rng(np.random.SeedSequence([seed, len(scatter.twist)]))
    n, rows = drive.elements, drive.eccentrics
    share = {part: np.sqrt(v) for part, v in r.shares.items()}
    mean, twist = mean_torque(scatter), scatter.motion.twist_from(scatter.twist)
    even = even_seats(drive)
    found = np.empty((count, len(scatter.twist)))
    for number in range(count):
        start, (place, angle) = rng.uniform(0, 2 * np.pi), place_deviations(drive, rng.uniform(*places))
        beta, lobe = element_positions(drive, scatter.motion, scatter.seating or Seating(start, even))
        crank = rng.standard_normal(n)
        if drive.crank_deviation == "eccentric":
            crank = crank[np.arange(n) % rows]
        of_element = share["element"] * rng.standard_normal(n) + share["crank"] * crank
        of_lobe = share["gear"] * rng.standard_normal(drive.lobes * rows)
        of_lobe += place / r.deviation * rng.standard_normal(drive.lobes * rows)
        bore_angle, lobe_angle = angle * rng.standard_normal(n), angle * rng.standard_normal(drive.lobes * rows)
        # As if the output had turned on by a bore's angle, or back by a lobe's.
        beta = beta + (drive.ratio - 1) * (bore_angle - lobe_angle[lobe])
        inside = inside_profile(drive, scatter.motion, beta)
        point, element = np.nonzero(inside > 0)
        met = lobe[point, element]
        z = of_element[element] + of_lobe[met]
        lead = (1 - 1 / drive.ratio) * lobe_angle[met] - bore_angle[element]
        torque = inside[point, element] * _single(scatter, twist[point] + lead, beta[point, element], z)
        of_parts = np.bincount(point, torque, len(twist)).astype(float)
        found[number] = scatter.motion.mean(of_parts) - mean
    return found


def mean_torque(scatter: Scatter) -> Array:
    """(n,) N.m, torque of the mean drive from the same tables, averaged over deviations and positions."""
    r, drive = scatter.responses, scatter.drive
    curve = drive.elements / (2 * np.pi) * np.trapezoid(r.at_clearance(0.0)["mean"], r.position, axis=1)
    return scatter.motion.mean(np.interp(scatter.motion.twist_from(scatter.twist), r.twist, curve))


def _single(scatter: Scatter, twist: Array, beta: Array, z: Array) -> Array:
    """(k,) N.m, torque of single elements by linear interpolation along all three axes.

    twist: (k,) rad; beta: (k,) rad, position; z: (k,), deviation of the clearance in standard deviations.
    """
    r = scatter.responses
    t, f = locate_cells(r.twist, twist)
    b, g = locate_cells(r.position, beta)
    k, h = locate_cells(r.solved, z * r.deviation)
    flat, (_, n_twist, n_position) = r.single.ravel(), r.single.shape
    first = (k * n_twist + t) * n_position + b
    planes = []
    for offset in (0, n_twist * n_position):
        low = (1 - g) * flat[first + offset] + g * flat[first + offset + 1]
        high = (1 - g) * flat[first + offset + n_position] + g * flat[first + offset + n_position + 1]
        planes.append((1 - f) * low + f * high)
    return (1 - h) * planes[0] + h * planes[1]
