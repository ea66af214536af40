"""Where the first element of an individual stands: its likeliest position, by what single elements do along a record.

Every element keeps its deviations while it moves past the crank, and enters and leaves the profile at its own instants.
A covariance at the right position knows where; one that is averaged over all positions only knows how alike the torque
is at two instants. Beside the right one a missing ball gains twice as much, and effects explain less of what single
elements do. Where elements move otherwise than they are taken to, no position explains the record as well as the
average over all of them, which then remains.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem, make_weights
from ..estimation.residuals import costs_by_size
from ..estimation.score_test import Direction, absorbing_basis, is_of_one_element, score_gains
from ..estimation.weighting import (
    INDIVIDUAL_SIZE,
    SCATTER_SIZES,
    Weighting,
    are_gains_alike,
    weighting_of_covariance,
)
from ..forward.predictor import Contacts
from ..random_effects.element_motion import repeating_elements
from ..random_effects.scatter import N_JOBS, NEAR_ORDERS, Scatter
from ..random_effects.tolerance_scatter import Spread, in_turn

N_POSITIONS = 12
"""Positions over the distance of the elements that are tried first. Chosen by judgement: the likelihood has a maximum
about a tenth of that distance wide."""
HALVINGS = 4
"""Times that the step between positions is halved about the likeliest. Chosen by judgement, down to 1 in 200 of the
distance, by which -2 log likelihood changes by a few units."""
PARTS = N_POSITIONS * 2**HALVINGS
"""Parts of that distance between which positions are compared."""
STRIDE = 3
"""Elements from one that is tried as the first to the next, where a row has free seats. Chosen by judgement: of
individuals with 22 to 27 elements on 29 seats the next but two is still likelier than those farther away."""
EVERY = 3
"""One of so many blocks is looked at. Chosen by judgement: positions a step apart differ by tens to thousands."""
SIZES = tuple(size for size in SCATTER_SIZES if size >= INDIVIDUAL_SIZE)
"""Sizes of the scatter of an individual."""


def may_stand_anywhere(problem: Problem, at: Fit) -> bool:
    """Whether a fit is of an individual whose first element has no position yet."""
    return isinstance(problem.scatter, Scatter) and problem.scatter.start is None and at.weighting.is_individual


def with_first_element(
    problem: Problem, at: Fit, directions: Mapping[str, Sequence[Direction]], spread: Spread = in_turn
) -> Problem:
    """The problem with the first element at its likeliest position, beside a fit and all that it may lack; itself for a
    mean drive, and where an individual with that element anywhere is likelier than one with it at any position, of
    which all are as likely before.

    directions: of the candidates, linearised about the fit; spread: shares the work among processes.
    """
    scatter, contacts = problem.scatter, at.prediction.contacts
    if not isinstance(scatter, Scatter) or not may_stand_anywhere(problem, at):
        return problem
    residual = problem.torque - at.prediction.torque
    values = np.concatenate([residual[:, None], _missing(problem, at, directions)], axis=1)
    beside = problem.predictor(at.names).twist_beside_sensors(at.parameters)
    record = _Record(scatter, contacts, beside, problem.variance, values, problem.base.full_torque)
    start, share = _likeliest_start(record.of_blocks(np.arange(len(residual)) % EVERY == 0), spread)
    there = record.weights(start, spread)
    if _least_cost(there, values) - 2 * np.log(share) >= _least_cost(at.weighting, values):
        return problem
    found = replace(problem, scatter=replace(scatter, start=start), weights=there, weights_cache=[])
    if are_gains_alike(contacts.gain, np.ones(1)) and not found.are_new(contacts, ()):
        return found
    without_effects = make_weights(problem.variance, found.scatter, problem.base.full_torque, spread)
    return replace(found, weights=without_effects, weights_cache=[(contacts, there)])


def _missing(problem: Problem, at: Fit, directions: Mapping[str, Sequence[Direction]]) -> Array:
    """(n, k) N.m, what a fit may lack, to first order: its own parameters, since what is missing has moved them, and
    all candidates; of those that belong to single elements only the variant that gains most, since all of them together
    are the deviations of all elements."""
    basis = absorbing_basis(at.weighting, at.prediction.sensitivities, at.bounds.prior_deviation)
    residual = at.weighting.whiten(problem.torque - at.prediction.torque)
    residual = residual - basis @ (basis.T @ residual)
    found = [at.prediction.sensitivities]
    for name, variants in directions.items():
        if is_of_one_element(find_effect(name)):
            gains = [gain for gain, _ in score_gains(variants, at.weighting, basis, residual)]
            found.append(variants[int(np.argmax(gains))].columns)
        else:
            found += [variant.columns for variant in variants]
    return np.concatenate(found, axis=1)


@dataclass(frozen=True)
class _Record:
    """n blocks of a record. scatter: of them; contacts, beside: of a fit, the latter at all samples, as in
    `ToleranceScatter`; variance: (n,) (N.m)^2; values: (n, 1 + k) N.m, the residual and the columns beside which it is
    explained; full_torque: N.m."""

    scatter: Scatter
    contacts: Contacts
    beside: Array | None
    variance: Array
    values: Array
    full_torque: float

    def of_blocks(self, some: NDArray[np.bool_]) -> _Record:
        """Some of the blocks (n,), along which positions are exact and terms are of the first orders."""
        motion = self.scatter.motion.of_blocks(some)
        scatter = replace(self.scatter, motion=motion, twist=self.scatter.twist[some])
        scatter = replace(scatter, start_deviation=0.0, orders=NEAR_ORDERS)
        contacts = Contacts(*(values[some] for values in self.contacts))
        return replace(self, scatter=scatter, contacts=contacts, variance=self.variance[some], values=self.values[some])

    def cost(self, start: float) -> float:
        """-2 log likelihood of an individual with the first element at a position, rad."""
        return _least_cost(self.weights(start), self.values)

    def weights(self, start: float, spread: Spread = in_turn) -> Weighting:
        """Weights of individuals with the first element at a position, rad."""
        twist, clearance, gain = self.contacts
        covariance = replace(self.scatter, start=start).covariance_at(twist, clearance, self.beside, spread)
        weights = weighting_of_covariance(self.variance, covariance * gain * gain[:, None])
        return weights.with_unknown_forms(self.full_torque)


def _least_cost(weights: Weighting, values: Array) -> float:
    """Least -2 log likelihood of a residual beside free columns, `_Record.values`, over the sizes of the scatter."""
    return min(costs_by_size(weights, values, SIZES))


def _likeliest_start(record: _Record, spread: Spread) -> tuple[float, float]:
    """Likeliest position of the first element, rad, and the share of all positions that is as likely: averaged over
    them, the likelihood is that at the likeliest one times this share."""
    drive, costs = record.scatter.drive, dict[int, float]()
    part = 2 * np.pi / drive.elements / PARTS
    around = range(0, PARTS, PARTS // N_POSITIONS)
    steps = [2**k for k in reversed(range(HALVINGS))]

    def likeliest(*more: int) -> int:
        """That of all positions, by number of parts, that were looked at, after some more."""
        new = [k for k in more if k not in costs]
        costs.update(zip(new, _costs(record, [part * k for k in new], spread), strict=True))
        return min(costs, key=lambda k: costs[k])

    at, reach = likeliest(*around), PARTS
    if (of_row := repeating_elements(drive)) > 1:
        # Between free seats the elements meet other lobes if another one comes first.
        reach, steps = of_row * drive.eccentrics * PARTS, [PARTS, *steps]
        at = likeliest(*(at + k for k in range(0, reach, STRIDE * PARTS)))
        at = likeliest(*(at + k for k in around))
    for step in steps:
        while at != (at := likeliest(at - step, at + step)):
            pass
    return part * at, min(1.0, np.sqrt(4 * np.pi / max(EVERY * _bend(costs, at), 1e-300)) / reach)


def _bend(costs: Mapping[int, float], least: int) -> float:
    """Second derivative of costs by position at the least of them, by those to either side; 0 at an end."""
    starts = sorted(costs)
    k = starts.index(least)
    if k in (0, len(starts) - 1):
        return 0.0
    before, after = (abs((costs[starts[j]] - costs[least]) / (starts[j] - least)) for j in (k - 1, k + 1))
    return 2 * (before + after) / (starts[k + 1] - starts[k - 1])


def _costs(record: _Record, starts: Sequence[float], spread: Spread) -> list[float]:
    """-2 log likelihood of some positions, rad."""
    jobs = [(record, starts[k::N_JOBS]) for k in range(min(N_JOBS, len(starts)))]
    found = list(spread(_costs_of_some, jobs))
    return [found[k % N_JOBS][k // N_JOBS] for k in range(len(starts))]


def _costs_of_some(job: tuple[_Record, Sequence[float]]) -> list[float]:
    record, starts = job
    return [record.cost(start) for start in starts]
