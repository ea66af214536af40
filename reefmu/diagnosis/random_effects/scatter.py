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
from collections.abc import Sequence
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
from .responses import MAX_ORDER, ElementResponses
from .tolerance_scatter import ClearanceSlope, Spread, in_turn

N_STARTS = 12
"""Positions of the first element over which the covariance is averaged. Chosen by the likelihood of 58 records of
individuals: with 24 their -2 log likelihood is 6 less in the mean, and at most 40, with 8 it is up to 80 more."""
TERMS_EVERY, PAIRS_EVERY = (1, 2, 3), 6
"""One of so many positions stands for the terms of the first three orders, and for the products of elements and lobes:
the smaller, the fewer; further orders do not count in an average. Chosen by the likelihood of individuals, which all
positions for these orders change by less than 3 in 29 of 31 records and by 22 in one, and twice as many for the
products by less than 1."""
START_DEVIATION = 0.03
"""Standard deviation, over the distance of the elements, of a position of the first one that a record shows. Chosen
among 0, 0.015, 0.03 and 0.045 by the likelihood of 22 individuals
(`tests/benchmarks/scatter/bench_first_element.py`): -2 log likelihood is 48 less in the mean than with 0."""
NEAR_ORDERS = 2
"""Greatest order of the terms at positions that are compared, and at those beside the likeliest, where products of
elements and lobes do not count either. Chosen by the likelihood of 17 individuals, which all terms beside the likeliest
change by less than 5 in twice the time; of 19, all terms find another position in four, as likely in three."""
_GAUSS = np.asarray(np.polynomial.hermite_e.hermegauss(3), float)
START_NODES, START_WEIGHTS = _GAUSS[0], _GAUSS[1] / _GAUSS[1].sum()
N_JOBS = 2
"""Parts of the positions that processes share; chosen by judgement, few because the sum of each is sent as a whole."""
NEIGHBOURS = 128
"""Neighbouring blocks of a covariance that are worked on at once; 64 to 200 take the same time."""


@dataclass(frozen=True)
class Scatter:
    """The scatter along one record; motion: of the elements where the contacts have the twist (n,), rad, of a first
    estimate, by block; by_clearance: of the base curve, which gives what the mean clearance does, None for that of the
    columns; starts: number of positions of the first element that are averaged over; start: rad, its
    position at crank angle 0 where the record shows it, None where it does not; start_deviation: standard deviation of
    that position, over the distance of the elements; orders: greatest order of the terms at that position, beside fewer
    than all without products of elements and lobes; time_constant: s, of the filter of all channels before which the
    motion is."""

    drive: Drive
    responses: ElementResponses
    motion: ElementMotion
    twist: Array
    by_clearance: ClearanceSlope | None = None
    starts: int = N_STARTS
    start: float | None = None
    start_deviation: float = START_DEVIATION
    orders: int = MAX_ORDER
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
        starts, anywhere = _starts(self), self.start is None
        about = None if anywhere else average
        jobs = [_SomeStarts(at, starts[k::N_JOBS], about) for k in range(min(N_JOBS, len(starts)))]
        found = reduce(operator.iadd, spread(_products, jobs))
        if self.by_clearance is not None:
            slope = self.motion.mean(self.by_clearance(self.motion.twist_from(twist), at.clearance))
            add_products(found, slope[None], self.mean_clearance_deviation**2)
        if anywhere:
            add_products(found, profile_steps(self.drive, at.responses, self.motion, average), 1.0)
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
class _WeightedStart:
    """start: rad, a position of the first element; share: of the covariance; factors: of the terms, as in
    `SeatedElements.columns`; of_pairs: of the products of elements and lobes, over the share."""

    start: float
    share: float
    factors: tuple[float, ...]
    of_pairs: float


def _starts(scatter: Scatter) -> list[_WeightedStart]:
    """The positions of the first element that a covariance is averaged over."""
    if scatter.start is None:
        count = scatter.starts
        anywhere = enumerate(spread_starts(scatter.drive, count))
        of_terms = [[_times(k, every, count) for every in TERMS_EVERY] for k in range(count)]
        pairs = [_times(k, PAIRS_EVERY, count) for k in range(count)]
        return [_WeightedStart(at, 1 / count, tuple(x**0.5 for x in of_terms[k]), pairs[k]) for k, at in anywhere]
    distance, orders = 2 * np.pi / scatter.drive.elements, scatter.orders
    itself = _WeightedStart(scatter.start, 1.0, (1.0,) * orders, float(orders == MAX_ORDER))
    if not scatter.start_deviation:
        return [itself]
    near = (scatter.start + scatter.start_deviation * distance * START_NODES).tolist()
    few, further = (1.0,) * NEAR_ORDERS, START_WEIGHTS[1] ** -0.5
    # What the positions beside it lack, the likeliest one counts for all.
    terms = itself.factors[:NEAR_ORDERS] + tuple(further * factor for factor in itself.factors[NEAR_ORDERS:])
    middle = replace(itself, share=START_WEIGHTS[1], factors=terms, of_pairs=itself.of_pairs / START_WEIGHTS[1])
    before, after = (_WeightedStart(near[k], START_WEIGHTS[k], few, 0.0) for k in (0, 2))
    return [before, middle, after]


def _times(number: int, every: int, count: int) -> float:
    """How many of so many starts one of them, by number, stands for, where one of so many does; 0 where it does not."""
    return 0.0 if number % every else count / -(-count // every)


@dataclass(frozen=True)
class _SomeStarts:
    """average: (2, n) N.m, of `average_torque`, about which elements enter and leave the profile in steps, None where
    these are averaged over further positions."""

    at: _Contacts
    starts: Sequence[_WeightedStart]
    average: Array | None


def _products(what: _SomeStarts) -> Array:
    """(n, n) (N.m)^2, lower triangle of what some starts contribute to the covariance."""
    of, count = what.at.scatter, len(what.at.scatter.twist)
    found = np.zeros((count, count), order="F")
    of_mean = 0.0 if of.by_clearance is None else (of.mean_clearance_deviation / of.clearance_deviation) ** 2
    for one in what.starts:
        elements = SeatedElements(of.drive, of.responses, of.motion, what.at.responses, one.start)
        add_products(found, elements.columns(one.factors), one.share)
        add_products(found, elements.together[None], -one.share * of_mean)
        if what.average is not None:
            add_products(found, elements.steps(what.average), one.share)
        if one.of_pairs:
            add_products_of_pairs(found, elements.of_pairs(), one.share * one.of_pairs)
    return found


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
