"""The covariance of individuals whose first element stands at a known position, along a short record."""

from __future__ import annotations

import warnings
from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from reefmu.diagnosis.estimation.weighting import weighting_of_covariance
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.forward.elastic import slope_by_clearance
from reefmu.diagnosis.preprocessing.trace import make_blocks, make_trace
from reefmu.diagnosis.random_effects.element_columns import SeatedElements, average_torque
from reefmu.diagnosis.random_effects.element_motion import element_motion, repeating_elements
from reefmu.diagnosis.random_effects.individuals import simulate_individuals
from reefmu.diagnosis.random_effects.part_responses import part_responses
from reefmu.diagnosis.random_effects.profile_steps import profile_steps
from reefmu.diagnosis.random_effects.responses import MAX_ORDER, PLACES, element_responses
from reefmu.diagnosis.random_effects.scatter import NEAR_ORDERS, Scatter
from reefmu.model.contacts.tables import cached_lookup
from stiffness_model import DoesNotFitWarning, Drive, load_drive
from stiffness_model.numerics.arrays import Array
from tests import diagnosis_rig as rig

START = 0.013


@pytest.fixture(scope="module")
def scatter() -> Scatter:
    return scatter_of(rig.drive())


def scatter_of(drive: Drive) -> Scatter:
    """Of individuals whose first element stands at `START`."""
    trace = make_trace(rig.protocol(), drive.ratio)
    blocks = make_blocks(trace, 8)
    motion, twist = element_motion(drive, trace, blocks), blocks.mean(trace.smooth_twist)
    return Scatter(drive, element_responses(drive), motion, twist, start=START, start_deviation=0.0)


def elements_at(scatter: Scatter, start: float) -> tuple[SeatedElements, Array]:
    """The elements for a position of the first one, rad, and the average torque, (2, n) N.m."""
    parts = scatter.responses, scatter.motion, scatter.twist, np.zeros(len(scatter.motion.block))
    seated = SeatedElements(scatter.drive, *parts[:2], part_responses(*parts), start)
    return seated, average_torque(scatter.drive, *parts)


def whitened_squares(scatter: Scatter, drives: Array) -> float:
    """Mean of the squares of individuals (m, n), N.m, with a little noise, whitened by a covariance."""
    covariance = scatter.covariance_at(scatter.twist)
    noise = 1e-3 * float(covariance.diagonal().mean())
    noisy = drives + np.sqrt(noise) * np.random.default_rng(0).standard_normal(drives.shape)
    weights = weighting_of_covariance(np.full(len(covariance), noise), covariance)
    return float(np.mean(weights.whiten(noisy.T) ** 2))


def test_it_is_that_of_individuals_that_stand_there_and_of_no_others(scatter: Scatter) -> None:
    """Squares are 1.02 there, 1.03, 1.2 and 3.6 a hundredth, three and ten hundredths of the elements' distance beside
    it, and 1.00 everywhere under the average."""
    distance = 2 * np.pi / scatter.drive.elements
    there, beside = (
        simulate_individuals(replace(scatter, start=start), 24, seed=3, places=(PLACES, PLACES))
        for start in (START, START + 0.1 * distance)
    )
    assert whitened_squares(scatter, there) == pytest.approx(1.0, abs=0.05)
    assert whitened_squares(scatter, beside) > 2
    averaged = replace(scatter, start=None)
    assert whitened_squares(averaged, beside) == pytest.approx(whitened_squares(averaged, there), abs=0.1)


@pytest.mark.parametrize("start", [START, None])
def test_no_record_tells_a_clearance_from_the_mean_of_an_individual(scatter: Scatter, start: float | None) -> None:
    """However small the noise, a clearance is known no better than the mean one of individuals deviates; by the columns
    of single elements it would be known twice as well at least."""
    slope = partial(slope_by_clearance, drawing_base(scatter.drive, cached_lookup(scatter.drive)).elastic)
    of_parts = scatter.motion.twist_from(scatter.twist)
    by_clearance = scatter.motion.mean(slope(of_parts, np.zeros_like(of_parts)))

    def error(scatter: Scatter) -> float:
        covariance = scatter.covariance_at(scatter.twist)
        weights = weighting_of_covariance(np.full(len(covariance), 1e-4), covariance)
        return float(1 / np.linalg.norm(weights.whiten(by_clearance)) / scatter.mean_clearance_deviation)

    anywhere = replace(scatter, start=start)
    assert 0.99 < error(replace(anywhere, by_clearance=slope)) < 1.5
    assert error(anywhere) < 0.5


def test_steps_at_all_positions_average_to_those_of_any(scatter: Scatter) -> None:
    distance, (seated, average) = 2 * np.pi / scatter.drive.elements, elements_at(scatter, START)
    of_starts = [replace(seated, start=distance * (k + 0.5) / 48).steps(average) for k in range(48)]
    found = np.mean([steps.T @ steps for steps in of_starts], axis=0)
    steps = profile_steps(scatter.drive, seated.parts, scatter.motion, average)
    expected = steps.T @ steps
    assert np.abs(found - expected).max() < 0.03 * np.abs(expected).max()


def test_a_position_with_a_deviation_is_the_mean_of_exact_ones() -> None:
    """For the terms of the first orders; all others, which wide tolerances make, count at the likeliest position
    alone."""
    scatter, deviation = scatter_of(load_drive("drive_1", gear_tolerance="IT8")), 0.1
    nodes, weights = np.polynomial.hermite_e.hermegauss(3)
    starts = START + deviation * 2 * np.pi / scatter.drive.elements * nodes

    def exact(start: float, orders: int) -> Array:
        return replace(scatter, start=start, orders=orders).covariance_of_parts(scatter.twist)[0]

    of_starts = [exact(float(start), NEAR_ORDERS) for start in starts]
    expected = np.average(of_starts, axis=0, weights=weights) + exact(START, MAX_ORDER) - of_starts[1]
    found, _ = replace(scatter, start_deviation=deviation).covariance_of_parts(scatter.twist)
    assert np.abs(found - expected).max() < 1e-9 * np.abs(expected).max()
    assert np.abs(found - of_starts[1]).max() > 0.05 * np.abs(expected).max()


def test_few_orders_are_most_of_a_covariance(scatter: Scatter) -> None:
    whole, _ = scatter.covariance_of_parts(scatter.twist)
    few, _ = replace(scatter, orders=NEAR_ORDERS).covariance_of_parts(scatter.twist)
    share = few.diagonal() / whole.diagonal()
    assert share.max() < 1
    assert share.min() > 0.7


def test_elements_are_alike_where_the_gaps_between_their_seats_repeat() -> None:
    """27 elements on 33 seats repeat after a third of a turn."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DoesNotFitWarning)
        drive = load_drive("drive_1", transmission_ratio=33, lobes=34, elements=81)
    scatter = scatter_of(drive)
    assert repeating_elements(drive) == 9

    def covariance(thirds: float) -> Array:
        return replace(scatter, start=START + thirds * 2 * np.pi / 3).covariance_of_parts(scatter.twist)[0]

    first = covariance(0)
    assert np.abs(covariance(1) - first).max() < 1e-6 * first.max()
    assert np.abs(covariance(4 / 9) - first).max() > 1e-3 * first.max()
