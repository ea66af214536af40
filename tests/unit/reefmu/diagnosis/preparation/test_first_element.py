"""Where the first element stands: individuals of the solver of rotation, which shares no code with the covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import by_cost
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit, linearise_candidates, single_effects
from reefmu.diagnosis.estimation.worker_pool import WorkerPool
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem, with_first_element
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.random_effects.scatter import Scatter
from reefmu.record import Record
from stiffness_model import Drive
from stiffness_model.rotation import draw_individual
from stiffness_model.rotation.element_torques import element_path
from tests import diagnosis_rig as rig
from tests.benchmarks.probabilities.observed_records import second_record
from tests.individual_records import seated_drive


def _record(drive: Drive, starts: tuple[float, ...], noise: float = 0.1) -> Record:
    """The record of an individual whose first element stands at one of some positions, rad, in every run, in turn."""
    plain, one = rig.protocol(), draw_individual(drive, 1)
    twist = plain.crank_angle / drive.ratio - plain.output_angle
    torque = noise * np.random.default_rng(0).standard_normal(len(plain))
    for number, run in enumerate(np.split(np.arange(len(plain)), plain.starts[1:])):
        placed = replace(one, start=starts[number % len(starts)])
        torque[run] += element_path(placed, plain.output_angle[run], twist[run]).torque.sum(axis=1)
    return replace(plain, output_torque=torque)


def _problem(record: Record, drive: Drive) -> Problem:
    trace = make_trace(record, drive.ratio)
    return prepare_problem(record, trace, BaseCurveSource(drive).base_curve(trace))


def _with_first_element(problem: Problem) -> Problem:
    fit = base_fit(problem)
    return with_first_element(problem, fit, linearise_candidates(WorkerPool(problem), fit))


@pytest.mark.parametrize("per_row", [29, pytest.param(25, marks=pytest.mark.slow)])
def test_the_position_is_that_of_the_individual(per_row: int) -> None:
    """Elements of a drive whose seats are all taken are alike, so that it is known up to their distance. An individual
    is likelier there than anywhere."""
    drive = seated_drive(per_row)
    distance, start = 2 * np.pi / drive.elements, draw_individual(drive, 1).start
    problem = _problem(_record(drive, (start,)), drive)
    found = _with_first_element(problem)
    assert isinstance(found.scatter, Scatter)
    assert found.scatter.start is not None
    beside = (found.scatter.start - start + distance / 2) % distance - distance / 2
    assert abs(beside) < 0.01 * distance
    assert base_fit(found).cost < base_fit(problem).cost - 50


def test_elements_that_do_not_keep_their_places_stand_anywhere() -> None:
    drive = seated_drive(29)
    problem = _problem(_record(drive, tuple(np.random.default_rng(2).uniform(0, 1, 16))), drive)
    assert _with_first_element(problem) is problem


def test_a_position_that_is_hardly_likelier_than_others_is_not_taken() -> None:
    """In noise of 32 N.m the likeliest of all positions is likelier than the average, by 1.8 in -2 log likelihood, and
    as likely as a sixth of all, so that it would be taken by chance."""
    drive = seated_drive(29)
    problem = _problem(_record(drive, (draw_individual(drive, 1).start,), noise=32.0), drive)
    assert base_fit(problem).weighting.is_individual
    assert _with_first_element(problem) is problem


def test_a_mean_drive_has_no_first_element() -> None:
    record, drive = rig.measured({}, noise=0.1, seed=3), rig.drive()
    problem = _problem(record, drive)
    assert not base_fit(problem).weighting.is_individual
    assert _with_first_element(problem) is problem


@pytest.mark.slow
def test_a_large_effect_hides_the_position_until_it_is_found() -> None:
    """Wear beside a missing ball of an individual with free seats."""
    record, drive, truth = second_record(5, 33)
    assert "wear" in truth["names"]
    problem = _problem(record, drive)
    assert _with_first_element(problem) is problem
    pool, base = WorkerPool(replace(problem, candidates=("wear", "missing_ball"))), base_fit(problem)
    likeliest = min(single_effects(pool, base, linearise_candidates(pool, base)).all_fits, key=by_cost)
    assert likeliest.names == ("wear",)
    found = with_first_element(problem, likeliest, linearise_candidates(pool, likeliest))
    assert isinstance(found.scatter, Scatter)
    assert found.scatter.start is not None
