"""Tolerance scatter along a record: the covariance by which individual drives' torque differs from the mean drive's.

Where the first element stands no drawing says. A record may show it, where the elements move as they are taken to: the
covariance is then that of individuals with that element there. Elsewhere a position that is taken to be known and is
not quite right would explain an individual worse than none, and leave to effects what is not theirs. The covariance is
then that of all individuals, averaged over all positions: how alike the torque is at two instants depends on how far
the elements have moved between them, and on which lobes they then face.
"""

from __future__ import annotations

import itertools
import operator
from dataclasses import dataclass, replace
from functools import cached_property, reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import get_blas_funcs

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array

from .curve_columns import common_deviations
from .element_columns import PairColumns, SeatedElements, average_torque
from .element_motion import ElementMotion, spread_starts
from .part_responses import PartResponses, part_responses
from .profile_steps import profile_steps
from .responses import ElementResponses
from .tolerance_scatter import Spread, in_turn

N_STARTS = 12
"""Positions of the first element over which the covariance is averaged. Chosen by the likelihood of 58 records of
individuals: with 24 their -2 log likelihood is 6 less in the mean, and at most 40, with 8 it is up to 80 more."""
TERMS_EVERY, PAIRS_EVERY = (1, 2, 3), 6
"""One of so many positions stands for the terms of the first three orders, and for the products of elements and lobes:
the smaller, the fewer; further orders do not count in an average. Chosen by the likelihood of individuals, which all
positions for these orders change by less than 3 in 29 of 31 records and by 22 in one, and twice as many for the
products by less than 1."""
N_JOBS = 2
"""Parts of the positions that processes share; chosen by judgement, few because the sum of each is sent as a whole."""
NEIGHBOURS = 128
"""Neighbouring blocks of a covariance that are worked on at once; 64 to 200 take the same time."""


@dataclass(frozen=True)
class Scatter:
    """The scatter along one record; motion: of the elements where the contacts have the twist (n,), rad, of a first
    estimate, by block; starts: number of positions of the first element that are averaged over; start: rad, its
    position at crank angle 0 where the record shows it, None where it does not; time_constant: s, of the filter of all
    channels before which the motion is."""

    drive: Drive
    responses: ElementResponses
    motion: ElementMotion
    twist: Array
    starts: int = N_STARTS
    start: float | None = None
    time_constant: float = 0.0

    def covariance_at(
        self, twist: Array, clearance: Array | float = 0.0, beside: Array | None = None, spread: Spread = in_turn
    ) -> Array:
        """See `ToleranceScatter`."""
        found, torque = self.covariance_of_parts(twist, clearance, beside, spread)
        common = common_deviations(torque, found)
        return found + common.T @ common

    def covariance_of_parts(
        self, twist: Array, clearance: Array | float = 0.0, beside: Array | None = None, spread: Spread = in_turn
    ) -> tuple[Array, Array]:
        """The covariance (n, n), (N.m)^2, of individuals whose parts deviate by themselves, without what all elements
        of a drive share, and the torque (n,), N.m, of the base curve; parameters as of `covariance_at`."""
        if twist is not self.twist:
            return self._moved(twist, beside).covariance_of_parts(twist, clearance, spread=spread)
        at = _Contacts(self, np.broadcast_to(np.asarray(clearance, float), twist.shape)[self.motion.block])
        average = average_torque(self.drive, self.responses, self.motion, twist, at.clearance)
        found = _over_starts(at, average, spread) if self.start is None else _at_start(at, average, self.start)
        mirror_lower_triangle(found)
        return found, average[0]

    def _moved(self, twist: Array, beside: Array | None) -> Scatter:
        """The scatter with the elements where the contacts have another twist (n,), rad: what effects add to the twist
        between the contacts and the sensors moves no element along the profile. Nor does another zero of the twist:
        wherever it is, the position of the first element is that which the record shows."""
        motion, other = self.motion, self.twist - twist
        within = 0.0 if beside is None else motion.beside_mean(beside)
        ahead = (self.drive.ratio - 1) * ((other - other.mean())[motion.block] - within)
        motion = replace(motion, rotation=motion.rotation + ahead, twist=motion.twist + within)
        return replace(self, motion=motion, twist=twist)

    @property
    def clearance_deviation(self) -> float:
        """m, standard deviation of a single element's clearance."""
        return self.responses.deviation

    @property
    def mean_clearance_deviation(self) -> float:
        """m, standard deviation of the mean over all elements of a drive, some of which may share a crank."""
        drive, crank = self.drive, self.responses.shares["crank"]
        cranks = drive.eccentrics if drive.crank_deviation == "eccentric" else drive.elements
        return self.responses.deviation * float(np.sqrt((1 - crank) / drive.elements + crank / cranks))


@dataclass(frozen=True)
class _Contacts:
    """scatter: at the twist of the contacts; clearance: (p,) m, of the parts of the motion."""

    scatter: Scatter
    clearance: Array

    @cached_property
    def responses(self) -> PartResponses:
        """The responses of an element in these contacts."""
        of = self.scatter
        return part_responses(of.responses, of.motion, of.twist, self.clearance)

    def __getstate__(self) -> dict[str, Any]:
        """The fields alone: another process computes the responses in less time than it takes to send them."""
        return {"scatter": self.scatter, "clearance": self.clearance}


@dataclass(frozen=True)
class _SomeStarts:
    """numbers: of some starts."""

    at: _Contacts
    numbers: NDArray[np.intp]


def _over_starts(at: _Contacts, average: Array, spread: Spread) -> Array:
    """(n, n) (N.m)^2, lower triangle of the covariance of parts, averaged over positions of the first element; average:
    (2, n) N.m, of `average_torque`."""
    of = at.scatter
    numbers = np.array_split(np.arange(of.starts), N_JOBS)
    found = reduce(operator.iadd, spread(_products, [_SomeStarts(at, some) for some in numbers]))
    add_products(found, profile_steps(of.drive, at.responses, of.motion, average), 1.0)
    return found


def _at_start(at: _Contacts, average: Array, start: float) -> Array:
    """The same for one position of the first element, rad."""
    of, count = at.scatter, len(at.scatter.twist)
    elements = SeatedElements(of.drive, of.responses, of.motion, at.responses, start)
    found = np.zeros((count, count), order="F")
    add_products(found, np.concatenate([elements.columns(), elements.steps(average)]), 1.0)
    add_products_of_pairs(found, elements.of_pairs(), 1.0)
    return found


def _products(what: _SomeStarts) -> Array:
    """(n, n) (N.m)^2, lower triangle of what some starts contribute to the covariance."""
    of, count, of_starts = what.at.scatter, len(what.at.scatter.twist), what.at.scatter.starts
    found, starts = np.zeros((count, count), order="F"), spread_starts(of.drive, of_starts)
    for number in what.numbers:
        elements = SeatedElements(of.drive, of.responses, of.motion, what.at.responses, starts[number])
        factors = [_share(number, every, of_starts) ** 0.5 for every in TERMS_EVERY]
        add_products(found, elements.columns(factors), 1 / of_starts)
        if of_pairs := _share(number, PAIRS_EVERY, of_starts):
            add_products_of_pairs(found, elements.of_pairs(), of_pairs / of_starts)
    return found


def _share(number: int, every: int, of_starts: int) -> float:
    """How many starts one of them, by number, stands for, where one of so many does; 0 where it does not."""
    return 0.0 if number % every else of_starts / -(-of_starts // every)


def add_products(total: Array, columns: Array, factor: float) -> None:
    """Add the products of columns (m, n), times a factor, to the lower triangle of `total` (n, n), of column order."""
    (add_product,) = get_blas_funcs(("syrk",), (columns,))
    add_product(factor, columns.T, beta=1.0, c=total, lower=1, overwrite_c=1)


def add_products_of_pairs(total: Array, pairs: PairColumns, factor: float) -> None:
    """The same of the columns of pairs, few of which any two blocks share: dense products of neighbouring blocks."""
    ends = np.searchsorted(pairs.block, np.arange(0, len(total) + NEIGHBOURS, NEIGHBOURS))
    place = np.empty(pairs.number.max(initial=-1) + 1, np.intp)
    parts: list[tuple[slice, NDArray[np.intp], Array]] = []
    for k, (start, end) in enumerate(itertools.pairwise(ends)):
        blocks = slice(k * NEIGHBOURS, min((k + 1) * NEIGHBOURS, len(total)))
        number = pairs.number[start:end]
        met = np.flatnonzero(np.bincount(number))
        place[met] = np.arange(len(met))
        size = blocks.stop - blocks.start
        at = place[number] * size + pairs.block[start:end] - blocks.start
        of_terms = [np.bincount(at, values[start:end], len(met) * size) for values in pairs.values]
        parts.append((blocks, met, np.asarray(of_terms, float).reshape(len(of_terms), len(met), size)))
    for k, (here, met, values) in enumerate(parts):
        place[:] = -1
        place[met] = np.arange(len(met))
        for there, others, of_others in parts[k:]:
            same = place[others]
            both = np.flatnonzero(same >= 0)
            if len(both):
                one, other = values[:, same[both]], of_others[:, both]
                total[there, here] += factor * np.tensordot(other, one, ((0, 1), (0, 1)))


def mirror_lower_triangle(total: Array) -> None:
    """Make a matrix (n, n), of which the lower triangle is known, symmetric; by parts, which stay in the cache."""
    for first in range(0, len(total), NEIGHBOURS):
        last = first + NEIGHBOURS
        part = total[first:last, first:last]
        part[:] = np.tril(part) + np.tril(part, -1).T
        total[first:last, last:] = total[last:, first:last].T
