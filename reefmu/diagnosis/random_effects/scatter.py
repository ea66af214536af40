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
from .responses import Responses, cells

NEIGHBOURS = 0.3
"""Clearances this close, in standard deviations of single elements, are taken as one."""
WAVES = 3
"""Harmonics of the elements' passing."""
STANDING = 0.125
"""Turn within a block, over the pitch of the elements, up to which the crank counts as standing."""
PASSING = 0.03
"""Variance, over one element's torque squared, of what the waves leave of the elements' passing."""
BORES = 0.002
"""Variance that stems from the bores, over that from the lobes, from which they have columns of their own."""
REST = 0.05
"""Scatter beyond the columns, over the whole."""
FAST = 2.0
"""Turn, rad, within a block from which on all places of an element count alike."""
WIDEST = 0.3
"""Turn, rad, within a block beyond which its middle stands for it."""
LEAST_BLOCKS = 8
"""Blocks at one angle for a pair of columns of their own."""
ANGLES = 32
"""Standing angles, the most frequent ones, that get columns."""


@dataclass(frozen=True)
class Turning:
    """Where the elements are, by block: turned: (n,) rad, crank past the cage; span: (n,) rad, of it in a block and up
    to it; within: (n,) rad, between the samples of a block;
    waves: (2 WAVES, n) cosine and sine of the elements' passing, mean over the block, 0 where the crank stands;
    row_waves: (2 m, n) likewise of those orders at which only the elements of one eccentric pass, none if it is one;
    count: (n,) samples of a block.
    """

    turned: Array
    span: Array
    within: Array
    waves: Array
    row_waves: Array
    count: Array


def turning(drive: Drive, trace: Trace, blocks: Blocks) -> Turning:
    """From the record's angles."""
    # The paper's elements keep their place while the crank twists: standing is standing.
    way = trace.crank * (1 - 1 / drive.ratio)
    within = np.maximum.reduceat(way, blocks.first) - np.minimum.reduceat(way, blocks.first)
    step = np.abs(np.diff(way, prepend=way[0]))
    step[trace.start] = 0.0
    # A sample is taken at once: only what lies between those of a block is averaged.
    span = within + step[blocks.first]
    moving = span > STANDING * 2 * np.pi / drive.elements
    rows = drive.eccentrics
    waves: list[Array] = []
    row_waves: list[Array] = []
    for harmonic in range(1, WAVES * rows + 1):
        whole = harmonic % rows == 0
        if not whole and drive.crank_deviation != "eccentric":
            continue
        passing = np.exp(1j * harmonic * drive.elements / rows * way)
        # What comes and goes at once has harmonics that fall off as their number.
        number = harmonic / rows if whole else harmonic
        mean = np.add.reduceat(passing, blocks.first) / blocks.count * moving / (np.pi * number)
        (waves if whole else row_waves).extend([mean.real, mean.imag])
    of_rows = np.reshape(row_waves, (-1, len(span)))
    return Turning(blocks.mean(way), span, within, np.array(waves), of_rows, blocks.count)


@dataclass(frozen=True)
class Scatter:
    """The scatter along one record; twist: (n,) rad, a first guess of what the contacts of the blocks feel."""

    drive: Drive
    responses: Responses
    turning: Turning
    twist: Array

    def at(self, twist: Array, clearance: Array | float = 0.0) -> tuple[Array, Array]:
        """Columns (m, n), N.m, each one standard deviation, where the contacts feel these twists, rad, at these
        clearances, m (n,); and the variance (n,), (N.m)^2, that is left beside them: the elements' passing, faster
        than a block, and a little of everything.
        """
        drive = self.drive
        answers, ends = self._answers(twist, np.broadcast_to(np.asarray(clearance, float), twist.shape))
        fast = self.turning.span > FAST
        at_once = (answers["linear"] ** 2).sum(axis=1)
        for answer in answers.values():
            # Over a turn and more all places count alike; what single samples make of it is rough.
            answer[fast] = answer[fast].mean(axis=1, keepdims=True)
        edges = [*self._edges(ends["mean"], self.turning.waves), *self._row_edges(ends["linear"])]
        columns = np.concatenate([*self._own(answers), *self._lobes(answers), *edges])
        columns = columns[np.abs(columns).max(axis=1) > 0]
        # What is left at one angle of the crank is as smooth as the columns, and they span it.
        rough = (0.0 if self.stands else REST**2) * (columns**2).sum(axis=0)
        rough[fast] += (at_once / self.turning.count)[fast]
        moving = self.turning.span > STANDING * 2 * np.pi / drive.elements
        power = (ends["mean"] ** 2 + ends["linear"] ** 2).sum(axis=0)
        rough[moving] += (PASSING * power / self.turning.count)[moving]
        return columns, rough

    @property
    def stands(self) -> bool:
        """Whether the same elements carry all along: then an individual's curve is as smooth as the mean drive's."""
        return float(np.ptp(self.turning.turned)) <= 2 * np.pi / self.drive.elements

    def _answers(self, twist: Array, clearance: Array) -> tuple[dict[str, Array], dict[str, Array]]:
        """Answers at the places of the elements, (n, elements) each, and at both ends of the profile, (2, n)."""
        r = self.responses
        beta, _, inside = self._places
        found = {name: np.zeros(beta.shape) for name in r.tables}
        ends = {name: np.zeros((2, len(twist))) for name in r.tables}
        step = max(NEIGHBOURS * r.deviation, 1e-12)
        level = np.round(clearance / step)
        for value in np.unique(level):
            own = np.flatnonzero(level == value)
            tables = r.near(float(clearance[own].mean()))
            row, f = cells(r.twist, twist[own])
            column, g = cells(r.position, beta[own])
            corner = [(row[:, None] + a) * len(r.position) + column + b for a in (0, 1) for b in (0, 1)]
            f2 = f[:, None]
            weights = [inside[own] * w for w in ((1 - f2) * (1 - g), (1 - f2) * g, f2 * (1 - g), f2 * g)]
            for name, table in tables.items():
                flat = table.ravel()
                found[name][own] = sum(w * flat[c] for w, c in zip(weights, corner, strict=True))
                ends[name][:, own] = ((1 - f2) * table[row][:, [0, -1]] + f2 * table[row + 1][:, [0, -1]]).T
        return found, ends

    def _own(self, answers: dict[str, Array]) -> list[Array]:
        """Columns of what goes with the elements, and of the eccentrics."""
        drive, shares, linear = self.drive, self.responses.shares, answers["linear"]
        bore = [answers["bore"].T] if (answers["bore"] ** 2).sum() > BORES * (linear**2).sum() else []
        if drive.crank_deviation == "eccentric":
            rows, share = np.arange(drive.elements) % drive.eccentrics, shares["crank"]
            # All elements of an eccentric bend the same way: what single ones average out, these do not.
            bent = (share**0.5 * linear, share * answers["quadratic"], share**1.5 * answers["cubic"])
            return [
                *bore,
                shares["element"] ** 0.5 * linear.T,
                *(np.stack([v[:, rows == k].sum(axis=1) for k in range(drive.eccentrics)]) for v in bent),
            ]
        return [*bore, (shares["element"] + shares["crank"]) ** 0.5 * linear.T]

    def _lobes(self, answers: dict[str, Array]) -> list[Array]:
        """Columns of what stays in the gear; what bends is counted here, whoever deviates."""
        n_lobes, n = self.drive.lobes * self.drive.eccentrics, len(self.twist)
        index = (self._places[1] + n_lobes * np.arange(n)[:, None]).ravel()
        return [
            np.bincount(index, v.ravel(), n_lobes * n).astype(float).reshape(n, n_lobes).T
            for v in (self.responses.shares["gear"] ** 0.5 * answers["linear"], answers["quadratic"])
        ]

    @cached_property
    def _places(self) -> tuple[Array, NDArray[np.intp], Array]:
        """Position (n, elements), lobe met (n, elements) and share of the block within the usable profile."""
        return places(self.drive, self.turning, 0.0)

    def _row_edges(self, ends: Array) -> list[Array]:
        """The same for what an eccentric's own deviation makes of all its elements."""
        drive = self.drive
        if drive.crank_deviation != "eccentric":
            return []
        # What the eccentrics make adds up by chance.
        return self._edges((self.responses.shares["crank"] * drive.eccentrics) ** 0.5 * ends, self.turning.row_waves)

    def _edges(self, ends: Array, waves: Array) -> list[Array]:
        """Columns of what comes or goes at either end of the usable profile; ends: (2, n) N.m, one element there."""
        pitch = 2 * np.pi / self.drive.elements
        standing = self.turning.span <= STANDING * pitch
        place = np.round(self.turning.turned / (pitch / 4)).astype(np.int64)
        values, count = np.unique(place[standing], return_counts=True)
        often = np.argsort(-count, kind="stable")[:ANGLES]
        # Uniform between in and out.
        found = [ends * (standing & (place == values[k])) / np.sqrt(12) for k in often if count[k] >= LEAST_BLOCKS]
        return [*found, *(waves * end for end in ends)]


def places(drive: Drive, turning: Turning, start: float) -> tuple[Array, NDArray[np.intp], Array]:
    """Where the elements of a drive stand: position on the profile, rad, lobe met, and share of the block within the
    usable profile, (n, elements) each; start: rad, position of the first element at crank angle 0."""
    n = np.arange(drive.elements)
    way = start + 2 * np.pi * n / len(n) + turning.turned[:, None] + np.pi
    turns = np.floor(way / (2 * np.pi)).astype(np.intp)
    beta = way - 2 * np.pi * turns - np.pi
    rows = drive.eccentrics
    # Crank and cage of a reversing drive turn against each other: the cage moves on to the next lobe.
    lobe = (n // rows - drive.orientation * turns) % drive.lobes * rows + n % rows
    width = np.clip(turning.within, 1e-6, WIDEST)[:, None]
    return beta, lobe, np.clip((drive.usable_limit - np.abs(beta)) / width + 0.5, 0.0, 1.0)
