"""Records without effects that are simulated along one record, and what is found in them although nothing is there."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.estimation.worker_pool import WorkerPool
from reefmu.diagnosis.forward.base_curve import power_base
from reefmu.diagnosis.inference.law_errors import law_columns
from reefmu.diagnosis.inference.nonparametric import fit_terms_to
from reefmu.diagnosis.inference.simulated_records import (
    N_WITH_TERMS,
    SimulatedRecords,
    gain_by_chance,
    simulate_records,
)
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.autocorrelation import Autocorrelation
from reefmu.diagnosis.preprocessing.trace import make_trace
from tests.unit.reefmu.diagnosis.preprocessing.test_cycle_scatter import ramps


@pytest.fixture(scope="module")
def fitted() -> tuple[Problem, Fit]:
    record = ramps(0.5)
    trace = make_trace(record, 1.0)
    problem = prepare_problem(record, trace, power_base(trace))
    return problem, base_fit(problem)


def test_simulated_records_have_the_scatter_of_a_weighting(fitted: tuple[Problem, Fit]) -> None:
    problem, base = fitted
    drives, weights = np.outer(np.linspace(-1, 1, 6), np.ones(len(problem.torque))), base.weighting
    alone = simulate_records(problem, 20, seed=0).under(weights)
    assert np.sqrt((alone**2).mean()) == pytest.approx(np.sqrt(problem.block_variance.mean()), rel=0.2)
    found = simulate_records(replace(problem, individuals=drives), 20, seed=0)
    one, two = (found.under(weights.with_size(size)) - found.noise for size in (1.0, 2.0))
    np.testing.assert_allclose(two, 2 * one)


def test_individuals_with_a_wave_of_their_own_gain_by_terms_without_a_name(fitted: tuple[Problem, Fit]) -> None:
    problem, base = fitted
    wave = np.sin(np.arange(len(problem.torque)) / 7.0)
    small = np.random.default_rng(0).standard_normal((len(wave), N_WITH_TERMS)) * 0.01
    records = SimulatedRecords(small, np.outer(wave, np.linspace(1, 3, N_WITH_TERMS)))
    assert problem.cycle_scatter is not None
    noise = replace(problem.noise, correlation=Autocorrelation(1.0), samples=10**9)
    known = replace(problem, noise=noise, cycle_scatter=replace(problem.cycle_scatter, level_deviation=1e-3))
    gains = [gain_by_chance(WorkerPool(known), base, records, size) for size in (0.0, 1.0, 2.0)]
    assert gains[0] < 1.0
    assert gains[2] > 2 * gains[1] > 20
    # A level of the noise that is not known exactly explains a part of it.
    assert 10 < gain_by_chance(WorkerPool(problem), base, records, 2.0) < 0.9 * gains[2]


def test_what_the_base_curve_takes_up_is_no_gain(fitted: tuple[Problem, Fit]) -> None:
    """A drive with another exponent is fitted by the free power law, as it would be in a record; to first order about
    the fit of the record it would not be."""
    problem, base = fitted
    other = base.parameters.copy()
    other[-1] += 0.5
    bent = problem.predictor(())(other).torque - base.prediction.torque
    small = np.random.default_rng(0).standard_normal((len(bent), 2)) * 0.01
    records = SimulatedRecords(small, np.stack([bent] * 2, axis=1))
    assert gain_by_chance(WorkerPool(problem), base, records, 1.0) < 2.0
    assert fit_terms_to(problem, base, small[:, 0] + bent, law_columns(problem, base))[0].gain > 20.0
