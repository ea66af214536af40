"""Torque of the elements on the profile along a record, and what deviations of single parts add to it, for one seating.

Every ball and bore keeps its deviation while it moves past the crank; the deviations of the lobes stay in the gear, so
that an element meets another lobe with every turn. Each deviation is one random effect, and its column is what one
standard deviation does to every block of the record. Bores and lobes deviate in size and in place; a bore or a lobe
beside its place twists its element and moves it along the profile. At the edges of the usable profile elements enter
and leave in steps, about which the base curve is the average.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array

from .element_motion import ElementMotion, ElementsOnProfile, elements_on_profile, inside_profile
from .responses import ElementResponses
from .seating import Seating

CLEARANCE_BIN = 0.3
"""Range of clearances, in standard deviations of single elements, that share one interpolation of the tables. Chosen by
judgement, half the step of the tables."""
MIN_BORE_SHARE = 0.002
"""Least variance from the bores, over the variance from the clearances, for the bores to have columns. Chosen by
judgement."""
PLACES = 1.0
"""Deviation of the places of bores and lobes over that of their sizes, which drawings state alone: as wide. Among 0.25,
0.5 and 1 it is the likeliest on simulated individuals whose places deviate half as widely; a covariance that lacks
places takes them for kinematic errors."""


@dataclass(frozen=True)
class SeatedElements:
    """The elements of a drive with one seating along a record, where the contacts have the twist (n,), rad, by block,
    and each of the p parts of the motion has a clearance (p,), m."""

    drive: Drive
    responses: ElementResponses
    motion: ElementMotion
    twist: Array
    clearance: Array
    seating: Seating

    def columns(self, average: Array) -> Array:
        """(m, n) N.m, of one standard deviation of each random effect; average: (2, n) N.m, of `average_torque`."""
        responses = self._responses()
        parts = [
            *self._element_columns(responses),
            *self._lobe_columns(responses),
            self._shift_by_places(responses),
            self._by_position(responses["mean"]) - average,
            self._by_position(responses["displaced"]),
        ]
        columns = np.concatenate(parts)
        return columns[columns.any(axis=1)]

    def _responses(self) -> dict[str, Array]:
        """Responses (k,), N.m, of the elements on the profile, times the share of the part in its block, by name: those
        of the tables, and those to one standard deviation of the place of an element's bore. It then stands elsewhere
        on the profile, as if the output had turned on, but the crank has not.

        displaced, displaced_twice: of the torque `mean`, in the deviation and in its square; linear_displaced: of its
        response to a clearance.
        """
        level, values = clearance_levels(self.responses, self.clearance)
        tables = self.responses.at_clearances(values)
        here = self._interpolate(level, 0.0, tables)
        moved = {name: tables[name] for name in ("mean", "linear")}
        at, behind = (self._interpolate(level, sign * self._ahead, moved) for sign in (1.0, -1.0))
        return here | {
            "displaced": (at["mean"] - behind["mean"]) / 2,
            "displaced_twice": (at["mean"] + behind["mean"]) / 2 - here["mean"],
            "linear_displaced": (at["linear"] - behind["linear"]) / 2,
        }

    def _interpolate(self, level: NDArray[np.intp], ahead: float, tables: dict[str, Array]) -> dict[str, Array]:
        """Responses (k,), N.m, by the names of their tables (c, twists, positions), of elements that stand `ahead`,
        rad, of their positions, times the share of the part in its block; level: (p,), number of the table."""
        on, motion = self._elements, self.motion
        beta = on.position + ahead
        weight = inside_profile(self.drive, motion, on.part, beta) * motion.weight[on.part]
        twist = motion.twist_from(self.twist)[on.part]
        nodes = np.stack(list(tables.values()), axis=-1)
        found = self.responses.interpolate(nodes, level[on.part], twist, beta, weight)
        return dict(zip(tables, found, strict=True))

    def _element_columns(self, responses: dict[str, Array]) -> list[Array]:
        """Columns of the deviations that move with the elements, and of the eccentrics.

        An element's products with the lobes that it meets are random effects of their own, one for each pair; those of
        the second order stand for them, one for each element.
        """
        drive, shares, by_element = self.drive, self.responses.shares, self._by_element
        linear = by_element(responses["linear"])
        second = [by_element(v) for v in self._second_order(responses)]
        bore = [by_element(responses["displaced"] - place_deviations(drive)[1] * responses["slope"])]
        of_bores = by_element(responses["bore"])
        if (of_bores**2).sum() > MIN_BORE_SHARE * (linear**2).sum():
            bore.append(of_bores)
        if drive.crank_deviation == "eccentric":
            rows, share = np.arange(drive.elements) % drive.eccentrics, shares["crank"]
            # All elements of an eccentric share its deviation, so that the nonlinear responses do not average out.
            shared = (
                share**0.5 * linear,
                share * by_element(responses["quadratic"]),
                share**1.5 * by_element(responses["cubic"]),
            )
            return [
                *bore,
                *second,
                shares["element"] ** 0.5 * linear,
                *(np.stack([v[rows == k].sum(axis=0) for k in range(drive.eccentrics)]) for v in shared),
            ]
        return [*bore, *second, (shares["element"] + shares["crank"]) ** 0.5 * linear]

    def _lobe_columns(self, responses: dict[str, Array]) -> list[Array]:
        """Columns of the lobes' deviations in distance and along the circle, to the second order."""
        _, angle = place_deviations(self.drive)
        return [
            self._by_lobe(v)
            for v in (
                self._outwards * responses["linear"],
                (1 - 1 / self.drive.ratio) * angle * responses["slope"] - responses["displaced"],
                self._outwards * responses["linear_displaced"],
                *self._second_order(responses),
            )
        ]

    @property
    def _outwards(self) -> float:
        """Standard deviation of a lobe in distance, by its size and its place, over that of an element's clearance."""
        place, _ = place_deviations(self.drive)
        return (self.responses.shares["gear"] + (place / self.responses.deviation) ** 2) ** 0.5

    def _second_order(self, responses: dict[str, Array]) -> tuple[Array, Array]:
        """Responses (k,), N.m, to the squares of a lobe's deviations in distance and along the circle, less
        their means, over their standard deviations."""
        return self._outwards**2 * responses["quadratic"], np.sqrt(2) * responses["displaced_twice"]

    def _shift_by_places(self, responses: dict[str, Array]) -> Array:
        """(1, n) N.m, by which deviations of places shift the mean of all individuals, since the torque bends with the
        twist, the position and the clearance. How large they are is not known, so that it is a random effect."""
        place, angle = place_deviations(self.drive)
        outwards = place / self.responses.deviation
        shift = outwards**2 / np.sqrt(2) * responses["quadratic"] + angle**2 * responses["bend"]
        return self._by_block(shift + 2 * responses["displaced_twice"])[None]

    def _by_position(self, torque: Array) -> Array:
        """(2, n) N.m, sums over the elements of their torque (k,), and of its product with their position over the
        usable limit: the steps at both edges of the profile, of which the base curve is the average, are not known
        exactly, nor is the first element's position."""
        share = self._elements.position / self.drive.usable_limit
        return np.stack([self._by_block(torque), self._by_block(torque * share)])

    def _by_element(self, values: Array) -> Array:
        return self._sums(self._elements.element, self.drive.elements, values)

    def _by_lobe(self, values: Array) -> Array:
        return self._sums(self._elements.lobe, self.drive.lobes * self.drive.eccentrics, values)

    def _by_block(self, values: Array) -> Array:
        return np.asarray(np.bincount(self.motion.block[self._elements.part], values, len(self.twist)), float)

    def _sums(self, number: NDArray[np.intp], count: int, values: Array) -> Array:
        """(count, n) sums over the blocks of values (k,) of the elements on the profile that have each of `count`
        numbers."""
        n = len(self.twist)
        place = number * n + self.motion.block[self._elements.part]
        return np.asarray(np.bincount(place, values, count * n), float).reshape(count, n)

    @property
    def _ahead(self) -> float:
        """rad, by which one standard deviation of the place of its bore moves an element along the profile."""
        return (self.drive.ratio - 1) * place_deviations(self.drive)[1]

    @cached_property
    def _elements(self) -> ElementsOnProfile:
        """The elements on the profile."""
        return elements_on_profile(self.drive, self.motion, self.seating, abs(self._ahead))


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


def clearance_levels(responses: ElementResponses, clearance: Array) -> tuple[NDArray[np.intp], Array]:
    """The number (p,) of the group of nearly the same clearance, m, of each part, and the mean clearance (c,), m, of
    each group."""
    step = max(CLEARANCE_BIN * responses.deviation, 1e-12)
    _, level = np.unique(np.round(clearance / step), return_inverse=True)
    return level, np.bincount(level, clearance) / np.bincount(level)


def place_deviations(drive: Drive, places: float = PLACES) -> tuple[float, float]:
    """Standard deviation of the places of bores and lobes, m, and the twist of an element by it, rad."""
    place = places * max(drive.tolerances["cage"].sigma, drive.tolerances["gear"].sigma)
    return place, place / (drive.crank_radius + drive.element_radius)
