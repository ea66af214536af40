"""Tolerance scatter along a record: random effects by which an individual drive's torque differs from the mean drive's.

Every ball and bore keeps its deviation while it moves past the crank; the deviations of the lobes stay in the gear, so
that an element meets another lobe with every turn. Each deviation is one random effect, and its column is what one
standard deviation does to every block of the record. Bores and lobes deviate in size and in place; a bore or a lobe
beside its place twists its element. The seats of the elements are those that the record shows (`likeliest_seating`).
The position of the first element hardly matters except at the edges of the usable profile, where elements enter and
leave: that has two columns for every angle at which the crank stands, and waves of the elements' passing where it
turns.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array

from .element_motion import ElementMotion, element_positions
from .responses import ElementResponses, locate_cells
from .seating import Seating, even_seats

CLEARANCE_BIN = 0.3
"""Range of clearances, in standard deviations of single elements, that share one interpolation of the tables. Chosen by
judgement, half the step of the tables."""
PASSING_VARIANCE = 0.03
"""Variance of the elements' passing beyond `N_HARMONICS` waves, over the squared torque of one element. Chosen by
judgement, about twice the 0.014 that the harmonics of a step above the third hold."""
MIN_BORE_SHARE = 0.002
"""Least variance from the bores, over the variance from the clearances, for the bores to have columns. Chosen by
judgement."""
ROUGHNESS = (0.0, 0.0125, 0.025, 0.05, 0.1)
"""Standard deviations that the columns may not span while the crank turns, over that of the columns. Which it is, the
record shows; the spacing was chosen by judgement."""
FULL_TURN = 2.0
"""rad, rotation within a block from which all positions of an element count equally. Chosen by judgement: the usable
profile is then crossed within a block."""
MIN_BLOCKS = 8
"""Blocks at one standing angle from which it has columns of its own. Chosen by judgement."""
PLACES = 0.5
"""Deviation of the places of bores and lobes over that of their sizes, which drawings state alone: the middle of the
range from none to as wide. Chosen by judgement; a covariance that lacks places takes them for kinematic errors."""
MAX_ANGLES = 32
"""Standing angles, the most frequent first, that have columns. Chosen by judgement to bound the size of the
covariance."""


@dataclass(frozen=True)
class Scatter:
    """The scatter along one record; twist: (n,) rad, first estimate of the twist at the contacts, by block; seating: of
    the elements, None where the record does not show it."""

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
        drive = self.drive
        responses, ends = self._responses(twist, np.broadcast_to(np.asarray(clearance, float), twist.shape))
        fast = self.motion.span > FULL_TURN
        single = (responses["linear"] ** 2).sum(axis=1)
        for response in responses.values():
            # Fast rotation averages over all positions; single samples still vary about that average.
            response[fast] = response[fast].mean(axis=1, keepdims=True)
        edges = [*self._edge_columns(ends["mean"], self.motion.waves), *self._eccentric_edge_columns(ends["linear"])]
        parts = [*self._element_columns(responses), *self._lobe_columns(responses), self._shift_by_places(responses)]
        columns = np.concatenate([*parts, *edges])
        columns = columns[np.abs(columns).max(axis=1) > 0]
        # While the crank stands the columns span the whole scatter, which is as smooth as they are.
        shares = np.array(ROUGHNESS[:1] if self.crank_stands else ROUGHNESS)
        variance = shares[:, None] ** 2 * (columns**2).sum(axis=0)
        variance[:, fast] += (single / self.motion.count)[fast]
        moving = ~self.motion.is_standing(drive)
        power = (ends["mean"] ** 2 + ends["linear"] ** 2).sum(axis=0)
        variance[:, moving] += (PASSING_VARIANCE * power / self.motion.count)[moving]
        return columns, variance

    @property
    def clearance_deviation(self) -> float:
        """m, standard deviation of a single element's clearance."""
        return self.responses.deviation

    @property
    def crank_stands(self) -> bool:
        """Whether the same elements carry the load throughout: the curve of an individual is then smooth."""
        return float(np.ptp(self.motion.rotation)) <= 2 * np.pi / self.drive.elements

    def _responses(self, twist: Array, clearance: Array) -> tuple[dict[str, Array], dict[str, Array]]:
        """Responses (n, elements), N.m, at the elements' positions and (2, n) at both edges of the profile."""
        r = self.responses
        beta, _, inside = self._positions
        found = {name: np.zeros(beta.shape) for name in r.tables}
        ends = {name: np.zeros((2, len(twist))) for name in r.tables}
        step = max(CLEARANCE_BIN * r.deviation, 1e-12)
        level = np.round(clearance / step)
        for value in np.unique(level):
            blocks = np.flatnonzero(level == value)
            tables = r.at_clearance(float(clearance[blocks].mean()))
            row, f = locate_cells(r.twist, twist[blocks])
            column, g = locate_cells(r.position, beta[blocks])
            corner = [(row[:, None] + a) * len(r.position) + column + b for a in (0, 1) for b in (0, 1)]
            f2 = f[:, None]
            weights = [inside[blocks] * w for w in ((1 - f2) * (1 - g), (1 - f2) * g, f2 * (1 - g), f2 * g)]
            for name, table in tables.items():
                flat = table.ravel()
                found[name][blocks] = sum(w * flat[c] for w, c in zip(weights, corner, strict=True))
                ends[name][:, blocks] = ((1 - f2) * table[row][:, [0, -1]] + f2 * table[row + 1][:, [0, -1]]).T
        return found, ends

    def _element_columns(self, responses: dict[str, Array]) -> list[Array]:
        """Columns of the deviations that move with the elements, and of the eccentrics."""
        drive, shares, linear = self.drive, self.responses.shares, responses["linear"]
        bore = [place_deviations(drive)[1] * responses["slope"].T]
        if (responses["bore"] ** 2).sum() > MIN_BORE_SHARE * (linear**2).sum():
            bore.append(responses["bore"].T)
        if drive.crank_deviation == "eccentric":
            rows, share = np.arange(drive.elements) % drive.eccentrics, shares["crank"]
            # All elements of an eccentric share its deviation, so that the nonlinear responses do not average out.
            shared = (share**0.5 * linear, share * responses["quadratic"], share**1.5 * responses["cubic"])
            return [
                *bore,
                shares["element"] ** 0.5 * linear.T,
                *(np.stack([v[:, rows == k].sum(axis=1) for k in range(drive.eccentrics)]) for v in shared),
            ]
        return [*bore, (shares["element"] + shares["crank"]) ** 0.5 * linear.T]

    def _lobe_columns(self, responses: dict[str, Array]) -> list[Array]:
        """Columns of the lobes' deviations in distance and along the circle, and of the quadratic responses to the
        deviations of all parts."""
        n_lobes, n = self.drive.lobes * self.drive.eccentrics, len(self.twist)
        place, angle = place_deviations(self.drive)
        outwards = (self.responses.shares["gear"] + (place / self.responses.deviation) ** 2) ** 0.5
        index = (self._positions[1] + n_lobes * np.arange(n)[:, None]).ravel()
        return [
            np.bincount(index, v.ravel(), n_lobes * n).astype(float).reshape(n, n_lobes).T
            for v in (outwards * responses["linear"], angle * responses["slope"], responses["quadratic"])
        ]

    def _shift_by_places(self, responses: dict[str, Array]) -> Array:
        """(1, n) N.m, by which deviations of places shift the mean of all individuals, since the torque bends with the
        twist and the clearance. How large they are is not known, so that it is a random effect."""
        place, angle = place_deviations(self.drive)
        outwards = place / self.responses.deviation
        shift = outwards**2 / np.sqrt(2) * responses["quadratic"] + angle**2 * responses["bend"]
        return shift.sum(axis=1)[None]

    @cached_property
    def _positions(self) -> tuple[Array, NDArray[np.intp], Array]:
        """`element_positions` of the record, with the first element at 0 where the seating is unknown."""
        seating = self.seating or Seating(0.0, even_seats(self.drive))
        return element_positions(self.drive, self.motion, seating)

    def _eccentric_edge_columns(self, ends: Array) -> list[Array]:
        """Edge columns of the deviations of the eccentrics, shared by all their elements; ends: (2, n) N.m."""
        drive = self.drive
        if drive.crank_deviation != "eccentric":
            return []
        # The deviations of the eccentrics are independent: their variances add up.
        return self._edge_columns(
            (self.responses.shares["crank"] * drive.eccentrics) ** 0.5 * ends, self.motion.eccentric_waves
        )

    def _edge_columns(self, ends: Array, waves: Array) -> list[Array]:
        """Columns of elements that enter or leave at the edges of the profile; ends: (2, n) N.m, one element there."""
        pitch = 2 * np.pi / self.drive.elements
        standing = self.motion.is_standing(self.drive)
        place = np.round(self.motion.rotation / (pitch / 4)).astype(np.int64)
        values, count = np.unique(place[standing], return_counts=True)
        often = np.argsort(-count, kind="stable")[:MAX_ANGLES]
        # Whether the element is inside is uniformly distributed, with a variance of 1/12.
        found = [ends * (standing & (place == values[k])) / np.sqrt(12) for k in often if count[k] >= MIN_BLOCKS]
        return [*found, *(waves * end for end in ends)]


def place_deviations(drive: Drive, places: float = PLACES) -> tuple[float, float]:
    """Standard deviation of the places of bores and lobes, m, and the twist of an element by it, rad."""
    place = places * max(drive.tolerances["cage"].sigma, drive.tolerances["gear"].sigma)
    return place, place / (drive.crank_radius + drive.element_radius)
