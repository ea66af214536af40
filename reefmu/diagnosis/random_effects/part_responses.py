"""Responses of one element at every part of a motion, where twist and clearance are known, by its position alone.

Wherever the first element of a drive stands, the elements have the same twist and clearance in a part: the tables are
interpolated to these once, and to the positions of the elements for each start.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from stiffness_model.numerics.arrays import Array

from .element_motion import ElementMotion
from .responses import ElementResponses, locate_cells

CLEARANCE_BIN = 0.3
"""Range of clearances, in standard deviations of single elements, that share one interpolation of the tables. Chosen by
judgement, less than the step of the tables."""


@dataclass(frozen=True)
class PartResponses:
    """names: of r tables; position: (m,) rad, nodes; values: (r, p, m) N.m, at the nodes, times the share of each of p
    parts in its block."""

    names: tuple[str, ...]
    position: Array
    values: Array

    def at(self, part: NDArray[np.intp], position: Array, weight: Array | float = 1.0) -> ResponsesAt:
        """The responses, times a weight (k,), in parts (k,), by number, at positions (k,), rad, held at the ends."""
        column, g = locate_cells(self.position, position)
        # Both arrays in the types and the order of a sparse matrix, which then copies neither.
        node, share = np.empty((len(part), 2), np.int32), np.empty((len(part), 2))
        np.add(part * len(self.position), column, out=node[:, 0], casting="same_kind")
        np.add(node[:, 0], 1, out=node[:, 1])
        np.multiply(weight, g, out=share[:, 1])
        np.subtract(weight, share[:, 1], out=share[:, 0])
        ends = np.arange(0, share.size + 1, 2, dtype=np.int32)
        size = self.values[0].size
        return ResponsesAt(self, csr_array((share.ravel(), node.ravel(), ends), shape=(len(part), size)))


@dataclass(frozen=True)
class ResponsesAt:
    """Responses at k points; nodes: (k, p m), weights of the nodes at each."""

    of: PartResponses
    nodes: csr_array

    def __getitem__(self, name: str) -> Array:
        """Values (k,), N.m, of the table of a name."""
        return np.asarray(self.nodes @ self.of.values[self.of.names.index(name)].ravel())


def part_responses(responses: ElementResponses, motion: ElementMotion, twist: Array, clearance: Array) -> PartResponses:
    """The responses where the contacts have the twist (n,), rad, by block, and each of the p parts of the motion has a
    clearance (p,), m."""
    level, values = clearance_levels(responses, clearance)
    tables = responses.at_clearances(values)
    row, f = locate_cells(responses.twist, motion.twist_from(twist))
    above = (motion.weight * f)[:, None]
    below = motion.weight[:, None] - above
    found = np.empty((len(tables), len(row), len(responses.position)))
    for of_table, nodes in zip(found, tables.values(), strict=True):
        np.multiply(below, nodes[level, row], out=of_table)
        of_table += above * nodes[level, row + 1]
    return PartResponses(tuple(tables), responses.position, found)


def clearance_levels(responses: ElementResponses, clearance: Array) -> tuple[NDArray[np.intp], Array]:
    """The number (p,) of the group of nearly the same clearance, m, of each part, and the mean clearance (c,), m, of
    each group."""
    step = max(CLEARANCE_BIN * responses.deviation, 1e-12)
    _, level = np.unique(np.round(clearance / step), return_inverse=True)
    return level, np.bincount(level, clearance) / np.bincount(level)
