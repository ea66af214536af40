"""Gains along noise, what the likeliest explanation leaves, and errors of large effects make evidence count less."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import power_base
from reefmu.diagnosis.inference.dispersion import COVARIANCE_ERROR, ChanceGains, dispersion
from reefmu.diagnosis.inference.nonparametric import CURVE_TERM, TermFit
from reefmu.diagnosis.inference.simulated_records import SimulatedRecords, simulate_records
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from stiffness_model.numerics.arrays import Array
from tests.unit.reefmu.diagnosis.preprocessing.test_cycle_scatter import ramps

LOOPS = {"hysteresis": [2.0, 1e-3], "damping": [1.0]}
"""Effects with parameters from which fits begin."""


@pytest.fixture(scope="module")
def friction() -> tuple[Problem, Fit, Fit]:
    """Cycles that differ by slow scatter: the problem, its fit without effects, and that with loops of the direction
    and of the rate, which differ by how wide the loops of single cycles are."""
    record = ramps(0.5)
    trace = make_trace(record, 1.0)
    problem = prepare_problem(record, trace, power_base(trace))
    base = base_fit(problem)
    return (
        problem,
        base,
        problem.fit_from(tuple(LOOPS), np.append(base.parameters, np.concatenate(list(LOOPS.values())))),
    )


def least_squares_gains(problem: Problem, fit: Fit, records: Array) -> Array:
    """(m,) reduction of the sums of squares of records (n, m) by columns of effects beside those of the base; a prior
    is a row that measures zero."""
    scale = 1 / np.sqrt(problem.variance)[:, None]
    slope = fit.bounds.slope(fit.parameters)
    prior = np.diag(slope / fit.bounds.prior_deviation)
    columns = np.concatenate([fit.prediction.sensitivities * slope * scale, prior])
    values = np.concatenate([records * scale, np.zeros((len(slope), records.shape[1]))])
    left = []
    for part in (columns[:, : problem.layout(()).n_base], columns):
        part = part / np.linalg.norm(part, axis=0)
        left.append(((values - part @ np.linalg.lstsq(part, values, rcond=None)[0]) ** 2).sum(axis=0))
    return left[0] - left[1]


def test_gains_along_simulated_records_are_those_of_least_squares(friction: tuple[Problem, Fit, Fit]) -> None:
    problem, base, fit = friction
    simulated = simulate_records(problem, 40, seed=5)
    chance = ChanceGains(problem, base, simulated)
    expected = least_squares_gains(problem, fit, simulated.noise)
    np.testing.assert_allclose(chance.of_effects([fit], fit.weighting)[0], expected, rtol=0.01, atol=0.01)
    np.testing.assert_allclose(chance.of_effects([base], fit.weighting)[0], 0.0, atol=1e-9)
    drives = replace(simulated, drives=100 * np.ones_like(simulated.noise))
    of_drives = ChanceGains(problem, base, drives).of_effects([fit], fit.weighting)[0]
    np.testing.assert_array_equal(of_drives, chance.of_effects([fit], fit.weighting)[0], "their scatter is covariance")


def test_alternatives_that_differ_by_single_cycles_gain_over_each_other_by_chance(
    friction: tuple[Problem, Fit, Fit],
) -> None:
    """Loops of the direction and of the rate: scatter between cycles favours one or the other by more than the weights
    expect, although either gains much alone."""
    problem, base, _ = friction
    loops = [problem.fit_from((name,), np.append(base.parameters, p)) for name, p in LOOPS.items()]
    chance = ChanceGains(problem, base, simulate_records(problem, 40, seed=5))
    direction, rate = chance.of_effects(loops, base.weighting)
    differences = direction - rate
    assert np.abs(differences).max() < 0.7 * max(direction.max(), rate.max())
    # The greatest of 40 differences between two noises of variance 1 is near 2.2.
    assert differences.max() > 4.0


def test_individuals_with_a_wave_of_their_own_gain_by_terms_without_a_name(friction: tuple[Problem, Fit, Fit]) -> None:
    problem, base, _ = friction
    wave = np.sin(np.arange(len(problem.torque)) / 7.0)
    small = np.random.default_rng(0).standard_normal((len(wave), 8)) * 0.01
    gains = []
    for size in (0.0, 1.0, 2.0):
        records = SimulatedRecords(small, size * np.outer(wave, np.linspace(1, 3, 8)))
        gains.append(ChanceGains(problem, base, records).unnamed(problem.weights.with_size(1.0)))
    assert gains[0] < 1.0
    assert gains[2] > 2 * gains[1] > 20


def test_large_gains_add_the_error_of_the_covariance(friction: tuple[Problem, Fit, Fit]) -> None:
    problem, _, fit = friction
    without, beside = (dispersion(problem, [(fit, None)], gain) for gain in (0.0, 1e5))
    assert without >= 1.0
    assert beside - without == pytest.approx(COVARIANCE_ERROR**2 * 1e5)


def test_simulated_records_have_the_scatter_of_a_weighting(friction: tuple[Problem, Fit, Fit]) -> None:
    problem, base, _ = friction
    drives = np.outer(np.linspace(-1, 1, 6), np.ones(len(problem.torque)))
    weights = base.weighting
    alone = simulate_records(problem, 20, seed=0).under(weights)
    assert np.sqrt((alone**2).mean()) == pytest.approx(np.sqrt(problem.block_variance.mean()), rel=0.2)
    found = simulate_records(replace(problem, individuals=drives), 20, seed=0)
    one, two = (found.under(weights.with_size(size)) - found.noise for size in (1.0, 2.0))
    np.testing.assert_allclose(two, 2 * one)


def test_what_a_nonparametric_term_explains_is_no_dispersion(friction: tuple[Problem, Fit, Fit]) -> None:
    """Without the term, what it stands for would make all evidence count less, its own included."""
    problem, _, fit = friction
    wave = 30 * np.sqrt(problem.variance) * np.sin(np.arange(len(problem.torque)) / 7.0)
    disturbed = replace(problem)
    vars(disturbed)["torque"] = problem.torque + wave
    term = TermFit(CURVE_TERM, 0.0, wave)
    added = float((wave**2 / problem.variance).sum())
    worse = replace(fit, chi_square=fit.chi_square + added, cost=fit.cost + added)
    assert dispersion(disturbed, [(worse, None)], 0.0) > 20.0
    explained = replace(term, gain=added)
    assert dispersion(disturbed, [(worse, None), (worse, explained)], 0.0) == pytest.approx(
        dispersion(problem, [(fit, None)], 0.0)
    )


def test_a_misfit_of_a_part_of_the_record_is_dispersion(friction: tuple[Problem, Fit, Fit]) -> None:
    """It is no noise of the whole record, which the median segment would show, but the likeliest explanation leaves
    it."""
    problem, _, fit = friction
    expected = problem.expected_chi_square(fit.weighting)
    assert dispersion(problem, [(replace(fit, chi_square=7 * expected), None)], 0.0) == pytest.approx(7.0)
    likelier = replace(fit, chi_square=5 * expected, cost=fit.cost - 10.0)
    both = [(replace(fit, chi_square=7 * expected), None), (likelier, None)]
    assert dispersion(problem, both, 0.0) == pytest.approx(5.0)
