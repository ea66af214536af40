"""The p-value of the chosen model: ordinary for a model that is right, the least possible for one that is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.probabilities.goodness_of_fit import (
    N_RECORDS,
    global_p,
    individuals_with_places,
    p_value,
    simulate_noise,
)
from tests import diagnosis_rig as rig
from tests.unit.reefmu.diagnosis.probabilities.conftest import Fitted


def test_the_right_model_explains_the_record_and_the_base_curve_alone_does_not(fitted: Fitted) -> None:
    assert global_p(fitted.problem, fitted.hysteresis) > 0.05
    assert global_p(fitted.problem, fitted.base) == 1 / (1 + N_RECORDS)


def test_p_values_of_records_that_the_model_makes_are_uniform(fitted: Fitted) -> None:
    """Records simulated with this record's noise in place of the measured residual: a tenth of them below 0.1."""
    problem, fit = fitted.problem, fitted.hysteresis
    found = np.array(
        [p_value(problem, fit, noise) for noise in simulate_noise(problem, 60, np.random.default_rng(1)).T]
    )
    assert 0.02 < np.mean(found < 0.1) < 0.25
    assert 0.35 < np.mean(found) < 0.65


def test_simulated_noise_has_the_variance_and_the_correlation_that_were_estimated(fitted: Fitted) -> None:
    slow = replace(fitted.problem, noise=replace(fitted.problem.noise, correlation_time=9.0))
    noise = simulate_noise(slow, 4000, np.random.default_rng(0))
    assert np.allclose(np.var(noise, axis=1), slow.block_variance, rtol=0.15)
    expected = (8 / 10) ** float(np.median(slow.blocks.count))
    neighbours = np.mean(noise[1:] * noise[:-1], axis=1) / np.sqrt(slow.block_variance[1:] * slow.block_variance[:-1])
    assert abs(float(np.mean(neighbours)) - expected) < 0.02


def test_individuals_have_places_that_drawings_do_not_state() -> None:
    """The p-value allows for bores and lobes beside their places; the search does not know them."""
    record = rig.measured({}, noise=0.5, seed=21, full=False)
    trace = make_trace(record, rig.drive().ratio)
    problem = prepare_problem(record, trace, BaseCurveSource(rig.drive()).base_curve(trace))
    problem = replace(problem, is_mean_drive=False)
    assert np.mean(individuals_with_places(problem) ** 2) > 1.1 * np.mean(problem.individuals**2)
    assert individuals_with_places(replace(problem, is_mean_drive=True)) is problem.individuals
