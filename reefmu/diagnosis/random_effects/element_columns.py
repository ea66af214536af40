"""Torque of the elements on the profile along a record, and what deviations of single parts add to it, for one start.

Every ball and bore keeps its deviation while it moves past the crank; the deviations of the lobes stay in the gear, so
that an element meets another lobe with every turn. Each deviation is one random effect, and its column is what one
standard deviation does to every block of the record. Bores and lobes deviate in size and in place; a bore or a lobe
beside its place twists its element and moves it along the profile. At the edges of the usable profile elements enter
and leave in steps, about which the base curve is the average.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array

from .element_motion import ElementMotion, ElementsOnProfile, elements_on_profile, inside_profile
from .part_responses import PartResponses, ResponsesAt, clearance_levels
from .responses import (
    MAX_ORDER,
    NODE_WEIGHTS,
    NODES,
    TERMS,
    ElementResponses,
    hermite,
    term,
)

MIN_BORE_SHARE = 0.002
"""Least variance from the bores, over the variance from the clearances, for the bores to have columns. Chosen by
judgement."""
MIN_SHARE = 1e-4
"""Least variance of a term of an element, a lobe or a pair of both, over that of the linear term of the clearance, for
the term to have columns. Chosen by the likelihood of individuals, which 1e-5 changes by less than 20 and 1e-3 by up to
260."""


@dataclass(frozen=True)
class PairColumns:
    """Columns of pairs of an element and a lobe that share a block; number, block: (k,), of the pair and, in order, of
    the block; values: (t, k) N.m, of each of t terms."""

    number: NDArray[np.intp]
    block: NDArray[np.intp]
    values: Array


@dataclass(frozen=True)
class SeatedElements:
    """The elements of a drive along a record; parts: their responses in every part of the motion; start: rad, position
    of the first element at crank angle 0."""

    drive: Drive
    responses: ElementResponses
    motion: ElementMotion
    parts: PartResponses
    start: float

    def columns(self, factors: Sequence[float] = (1.0,) * MAX_ORDER) -> Array:
        """(m, n) N.m, of one standard deviation of each random effect of elements, lobes and eccentrics, and of the
        drive as a whole; factors: of the terms of the first and the next orders, 0 for no columns, as of all others."""
        places = self.responses.places
        found = [self._shift_by_places()]
        if _square(of_bores := self._response("bore")) > MIN_BORE_SHARE * self._linear_variance:
            found.append(self._by_element.sums(of_bores))
        for orders in TERMS:
            factor = factors[sum(orders) - 1] if sum(orders) <= len(factors) else 0.0
            if not factor:
                continue
            values = self._response(term(*orders))
            if self._counts(of_element := self._of_elements(orders), values):
                found.append(self._by_element.sums(factor * of_element**0.5 * values))
            if self._counts(of_lobe := self._of_lobes(orders), values):
                of_lobes = factor * of_lobe**0.5 * values
                if orders == (0, 1):
                    # A lobe along the circle twists its element a little less than a bore.
                    of_lobes += factor * places.lobe / places.radius / self.drive.ratio * self._response("slope")
                found.append(self._by_lobe.sums(of_lobes))
            if (of_cranks := self._of_cranks(orders)) > 0:
                found.append(self._by_crank.sums(factor * of_cranks**0.5 * values))
        return np.concatenate(found)

    def steps(self, average: Array) -> Array:
        """(2, n) N.m, by which the torque of elements without deviations differs from its average, and that by which
        its product with their position over the usable limit does, as in `profile_steps`; average: (2, n) N.m."""
        alone = self._response("mean")
        beside = alone * self._elements.position / self.drive.usable_limit
        return np.stack([self._by_block(alone), self._by_block(beside)]) - average

    @property
    def together(self) -> Array:
        """(n,) N.m, what one standard deviation of the clearance of all elements at once does in the mean."""
        return self._by_block(self._response(term(1, 0)))

    def of_pairs(self) -> PairColumns:
        """Columns of products of deviations of an element and of the lobe it meets: random effects of every pair."""
        shares = [1 - self._of_elements(o) - self._of_lobes(o) - self._of_cranks(o) for o in TERMS]
        terms = [share**0.5 * self._response(term(*o)) for share, o in zip(shares, TERMS, strict=True) if share > 0]
        on, counted = self._elements, [of_term for of_term in terms if self._counts(1.0, of_term)]
        number = on.element * self.drive.lobes * self.drive.eccentrics + on.lobe
        return PairColumns(number, self._block, np.array(counted).reshape(len(counted), len(number)))

    def _response(self, name: str) -> Array:
        """Responses (k,), N.m, of the elements on the profile, times the share of the part in its block, of the table
        of a name."""
        if name not in self._found:
            near, terms = self._at_edges
            self._found[name] = self._inside[name]
            if name in terms:
                self._found[name][near] = terms[name]
        return self._found[name]

    @cached_property
    def _found(self) -> dict[str, Array]:
        """The responses that were asked for."""
        return {}

    @cached_property
    def _inside(self) -> ResponsesAt:
        """The responses, times the share of the part that the elements spend on the profile."""
        on = self._elements
        return self.parts.at(on.part, on.position, inside_profile(self.drive, self.motion, on.part, on.position))

    @cached_property
    def _at_edges(self) -> tuple[NDArray[np.intp], dict[str, Array]]:
        """Numbers of the elements that are on the profile or not by the deviations of their places, and their terms,
        N.m, by name."""
        on, ahead, edge = self._elements, self._ahead, self.drive.usable_limit
        margin = NODES.max() * abs(ahead) + self.motion.reach[on.part]
        near = np.flatnonzero(np.abs(np.abs(on.position) - edge) < margin)
        part, position = on.part[near], on.position[near]
        free = self.parts.at(part, position)
        inside = np.stack([inside_profile(self.drive, self.motion, part, position + x * ahead) for x in NODES])
        found: dict[str, Array] = {}
        for p in range(MAX_ORDER + 1):
            orders = range(MAX_ORDER + 1 - p)
            polynomials = np.stack([hermite(q, NODES) for q in orders])
            at_nodes = polynomials.T @ np.stack([free[term(p, q)] for q in orders])
            projected = (polynomials * NODE_WEIGHTS) @ (inside * at_nodes)
            found |= {term(p, q): projected[q] for q in orders}
        return near, found

    @property
    def _by_eccentric(self) -> bool:
        """Whether all elements of an eccentric share the deviation of its crank."""
        return self.drive.crank_deviation == "eccentric"

    def _of_elements(self, orders: tuple[int, int]) -> float:
        """Share of what moves with an element in the variance of a term."""
        shares = self.responses.shares
        own = shares["element"] + (0.0 if self._by_eccentric else shares["crank"])
        return own ** orders[0] * shares["bore"] ** orders[1]

    def _of_lobes(self, orders: tuple[int, int]) -> float:
        """That of the lobes."""
        shares = self.responses.shares
        return (shares["gear"] + shares["place"]) ** orders[0] * (1 - shares["bore"]) ** orders[1]

    def _of_cranks(self, orders: tuple[int, int]) -> float:
        """That of a crank whose deviation all elements of an eccentric share."""
        return self.responses.shares["crank"] ** orders[0] if self._by_eccentric and not orders[1] else 0.0

    def _counts(self, share: float, values: Array) -> bool:
        """Whether a share of a term, values (k,), N.m, is large enough for columns."""
        return share * _square(values) > MIN_SHARE * self._linear_variance

    @cached_property
    def _linear_variance(self) -> float:
        return _square(self._response(term(1, 0)))

    def _shift_by_places(self) -> Array:
        """(1, n) N.m, by which deviations of places shift the mean of all individuals, since the torque bends with the
        twist, the position and the clearance. How large they are is not known, so that it is a random effect."""
        return self._by_block(self._response(term(0, 0)) - self._response("mean"))[None]

    @cached_property
    def _by_element(self) -> _Sums:
        return self._by(self._elements.element)

    @cached_property
    def _by_lobe(self) -> _Sums:
        return self._by(self._elements.lobe)

    @cached_property
    def _by_crank(self) -> _Sums:
        return self._by(self._elements.element % self.drive.eccentrics)

    def _by(self, number: NDArray[np.intp]) -> _Sums:
        """Sums over the elements on the profile that share a number (k,); numbers without any have no row."""
        met, blocks = np.bincount(number) > 0, len(self.motion.first)
        row = np.cumsum(met) - 1
        return _Sums(row[number] * blocks + self._block, int(met.sum()), blocks)

    def _by_block(self, values: Array) -> Array:
        return np.asarray(np.bincount(self._block, values, len(self.motion.first)), float)

    @cached_property
    def _block(self) -> NDArray[np.intp]:
        """(k,), number of the block of every element on the profile."""
        return self.motion.block[self._elements.part]

    @property
    def _ahead(self) -> float:
        """rad, by which one standard deviation of places moves an element along the profile."""
        return (self.drive.ratio - 1) * self.responses.places.along

    @cached_property
    def _elements(self) -> ElementsOnProfile:
        """The elements that are on the profile, or would be with a place beside their own."""
        return elements_on_profile(self.drive, self.motion, self.start, NODES.max() * abs(self._ahead))


@dataclass(frozen=True)
class _Sums:
    """place: (k,), row and block of every element on the profile, counted on from row to row."""

    place: NDArray[np.intp]
    rows: int
    blocks: int

    def sums(self, values: Array) -> Array:
        """(rows, blocks) sums of values (k,)."""
        found = np.bincount(self.place, values, self.rows * self.blocks)
        return np.asarray(found, float).reshape(self.rows, self.blocks)


def _square(values: Array) -> float:
    return float(values @ values)


def average_torque(
    drive: Drive, responses: ElementResponses, motion: ElementMotion, twist: Array, clearance: Array
) -> Array:
    """(2, n) N.m, torque of elements without deviations, averaged over all positions, at clearances (p,), m, of the
    parts: in total, and by their position over the usable limit. The first is the base curve."""
    nodes = responses.position / drive.usable_limit
    twist, density = motion.twist_from(twist), drive.elements / (2 * np.pi)
    level, values = clearance_levels(responses, clearance)
    average = np.zeros((2, len(twist)))
    for number, table in enumerate(responses.at_clearances(values)["mean"]):
        some = np.flatnonzero(level == number)
        for k in (0, 1):
            curve = np.trapezoid(table * nodes**k, responses.position, axis=1)
            average[k, some] = density * np.interp(twist[some], responses.twist, curve)
    return np.stack([motion.mean(of_parts) for of_parts in average])
