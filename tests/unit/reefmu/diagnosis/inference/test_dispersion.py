"""What effects gain along records without them, and the error of laws beside large effects, make gains count less."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import power_base
from reefmu.diagnosis.inference.dispersion import COVARIANCE_ERROR, ChanceGains, dispersion
from reefmu.diagnosis.inference.simulated_records import SimulatedRecords, simulate_records
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from stiffness_model.numerics.arrays import Array
from tests.unit.reefmu.diagnosis.preprocessing.test_cycle_scatter import ramps


@pytest.fixture(scope="module")
def friction() -> tuple[Problem, Fit, Fit]:
    """Cycles that differ by slow scatter: the problem, its fit without effects, and that with loops of the direction
    and of the rate, which differ by how wide the loops of single cycles are."""
    record = ramps(0.5)
    trace = make_trace(record, 1.0)
    problem = prepare_problem(record, trace, power_base(trace))
    base = base_fit(problem)
    return problem, base, problem.fit_from(("hysteresis", "damping"), np.append(base.parameters, [2.0, 1e-3, 1.0]))


def least_squares_gains(problem: Problem, fit: Fit, name: str, records: Array) -> Array:
    """(m,) by how much the columns of one effect reduce the sums of squares of records (n, m) beside all others."""
    scale = 1 / np.sqrt(problem.variance)[:, None]
    columns = fit.prediction.sensitivities * fit.bounds.slope(fit.parameters) * scale
    columns = columns / np.linalg.norm(columns, axis=0)
    where = problem.layout(fit.names).effects[name]
    left = []
    for part in (np.delete(columns, np.arange(where.start, where.stop), axis=1), columns):
        rest = records * scale - part @ np.linalg.lstsq(part, records * scale, rcond=None)[0]
        left.append((rest**2).sum(axis=0))
    return left[0] - left[1]


def test_gains_by_chance_are_the_greatest_along_records_without_effects(friction: tuple[Problem, Fit, Fit]) -> None:
    """Two loops that only single cycles tell apart gain by chance what scatter between the cycles makes of them."""
    problem, base, fit = friction
    simulated = simulate_records(problem, 40, seed=5)
    expected = 0.0
    for name in fit.names:
        (other,) = set(fit.names) - {name}
        where = problem.layout(fit.names).effects[other]
        start = np.concatenate([fit.parameters[: len(base.parameters)], fit.parameters[where]])
        here = problem.fit_from((other,), start).cost - fit.cost
        expected += min(here, float(least_squares_gains(problem, fit, name, simulated.noise).max()))
    found = ChanceGains(problem, base, simulated).named(fit)
    assert found == pytest.approx(expected, rel=0.2, abs=1.0)
    assert found > 10.0
    assert ChanceGains(problem, base, simulated).named(base) == 0.0


def test_an_effect_that_is_there_keeps_its_gain_but_for_chance(friction: tuple[Problem, Fit, Fit]) -> None:
    """White noise of the weights' own size gains as much as the greatest of 200 chi-squares of two parameters."""
    problem, base, _ = friction
    fit = problem.fit_from(("hysteresis",), np.append(base.parameters, [2.0, 1e-3]))
    white = np.sqrt(problem.variance)[:, None] * np.random.default_rng(0).standard_normal((len(problem.torque), 200))
    chance = ChanceGains(problem, base, SimulatedRecords(white, np.zeros((len(white), 0))))
    assert chance.named(fit) == pytest.approx(chi2(2).ppf(1 - 1 / 200), rel=0.5)
    assert chance.named(fit) < 0.02 * (base.cost - fit.cost)


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
    without, beside = (dispersion(problem, [fit], gain) for gain in (0.0, 1e5))
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
