"""The p-value of the chosen model: ordinary for a model that is right, the least possible for one that is not."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.inference.simulated_records import simulate_noise
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem, with_individuals
from reefmu.diagnosis.preprocessing.autocorrelation import LAG_ONE_CORRELATIONS, Autocorrelation
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.probabilities.goodness_of_fit import (
    N_RECORDS,
    global_p,
    p_value,
)
from reefmu.diagnosis.random_effects.individuals import simulate_individuals
from reefmu.diagnosis.random_effects.scatter import Scatter
from stiffness_model.numerics.arrays import Array
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
    """Slow noise beside white noise, as an encoder adds to that of a torque sensor, in blocks of four samples."""
    slow, white = (np.eye(1, len(LAG_ONE_CORRELATIONS), LAG_ONE_CORRELATIONS.index(rho)) for rho in (0.97, 0.0))
    problem = fitted.problem
    noise = replace(problem.noise, correlation=Autocorrelation(1.0, 0.6 * slow + 0.4 * white), samples=10**7)
    blocks = replace(problem.blocks, count=np.full(len(problem.torque), 4.0))
    found = simulate_noise(replace(problem, noise=noise, blocks=blocks), 4000, np.random.default_rng(0))
    assert np.allclose(np.var(found, axis=1), problem.block_variance, rtol=0.15)
    expected = noise.correlation.of_means(4, 4)
    scaled = found / np.sqrt(problem.block_variance)[:, None]
    for lag in range(1, 4):
        assert np.mean(scaled[lag:] * scaled[:-lag]) == pytest.approx(expected[lag] / expected[0], abs=0.02)


@pytest.mark.parametrize("correlation", [0.0, 0.91])
def test_simulated_noise_has_the_error_of_its_level(fitted: Fitted, correlation: float) -> None:
    """That of the variance of block means, of which a record with slow noise has fewer that are independent."""
    count, samples, n = 4, 2400, len(fitted.problem.torque)
    shares = np.eye(1, len(LAG_ONE_CORRELATIONS), LAG_ONE_CORRELATIONS.index(correlation))
    noise = replace(fitted.problem.noise, correlation=Autocorrelation(1.0, shares), samples=samples)
    blocks = replace(fitted.problem.blocks, count=np.full(n, float(count)))
    found = simulate_noise(replace(fitted.problem, noise=noise, blocks=blocks), 2000, np.random.default_rng(0))
    level = np.log(np.mean(found**2 / fitted.problem.block_variance[:, None], axis=0))
    # Noise of one level: the mean squares of its block means deviate as those of `samples` samples do.
    white = np.random.default_rng(1).standard_normal((1000, samples + 400))
    slow = lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], white)[:, 400:]
    squares = np.mean(slow.reshape(len(slow), -1, count).mean(axis=2) ** 2, axis=1)
    estimate = float(np.var(np.log(squares)))
    own = estimate * samples / (count * n)
    assert float(np.var(level)) == pytest.approx(2 * estimate + own, rel=0.15)


@pytest.fixture(scope="module")
def individual() -> tuple[Problem, Fit]:
    """The problem of a drawing's record, weighted as that of an individual, and the fit without effects."""
    record = rig.measured({}, noise=0.5, seed=21)
    trace = make_trace(record, rig.drive().ratio)
    problem = with_individuals(prepare_problem(record, trace, BaseCurveSource(rig.drive()).base_curve(trace)))
    assert isinstance(problem.scatter, Scatter)
    return problem, problem.fit_from((), problem.start(0.0), problem.weights)


@pytest.mark.slow
def test_p_values_of_individuals_are_ordinary_and_of_something_unnamed_small(individual: tuple[Problem, Fit]) -> None:
    """Individuals of another seed, which also deviate in forms that no drawing describes; a ripple over time, which no
    part makes, of a hundredth of full torque."""
    problem, fit = individual
    assert isinstance(problem.scatter, Scatter)
    drives = simulate_individuals(problem.scatter, 24, seed=7)
    noise = simulate_noise(problem, len(drives), np.random.default_rng(2))
    ripple = 0.01 * problem.base.full_torque * np.sin(problem.blocks.mean(problem.trace.time))

    def p_values(residuals: Array) -> Array:
        weightings = [problem.weights.with_likeliest_scatter(residual) for residual in residuals]
        return np.array(
            [p_value(problem, replace(fit, weighting=w), r) for w, r in zip(weightings, residuals, strict=True)]
        )

    weights, rng = problem.weights, np.random.default_rng(3)
    drawn = weights.without_unknown_forms(problem.base.full_torque)
    forms = np.sqrt(weights.eigenvalues - drawn.eigenvalues) * rng.standard_normal(
        (len(drives), len(drawn.eigenvalues))
    )
    drives = drives + forms @ (weights.basis.T / weights.scale)
    ordinary, foreign = p_values(drives + noise.T), p_values(drives + noise.T + ripple)
    assert 0.25 < np.mean(ordinary) < 0.75
    assert np.mean(foreign < 0.05) > 0.8
