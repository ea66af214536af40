"""Intervals from leaving cycles out hold the truth as often as they say, where those of white noise do not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import stdtrit

from reefmu.diagnosis.estimation.intervals import (
    interval_errors,
    leave_cycles_out,
    standard_errors,
    stratified_jackknife,
)
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import power_base
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from stiffness_model.numerics.arrays import Array
from tests.individual_records import problem_of_individual
from tests.unit.reefmu.diagnosis.preprocessing.test_cycle_scatter import ramps


def test_strata_add_their_variances_and_not_their_difference() -> None:
    """Two strata with far-off means: a mean of both has the variance of means within strata."""
    rng = np.random.default_rng(0)
    hits = []
    for _ in range(600):
        values = [rng.standard_normal(3), 100 + 2 * rng.standard_normal(5)]
        total = sum(float(v.mean()) for v in values)
        left = [total - v.mean() + (v.sum() - v) / (len(v) - 1) for v in values]
        found = stratified_jackknife([part[:, None] for part in left])
        assert found is not None
        half = stdtrit(found.freedom[0], 0.975) * found.standard_error[0]
        hits.append(abs(total - 100) < half)
    assert np.mean(hits) == pytest.approx(0.95, abs=0.03)


def test_strata_of_one_member_say_nothing() -> None:
    assert stratified_jackknife([np.ones((1, 2)), np.zeros((1, 2))]) is None


def with_hysteresis(seed: int) -> tuple[Problem, Array]:
    """A record whose cycles scatter, and the parameters of a fit of its hysteresis of 2 N.m."""
    record = ramps(1.0, cycles=5, seed=seed)
    trace = make_trace(record, 1.0)
    problem = prepare_problem(record, trace, power_base(trace))
    return problem, np.concatenate([base_fit(problem).parameters, [1.5, 2e-3]])


def test_intervals_are_the_widest_of_all() -> None:
    problem, start = with_hysteresis(0)
    fit = problem.fit_from(("hysteresis",), start)
    by_cycles = leave_cycles_out(problem, fit)
    assert by_cycles is not None
    errors, model = interval_errors(problem, fit), standard_errors(problem, fit)
    quantile = stdtrit(by_cycles.freedom, 0.975) / 1.96
    assert errors == pytest.approx(np.maximum(model, quantile * by_cycles.standard_error))
    assert (by_cycles.freedom >= 4).all()


@pytest.mark.slow
def test_intervals_hold_the_truth() -> None:
    """Of 24 records; also those of the jackknife alone."""
    hits, alone = [], []
    for seed in range(24):
        problem, start = with_hysteresis(seed)
        fit = problem.fit_from(("hysteresis",), start)
        at = problem.layout(fit.names).effects["hysteresis"].start
        scale = float(fit.bounds.scale[at])
        by_cycles = leave_cycles_out(problem, fit)
        assert by_cycles is not None
        error = abs(fit.parameters[at] - 2.0)
        hits.append(error < 1.96 * interval_errors(problem, fit)[at] * scale)
        alone.append(error < stdtrit(by_cycles.freedom[at], 0.975) * by_cycles.standard_error[at] * scale)
    assert np.mean(hits) > 0.9
    assert np.mean(alone) > 0.8


def test_a_clearance_is_known_no_better_than_the_mean_one_of_individuals_deviates() -> None:
    """Also of a drive whose places do not deviate, so that its scatter is likeliest at three quarters of that of the
    drawing."""
    problem = problem_of_individual(29)
    fit = problem.fit_from(("preload",), np.append(base_fit(problem).parameters, 1e-7))
    assert problem.scatter is not None
    assert fit.weighting.is_individual
    assert fit.weighting.size == 0.75
    at = problem.layout(fit.names).effects["preload"].start
    error = standard_errors(problem, fit)[at] * float(fit.bounds.scale[at])
    assert 0.98 < error / problem.scatter.mean_clearance_deviation < 1.3
