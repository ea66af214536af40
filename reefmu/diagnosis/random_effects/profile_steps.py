"""Steps of the torque where elements enter and leave the profile, about the average that the base curve is.

Elements without deviations are alike, so that their torque has the period of their distance in the position of the
first: it is known at all positions once it is known over that distance. In a slow loop the steps of two positions are
many blocks apart.
"""

from __future__ import annotations

import numpy as np

from stiffness_model.drawing.drive import Drive
from stiffness_model.lookup.element_table import FADE_HALF_WIDTH
from stiffness_model.numerics.arrays import Array

from .element_motion import ElementMotion, share_inside
from .part_responses import PartResponses
from .responses import locate_cells

PHASES = 48
"""Positions of the first element, over the distance to the next, about which the steps are averaged. Chosen by the
likelihood of records of individuals: with 12 instead -2 log likelihood is 1010 more in a single loop and from 2 less to
29 more in four other records, with 96 and 192 it changes by less than 35."""
NODES_PER_PHASE = 4
"""Nodes of the torque over that distance for each of these positions; chosen by judgement, so that the range in which
an element fades at an edge of the profile has several."""


def profile_steps(drive: Drive, parts: PartResponses, motion: ElementMotion, average: Array) -> Array:
    """(2 PHASES, n) N.m, by which the torque of elements without deviations differs from its average, and that by which
    its product with their position over the usable limit does, as random effects: at both edges of the profile elements
    enter and leave in steps, of which neither the place, by the first element's position, nor the height is known
    exactly.

    parts: with the table "mean"; average: (2, n) N.m, of `average_torque`.
    """
    distance, nodes = 2 * np.pi / drive.elements, PHASES * NODES_PER_PHASE
    periodic = _over_distance(drive, parts, nodes)
    of_parts = np.zeros((len(motion.rotation), PHASES, 2))
    shift = NODES_PER_PHASE * np.arange(PHASES)
    for offset in motion.offsets.T:
        some = np.flatnonzero(np.isfinite(offset))
        place = (motion.rotation[some] + offset[some]) / distance * nodes + NODES_PER_PHASE / 2
        node = np.floor(place)
        beyond, at = (place - node)[:, None, None], node.astype(np.intp)[:, None] + shift
        of_parts[some] += (1 - beyond) * periodic[some[:, None], at % nodes]
        of_parts[some] += beyond * periodic[some[:, None], (at + 1) % nodes]
    of_parts /= np.isfinite(motion.offsets).sum(axis=1)[:, None, None]
    steps = np.add.reduceat(of_parts, motion.first) - average.T[:, None]
    return np.ascontiguousarray(steps.reshape(len(steps), -1).T) / np.sqrt(PHASES)


def _over_distance(drive: Drive, parts: PartResponses, nodes: int) -> Array:
    """(p, nodes, 2) N.m, torque of all elements in each part, and its product with their position over the usable
    limit, for positions of one of them at so many nodes over the distance to the next."""
    distance, reach = 2 * np.pi / drive.elements, drive.usable_limit + FADE_HALF_WIDTH
    around = int(np.ceil(reach / distance))
    position = distance * (np.arange(nodes) / nodes + np.arange(-around - 1, around + 1)[:, None])
    inside = share_inside(drive, position)
    cell, f = locate_cells(parts.position, position)
    # What the value at each node of the table adds to the torque, (nodes of the table, nodes, 2).
    share = np.zeros((len(parts.position), nodes, 2))
    of_node = np.broadcast_to(np.arange(nodes), position.shape)
    for at, weight in ((cell, (1 - f) * inside), (cell + 1, f * inside)):
        both = np.stack([weight, weight * position / drive.usable_limit], axis=-1)
        np.add.at(share, (at.ravel(), of_node.ravel()), both.reshape(-1, 2))
    mean = parts.values[parts.names.index("mean")]
    return (mean @ share.reshape(len(share), -1)).reshape(len(mean), nodes, 2)
