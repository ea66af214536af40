"""Individual drives of the population along a record, each with its own deviations: the null distribution."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from .element_columns import average_torque
from .element_motion import elements_on_profile, inside_profile
from .responses import PLACES, locate_cells, place_deviations
from .scatter import N_JOBS, Scatter
from .tolerance_scatter import Spread, in_turn

N_INDIVIDUALS = 48
"""Individual drives that are simulated. Chosen by judgement: a few dozen give the spread within 10 %."""


def simulate_individuals(
    scatter: Scatter,
    count: int = N_INDIVIDUALS,
    seed: int = 0,
    places: tuple[float, float] = (0.0, PLACES),
    spread: Spread = in_turn,
) -> Array:
    """(count, n) N.m, torque of individual drives less that of the mean drive, at the blocks of the record.

    The elements are spread as evenly as their seats allow, from the position at crank angle 0 that the scatter has, or
    from a random one where it has none. Deviations of balls and cranks move with the element, those of lobes stay in
    the gear. The torque is not linearised in the clearance; bores have their mean radius. places: range of the
    deviation of a drive's places of bores and lobes along their circle, over that of their sizes, in which any is as
    likely, since drawings do not state it. A bore or a lobe beside its place moves and twists its element, as in
    `stiffness_model.rotation`; a lobe farther out acts as a larger one. spread: shares the drives among processes, with
    the same result.
    """
    seeds = np.random.SeedSequence([seed, len(scatter.twist)]).spawn(count)
    size = -(-count // N_JOBS)
    jobs = [_SomeDrives(scatter, tuple(seeds[first : first + size]), places) for first in range(0, count, size)]
    return np.concatenate([*spread(_torques, jobs)])


@dataclass(frozen=True)
class _SomeDrives:
    """Individuals with a seed each; places: see `simulate_individuals`."""

    scatter: Scatter
    seeds: tuple[np.random.SeedSequence, ...]
    places: tuple[float, float]


def _torques(what: _SomeDrives) -> Array:
    """(m, n) N.m, see `simulate_individuals`."""
    scatter, drive, r = what.scatter, what.scatter.drive, what.scatter.responses
    n, rows = drive.elements, drive.eccentrics
    share = {part: np.sqrt(v) for part, v in r.shares.items()}
    parts = len(scatter.motion.block)
    mean = average_torque(drive, r, scatter.motion, scatter.twist, np.zeros(parts))[0]
    found = np.empty((len(what.seeds), len(scatter.twist)))
    planes = np.stack([r.single[:-1], r.single[1:]], axis=-1)
    for number, rng in enumerate(map(np.random.default_rng, what.seeds)):
        start, wide = _start(scatter, rng), place_deviations(drive, rng.uniform(*what.places))
        crank = rng.standard_normal(n)
        if drive.crank_deviation == "eccentric":
            crank = crank[np.arange(n) % rows]
        of_element = share["element"] * rng.standard_normal(n) + share["crank"] * crank
        of_lobe = share["gear"] * rng.standard_normal(drive.lobes * rows)
        of_lobe += wide.outwards / r.deviation * rng.standard_normal(drive.lobes * rows)
        bore_angle = wide.bore / wide.radius * rng.standard_normal(n)
        lobe_angle = wide.lobe / wide.radius * rng.standard_normal(drive.lobes * rows)
        # As if the output had turned on by a bore's angle, or back by a lobe's.
        margin = abs(drive.ratio - 1) * float(np.abs(bore_angle).max() + np.abs(lobe_angle).max())
        on = elements_on_profile(drive, scatter.motion, start, margin)
        beta = on.position + (drive.ratio - 1) * (bore_angle[on.element] - lobe_angle[on.lobe])
        inside = inside_profile(drive, scatter.motion, on.part, beta)
        z = of_element[on.element] + of_lobe[on.lobe]
        lead = (1 - 1 / drive.ratio) * lobe_angle[on.lobe] - bore_angle[on.element]
        torque = _single(scatter, planes, on.part, lead, beta, z, inside)
        of_parts = np.asarray(np.bincount(on.part, torque, parts), float)
        found[number] = scatter.motion.mean(of_parts) - mean
    return found


def _start(scatter: Scatter, rng: np.random.Generator) -> float:
    """rad, a position of the first element at crank angle 0."""
    if scatter.start is None:
        return rng.uniform(0, 2 * np.pi)
    return rng.normal(scatter.start, scatter.start_deviation * 2 * np.pi / scatter.drive.elements)


def _single(
    scatter: Scatter, planes: Array, part: NDArray[np.intp], lead: Array, beta: Array, z: Array, weight: Array
) -> Array:
    """(k,) N.m, torque of single elements by linear interpolation along all three axes, times a weight.

    planes: (c, N_TWISTS, N_POSITIONS, 2) N.m, tables at each of c clearances and at the next; part: (k,), numbers of
    the parts; lead: (k,) rad, twist of the element beyond that of the part; beta: (k,) rad, position; z: (k,),
    deviation of the clearance in standard deviations.
    """
    r = scatter.responses
    k, h = locate_cells(r.solved, z * r.deviation)
    twist = scatter.motion.twist_from(scatter.twist)[part] + lead
    low, high = r.interpolate(planes, k, twist, beta, weight)
    return (1 - h) * low + h * high
