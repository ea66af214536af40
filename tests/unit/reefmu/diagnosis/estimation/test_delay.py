"""A torque that is read later than the angles is a property of the rig: its delay is estimated, and nothing is left."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from reefmu.diagnosis.estimation.problem import DELAY_DEVIATION, MAX_DELAY, Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.forward.parameter_layout import DELAY
from reefmu.diagnosis.inference.nonparametric import fit_terms
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model.contacts.tables import cached_lookup
from reefmu.record import Record
from tests import diagnosis_rig as rig


def delayed(delay: float) -> Record:
    """A record of the mean drive whose torque is read `delay` seconds later."""
    record = rig.measured({}, noise=0.4, seed=8)
    torque = record.output_torque.copy()
    for run in np.unique(record.run):
        inside = record.run == run
        torque[inside] = np.interp(record.time[inside] - delay, record.time[inside], record.output_torque[inside])
    return replace(record, output_torque=torque)


@cache
def problem_of(delay: float) -> Problem:
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    record = delayed(delay)
    return prepare_problem(record, make_trace(record, rig.drive().ratio), base)


@pytest.mark.parametrize(
    "delay", [pytest.param(0.0, marks=pytest.mark.slow), 0.001, pytest.param(0.003, marks=pytest.mark.slow)]
)
def test_the_delay_is_estimated_and_nothing_unnamed_is_left(delay: float) -> None:
    problem = problem_of(delay)
    fit = base_fit(problem)
    assert fit.parameters[DELAY] == pytest.approx(delay, abs=3e-4)
    assert fit_terms(problem, fit)[0].gain < 12


def test_without_the_delay_something_unnamed_would_be_found() -> None:
    problem = problem_of(0.003)
    found = base_fit(problem)
    prompt = found.parameters.copy()
    prompt[DELAY] = 0.0
    prediction = problem.predictor(())(prompt)
    kept = np.arange(len(prompt)) != DELAY
    prediction = replace(prediction, sensitivities=prediction.sensitivities[:, kept])
    bounds = replace(found.bounds, prior_deviation=found.bounds.prior_deviation[kept])
    assert fit_terms(problem, replace(found, prediction=prediction, bounds=bounds))[0].gain > 50


def test_a_delay_is_at_most_that_of_the_slowest_filter() -> None:
    problem = problem_of(0.003)
    low, high = (bound[DELAY] for bound in (problem.bounds(()).low, problem.bounds(()).high))
    assert (low, high) == pytest.approx((-MAX_DELAY * DELAY_DEVIATION, MAX_DELAY * DELAY_DEVIATION))
    assert high <= problem.sampling_interval
