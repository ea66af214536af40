"""Friction in proportion to the load of an individual: it scatters with the load, and its covariance counts that."""

from __future__ import annotations

from concurrent.futures import ProcessPoolExecutor
from dataclasses import fields, replace
from typing import Any

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit, FitOptions
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit, refine
from reefmu.diagnosis.estimation.worker_pool import WorkerPool, open_pool
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.record import Record
from stiffness_model.numerics.arrays import Array
from tests.individual_records import record_of_individual, seated_drive

FRACTION, PRESLIDING = 0.05, 1e-4
LOAD = "load_dependent_hysteresis"


def deflection(record: Record, twist: Array) -> Array:
    """(n,), share of the friction that is built up: that of Dahl's law from sample to sample."""
    found, z = np.zeros(len(twist)), 0.0
    starts = set(record.starts.tolist())
    for k in range(1, len(twist)):
        step = 0.0 if k in starts else twist[k] - twist[k - 1]
        z = np.sign(step) + (z - np.sign(step)) * np.exp(-abs(step) / PRESLIDING) if step else z
        found[k] = z
    return found


@pytest.fixture(scope="module")
def problem() -> Problem:
    """Of an individual with friction in proportion to the load of its own contacts, which is that without noise."""
    drive = seated_drive(29)
    record, noisy = (record_of_individual(drive, noise=noise) for noise in (0.0, 0.1))
    friction = FRACTION * np.abs(record.output_torque) * deflection(record, record.twist(drive.ratio))
    record = replace(noisy, output_torque=noisy.output_torque + friction)
    trace = make_trace(record, drive.ratio)
    return prepare_problem(record, trace, BaseCurveSource(drive).base_curve(trace))


@pytest.fixture(scope="module")
def first(problem: Problem) -> Fit:
    """The fit under the scatter of a drive without friction."""
    start = np.append(base_fit(problem).parameters, [0.03, PRESLIDING])
    return problem.fit_from((LOAD,), start, problem.weights.with_size(1.0))


def test_friction_scatters_with_the_load(problem: Problem, first: Fit) -> None:
    """What the fit leaves is noise and scatter, and the fraction is the true one; neither is so without the gain."""
    (refined,) = refine(WorkerPool(problem), [first])
    expected = problem.expected_chi_square(refined.weighting)
    assert refined.chi_square < 1.2 * expected < 1.4 * expected < first.chi_square
    assert refined.cost < first.cost - 1000
    at = problem.layout((LOAD,)).effects[LOAD].start
    errors = [abs(fit.parameters[at] / FRACTION - 1) for fit in (first, refined)]
    assert errors[1] < 0.003 < errors[0]


def test_a_fit_sent_to_another_process_keeps_its_gain(problem: Problem, first: Fit) -> None:
    gain = first.prediction.contacts.gain
    moved = replace(first, weighting=problem.weights.with_gain(gain))
    back = problem.with_weights(problem.without_weights(moved))
    np.testing.assert_array_equal(back.weighting.scale, moved.weighting.scale)


def test_contacts_that_differ_by_the_gain_share_one_covariance(problem: Problem, first: Fit) -> None:
    """Also where processes refine them, which do not know what others have computed."""
    assert problem.scatter is not None
    names, opened = (LOAD, "backlash"), 5 * problem.scatter.clearance_deviation
    starts = [np.append(first.parameters, opened), np.append(first.parameters, opened)]
    starts[1][problem.layout(names).effects[LOAD].start] *= 2
    fits = [problem.fit_from(names, at, first.weighting, FitOptions(steps=0)) for at in starts]

    computed: list[Array] = []

    class Counted(type(problem.scatter)):  # type: ignore[misc]
        def covariance_at(self, twist: Array, *args: Any, **kwargs: Any) -> Array:
            computed.append(twist)
            return super().covariance_at(twist, *args, **kwargs)

    values = {f.name: getattr(problem.scatter, f.name) for f in fields(problem.scatter)}  # type: ignore[arg-type]
    counted = replace(problem, scatter=Counted(**values), weights_cache=[])
    here = refine(WorkerPool(counted), fits)
    assert len(computed) == 1
    fresh = replace(problem, weights_cache=[])
    with ProcessPoolExecutor(2) as executor, open_pool(fresh, executor) as pool:
        there = refine(pool, fits)
    assert [fit.cost for fit in here] == [fit.cost for fit in there]
