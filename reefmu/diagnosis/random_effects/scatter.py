"""Tolerance scatter along a record: how the torque of an individual drive differs from the mean drive's.

Every ball and bore keeps its deviation while it turns past the crank; the lobes' deviations stay in the gear, so
that with every turn an element meets the next lobe. Each deviation is one random column: what one standard
deviation of it does to every block of the record. Where the first element stands at crank angle 0 nobody knows;
the columns hold for any start, but for what happens at the edges of the usable profile, where an element comes or
goes at once: that has columns of its own, one pair for every angle at which the crank stands, and waves of the
element's passing where it turns.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array

from ..preprocessing.trace import Blocks, Trace
from .responses import ElementResponses, locate_cells

CLEARANCE_BIN = 0.3
"""Clearances this close, in standard deviations of single elements, are taken as one."""
N_HARMONICS = 3
"""Harmonics of the elements' passing."""
STANDSTILL = 0.125
"""Turn within a block, over the pitch of the elements, up to which the crank counts as standing."""
PASSING_VARIANCE = 0.03
"""Variance, over one element's torque squared, of what the waves leave of the elements' passing."""
MIN_BORE_SHARE = 0.002
"""Variance that stems from the bores, over that from the lobes, from which they have columns of their own."""
UNMODELLED_SHARE = 0.05
"""Scatter beyond the columns, over the whole."""
FULL_TURN = 2.0
"""Turn, rad, within a block from which on all places of an element count alike."""
MAX_EDGE_WIDTH = 0.3
"""Turn, rad, within a block beyond which its middle stands for it."""
MIN_BLOCKS = 8
"""Blocks at one angle for a pair of columns of their own."""
MAX_ANGLES = 32
"""Standing angles, the most frequent ones, that get columns."""


@dataclass(frozen=True)
class ElementMotion:
    """Where the elements are, by block: turned: (n,) rad, crank past the cage; span: (n,) rad, of it in a block and up
    to it; within: (n,) rad, between the samples of a block;
    waves: (2 N_HARMONICS, n) cosine and sine of the elements' passing, mean over the block, 0 where the crank stands;
    eccentric_waves: (2 m, n) likewise of those orders at which only the elements of one eccentric pass,
    none if it is one;
    count: (n,) samples of a block.
    """

    turned: Array
    span: Array
    within: Array
    waves: Array
    eccentric_waves: Array
    count: Array


def element_motion(drive: Drive, trace: Trace, blocks: Blocks) -> ElementMotion:
    """From the record's angles."""
    # The paper's elements keep their place while the crank twists: standing is standing.
    way = trace.crank * (1 - 1 / drive.ratio)
    within = np.maximum.reduceat(way, blocks.first) - np.minimum.reduceat(way, blocks.first)
    step = np.abs(np.diff(way, prepend=way[0]))
    step[trace.start] = 0.0
    # A sample is taken at once: only what lies between those of a block is averaged.
    span = within + step[blocks.first]
    moving = span > STANDSTILL * 2 * np.pi / drive.elements
    rows = drive.eccentrics
    waves: list[Array] = []
    eccentric_waves: list[Array] = []
    for harmonic in range(1, N_HARMONICS * rows + 1):
        whole = harmonic % rows == 0
        if not whole and drive.crank_deviation != "eccentric":
            continue
        passing = np.exp(1j * harmonic * drive.elements / rows * way)
        # What comes and goes at once has harmonics that fall off as their number.
        number = harmonic / rows if whole else harmonic
        mean = np.add.reduceat(passing, blocks.first) / blocks.count * moving / (np.pi * number)
        (waves if whole else eccentric_waves).extend([mean.real, mean.imag])
    of_rows = np.reshape(eccentric_waves, (-1, len(span)))
    return ElementMotion(blocks.mean(way), span, within, np.array(waves), of_rows, blocks.count)


@dataclass(frozen=True)
class Scatter:
    """The scatter along one record; twist: (n,) rad, a first guess of what the contacts of the blocks feel."""

    drive: Drive
    responses: ElementResponses
    motion: ElementMotion
    twist: Array

    def columns_at(self, twist: Array, clearance: Array | float = 0.0) -> tuple[Array, Array]:
        """Columns (m, n), N.m, each one standard deviation, where the contacts feel these twists, rad, at these
        clearances, m (n,); and the variance (n,), (N.m)^2, that is left beside them: the elements' passing, faster
        than a block, and a little of everything.
        """
        drive = self.drive
        responses, ends = self._responses(twist, np.broadcast_to(np.asarray(clearance, float), twist.shape))
        fast = self.motion.span > FULL_TURN
        at_once = (responses["linear"] ** 2).sum(axis=1)
        for response in responses.values():
            # Over a turn and more all places count alike; what single samples make of it is residual_variance.
            response[fast] = response[fast].mean(axis=1, keepdims=True)
        edges = [*self._edge_columns(ends["mean"], self.motion.waves), *self._eccentric_edge_columns(ends["linear"])]
        columns = np.concatenate([*self._element_columns(responses), *self._lobe_columns(responses), *edges])
        columns = columns[np.abs(columns).max(axis=1) > 0]
        # What is left at one angle of the crank is as smooth as the columns, and they span it.
        residual_variance = (0.0 if self.crank_stands else UNMODELLED_SHARE**2) * (columns**2).sum(axis=0)
        residual_variance[fast] += (at_once / self.motion.count)[fast]
        moving = self.motion.span > STANDSTILL * 2 * np.pi / drive.elements
        power = (ends["mean"] ** 2 + ends["linear"] ** 2).sum(axis=0)
        residual_variance[moving] += (PASSING_VARIANCE * power / self.motion.count)[moving]
        return columns, residual_variance

    @property
    def crank_stands(self) -> bool:
        """Whether the same elements carry all along: then an individual's curve is as smooth as the mean drive's."""
        return float(np.ptp(self.motion.turned)) <= 2 * np.pi / self.drive.elements

    def _responses(self, twist: Array, clearance: Array) -> tuple[dict[str, Array], dict[str, Array]]:
        """Answers at the places of the elements, (n, elements) each, and at both ends of the profile, (2, n)."""
        r = self.responses
        beta, _, inside = self._positions
        found = {name: np.zeros(beta.shape) for name in r.tables}
        ends = {name: np.zeros((2, len(twist))) for name in r.tables}
        step = max(CLEARANCE_BIN * r.deviation, 1e-12)
        level = np.round(clearance / step)
        for value in np.unique(level):
            own = np.flatnonzero(level == value)
            tables = r.at_clearance(float(clearance[own].mean()))
            row, f = locate_cells(r.twist, twist[own])
            column, g = locate_cells(r.position, beta[own])
            corner = [(row[:, None] + a) * len(r.position) + column + b for a in (0, 1) for b in (0, 1)]
            f2 = f[:, None]
            weights = [inside[own] * w for w in ((1 - f2) * (1 - g), (1 - f2) * g, f2 * (1 - g), f2 * g)]
            for name, table in tables.items():
                flat = table.ravel()
                found[name][own] = sum(w * flat[c] for w, c in zip(weights, corner, strict=True))
                ends[name][:, own] = ((1 - f2) * table[row][:, [0, -1]] + f2 * table[row + 1][:, [0, -1]]).T
        return found, ends

    def _element_columns(self, responses: dict[str, Array]) -> list[Array]:
        """Columns of what goes with the elements, and of the eccentrics."""
        drive, shares, linear = self.drive, self.responses.shares, responses["linear"]
        bore = [responses["bore"].T] if (responses["bore"] ** 2).sum() > MIN_BORE_SHARE * (linear**2).sum() else []
        if drive.crank_deviation == "eccentric":
            rows, share = np.arange(drive.elements) % drive.eccentrics, shares["crank"]
            # All elements of an eccentric bend the same way: what single ones average out, these do not.
            bent = (share**0.5 * linear, share * responses["quadratic"], share**1.5 * responses["cubic"])
            return [
                *bore,
                shares["element"] ** 0.5 * linear.T,
                *(np.stack([v[:, rows == k].sum(axis=1) for k in range(drive.eccentrics)]) for v in bent),
            ]
        return [*bore, (shares["element"] + shares["crank"]) ** 0.5 * linear.T]

    def _lobe_columns(self, responses: dict[str, Array]) -> list[Array]:
        """Columns of what stays in the gear; what bends is counted here, whoever deviates."""
        n_lobes, n = self.drive.lobes * self.drive.eccentrics, len(self.twist)
        index = (self._positions[1] + n_lobes * np.arange(n)[:, None]).ravel()
        return [
            np.bincount(index, v.ravel(), n_lobes * n).astype(float).reshape(n, n_lobes).T
            for v in (self.responses.shares["gear"] ** 0.5 * responses["linear"], responses["quadratic"])
        ]

    @cached_property
    def _positions(self) -> tuple[Array, NDArray[np.intp], Array]:
        """Position (n, elements), lobe met (n, elements) and share of the block within the usable profile."""
        return element_positions(self.drive, self.motion, 0.0)

    def _eccentric_edge_columns(self, ends: Array) -> list[Array]:
        """The same for what an eccentric's own deviation makes of all its elements."""
        drive = self.drive
        if drive.crank_deviation != "eccentric":
            return []
        # What the eccentrics make adds up by chance.
        return self._edge_columns(
            (self.responses.shares["crank"] * drive.eccentrics) ** 0.5 * ends, self.motion.eccentric_waves
        )

    def _edge_columns(self, ends: Array, waves: Array) -> list[Array]:
        """Columns of what comes or goes at either end of the usable profile; ends: (2, n) N.m, one element there."""
        pitch = 2 * np.pi / self.drive.elements
        standing = self.motion.span <= STANDSTILL * pitch
        place = np.round(self.motion.turned / (pitch / 4)).astype(np.int64)
        values, count = np.unique(place[standing], return_counts=True)
        often = np.argsort(-count, kind="stable")[:MAX_ANGLES]
        # Uniform between in and out.
        found = [ends * (standing & (place == values[k])) / np.sqrt(12) for k in often if count[k] >= MIN_BLOCKS]
        return [*found, *(waves * end for end in ends)]


def element_positions(drive: Drive, motion: ElementMotion, start: float) -> tuple[Array, NDArray[np.intp], Array]:
    """Where the elements of a drive stand: position on the profile, rad, lobe met, and share of the block within the
    usable profile, (n, elements) each; start: rad, position of the first element at crank angle 0."""
    n = np.arange(drive.elements)
    way = start + 2 * np.pi * n / len(n) + motion.turned[:, None] + np.pi
    turns = np.floor(way / (2 * np.pi)).astype(np.intp)
    beta = way - 2 * np.pi * turns - np.pi
    rows = drive.eccentrics
    # Crank and cage of a reversing drive turn against each other: the cage moves on to the next lobe.
    lobe = (n // rows - drive.orientation * turns) % drive.lobes * rows + n % rows
    width = np.clip(motion.within, 1e-6, MAX_EDGE_WIDTH)[:, None]
    return beta, lobe, np.clip((drive.usable_limit - np.abs(beta)) / width + 0.5, 0.0, 1.0)
