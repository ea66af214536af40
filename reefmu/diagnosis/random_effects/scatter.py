"""Tolerance scatter along a record: random effects by which an individual drive's torque differs from the mean drive's.

Every ball and bore keeps its deviation while it moves past the crank; the deviations of the lobes stay in the gear, so
that an element meets another lobe with every turn. Each deviation is one random effect, and its column is what one
standard deviation does to every block of the record. Bores and lobes deviate in size and in place; a bore or a lobe
beside its place twists its element and moves it along the profile. The seats of the elements, and where the first one
stands, are those that the record shows (`likeliest_seating`). At the edges of the usable profile elements enter and
leave in steps, about which the base curve is the average.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array

from .curve_columns import curve_columns
from .element_motion import ElementMotion, element_positions, inside_profile
from .responses import ElementResponses, locate_cells
from .seating import Seating, even_seats

CLEARANCE_BIN = 0.3
"""Range of clearances, in standard deviations of single elements, that share one interpolation of the tables. Chosen by
judgement, half the step of the tables."""
MIN_BORE_SHARE = 0.002
"""Least variance from the bores, over the variance from the clearances, for the bores to have columns. Chosen by
judgement."""
ROUGHNESS = (0.0, 0.0125, 0.025, 0.05, 0.1)
"""Standard deviations that the columns may not span, over that of the columns. Which it is, the record shows; the
spacing was chosen by judgement."""
PLACES = 1.0
"""Deviation of the places of bores and lobes over that of their sizes, which drawings state alone: as wide. Among 0.25,
0.5 and 1 it is the likeliest on simulated individuals whose places deviate half as widely; a covariance that lacks
places takes them for kinematic errors."""


@dataclass(frozen=True)
class Scatter:
    """The scatter along one record; motion: of the elements where the contacts have the twist (n,), rad, of a first
    estimate, by block; seating: of the elements, None where the record does not show it."""

    drive: Drive
    responses: ElementResponses
    motion: ElementMotion
    twist: Array
    seating: Seating | None = None

    def columns_at(self, twist: Array, clearance: Array | float = 0.0) -> tuple[Array, Array]:
        """Columns (m, n), N.m, of one standard deviation of each random effect, and the variances (r, n), (N.m)^2, that
        they may not span, by roughness.

        twist: (n,) rad, at the contacts; clearance: (n,) m, beyond the drawn one.
        """
        if twist is not self.twist:
            return self._moved(twist).columns_at(twist, clearance)
        clearance = np.broadcast_to(np.asarray(clearance, float), twist.shape)[self.motion.block]
        twist = self.motion.twist_from(twist)
        responses = self._responses(twist, clearance, self.responses.tables)
        responses |= self._displaced(twist, clearance, responses["mean"])
        average = self._averages(twist, clearance)
        parts = [
            *self._element_columns(responses),
            *self._lobe_columns(responses),
            self._shift_by_places(responses),
            self._passing(responses["mean"], average),
            self._by_position(responses["displaced"]),
        ]
        columns = np.concatenate(parts)
        columns = columns[np.abs(columns).max(axis=1) > 0]
        rest = np.array(ROUGHNESS)[:, None] ** 2 * (columns**2).sum(axis=0)
        return np.concatenate([columns, curve_columns(self.motion.mean(average[0]), columns)]), rest

    def _moved(self, twist: Array) -> Scatter:
        """The scatter with the elements where the contacts have another twist (n,), rad: what effects add to the twist
        between the contacts and the sensors moves no element along the profile."""
        ahead = ((self.drive.ratio - 1) * (self.twist - twist))[self.motion.block]
        return replace(self, motion=replace(self.motion, rotation=self.motion.rotation + ahead), twist=twist)

    @property
    def clearance_deviation(self) -> float:
        """m, standard deviation of a single element's clearance."""
        return self.responses.deviation

    @property
    def crank_stands(self) -> bool:
        """Whether nearly the same elements carry the load throughout, as where the crank is locked: no seat of a row
        takes the place of the next. The curve of an individual is then nearly as smooth as that of the mean drive."""
        return float(np.ptp(self.motion.rotation)) <= 2 * np.pi / self.drive.seats.seats

    def _responses(self, twist: Array, clearance: Array, names: Iterable[str], ahead: float = 0.0) -> dict[str, Array]:
        """Responses (p, elements), N.m, in the parts of the motion by the names of their tables, of elements that
        stand `ahead`, rad, of their positions; twist, clearance: (p,)."""
        r = self.responses
        beta = self._positions[0] + ahead
        inside = inside_profile(self.drive, self.motion, beta)
        found = {name: np.zeros(beta.shape) for name in names}
        for some, tables in self._at_clearances(clearance):
            row, f = locate_cells(r.twist, twist[some])
            column, g = locate_cells(r.position, beta[some])
            corner = [(row[:, None] + a) * len(r.position) + column + b for a in (0, 1) for b in (0, 1)]
            f2 = f[:, None]
            weights = [inside[some] * w for w in ((1 - f2) * (1 - g), (1 - f2) * g, f2 * (1 - g), f2 * g)]
            for name in found:
                flat = tables[name].ravel()
                found[name][some] = sum(w * flat[c] for w, c in zip(weights, corner, strict=True))
        return found

    def _at_clearances(self, clearance: Array) -> Iterator[tuple[NDArray[np.intp], dict[str, Array]]]:
        """The parts of nearly the same clearance, m, and the tables there."""
        r = self.responses
        level = np.round(clearance / max(CLEARANCE_BIN * r.deviation, 1e-12))
        for value in np.unique(level):
            some = np.flatnonzero(level == value)
            yield some, r.at_clearance(float(clearance[some].mean()))

    def _displaced(self, twist: Array, clearance: Array, mean: Array) -> dict[str, Array]:
        """Responses (p, elements), N.m, to one standard deviation of the place of an element's bore: it stands
        elsewhere on the profile, as if the output had turned on, but the crank has not.

        displaced, displaced_twice: of the torque `mean`, in the deviation and in its square; linear_displaced: of its
        response to a clearance.
        """
        _, angle = place_deviations(self.drive)
        ahead, names = (self.drive.ratio - 1) * angle, ("mean", "linear")
        at, behind = (self._responses(twist, clearance, names, sign * ahead) for sign in (1.0, -1.0))
        return {
            "displaced": (at["mean"] - behind["mean"]) / 2,
            "displaced_twice": (at["mean"] + behind["mean"]) / 2 - mean,
            "linear_displaced": (at["linear"] - behind["linear"]) / 2,
        }

    def _element_columns(self, responses: dict[str, Array]) -> list[Array]:
        """Columns of the deviations that move with the elements, and of the eccentrics.

        An element's products with the lobes that it meets are random effects of their own, one for each pair; those of
        the second order stand for them, one for each element.
        """
        drive, shares, mean = self.drive, self.responses.shares, self.motion.mean
        linear = mean(responses["linear"])
        second = [mean(v).T for v in self._second_order(responses)]
        bore = [mean(responses["displaced"] - place_deviations(drive)[1] * responses["slope"]).T]
        if (responses["bore"] ** 2).sum() > MIN_BORE_SHARE * (responses["linear"] ** 2).sum():
            bore.append(mean(responses["bore"]).T)
        if drive.crank_deviation == "eccentric":
            rows, share = np.arange(drive.elements) % drive.eccentrics, shares["crank"]
            # All elements of an eccentric share its deviation, so that the nonlinear responses do not average out.
            shared = (
                share**0.5 * linear,
                share * mean(responses["quadratic"]),
                share**1.5 * mean(responses["cubic"]),
            )
            return [
                *bore,
                *second,
                shares["element"] ** 0.5 * linear.T,
                *(np.stack([v[:, rows == k].sum(axis=1) for k in range(drive.eccentrics)]) for v in shared),
            ]
        return [*bore, *second, (shares["element"] + shares["crank"]) ** 0.5 * linear.T]

    def _lobe_columns(self, responses: dict[str, Array]) -> list[Array]:
        """Columns of the lobes' deviations in distance and along the circle, to the second order."""
        n_lobes, n = self.drive.lobes * self.drive.eccentrics, len(self.twist)
        _, angle = place_deviations(self.drive)
        motion = self.motion
        index = (self._positions[1] + n_lobes * motion.block[:, None]).ravel()
        part = motion.weight[:, None]
        return [
            np.bincount(index, (part * v).ravel(), n_lobes * n).astype(float).reshape(n, n_lobes).T
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
        """Responses (p, elements), N.m, to the squares of a lobe's deviations in distance and along the circle, less
        their means, over their standard deviations."""
        return self._outwards**2 * responses["quadratic"], np.sqrt(2) * responses["displaced_twice"]

    def _shift_by_places(self, responses: dict[str, Array]) -> Array:
        """(1, n) N.m, by which deviations of places shift the mean of all individuals, since the torque bends with the
        twist, the position and the clearance. How large they are is not known, so that it is a random effect."""
        place, angle = place_deviations(self.drive)
        outwards = place / self.responses.deviation
        shift = outwards**2 / np.sqrt(2) * responses["quadratic"] + angle**2 * responses["bend"]
        shift = shift + 2 * responses["displaced_twice"]
        return self.motion.mean(shift.sum(axis=1))[None]

    def _averages(self, twist: Array, clearance: Array) -> Array:
        """(2, p) N.m, torque of elements without deviations in the parts of the motion, averaged over all positions:
        in total, and by their position over the usable limit."""
        r, nodes = self.responses, self.responses.position / self.drive.usable_limit
        density = self.drive.elements / (2 * np.pi)
        average = np.zeros((2, len(twist)))
        for some, tables in self._at_clearances(clearance):
            for k in (0, 1):
                average[k, some] = density * np.interp(
                    twist[some], r.twist, np.trapezoid(tables["mean"] * nodes**k, r.position, axis=1)
                )
        return average

    def _passing(self, mean: Array, average: Array) -> Array:
        """(2, n) N.m, what the elements' passing of the edges of the profile does to the torque: that of elements
        without deviations, (p, elements) N.m, less its average over all positions, (2, p).

        The base curve is that average. How large the steps at both edges are is not known exactly.
        """
        share = self._positions[0] / self.drive.usable_limit
        return np.stack([self.motion.mean((mean * share**k).sum(axis=1) - average[k]) for k in (0, 1)])

    def _by_position(self, displaced: Array) -> Array:
        """(2, n) N.m, by an error of the first element's position, at both edges."""
        share = self._positions[0] / self.drive.usable_limit
        return np.stack([self.motion.mean((displaced * share**k).sum(axis=1)) for k in (0, 1)])

    @cached_property
    def _positions(self) -> tuple[Array, NDArray[np.intp]]:
        """`element_positions` of the record, with the first element at 0 where the seating is unknown."""
        seating = self.seating or Seating(0.0, even_seats(self.drive))
        return element_positions(self.drive, self.motion, seating)


def place_deviations(drive: Drive, places: float = PLACES) -> tuple[float, float]:
    """Standard deviation of the places of bores and lobes, m, and the twist of an element by it, rad."""
    place = places * max(drive.tolerances["cage"].sigma, drive.tolerances["gear"].sigma)
    return place, place / (drive.crank_radius + drive.element_radius)
