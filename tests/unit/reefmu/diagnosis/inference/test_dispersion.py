"""What the likeliest explanation leaves makes evidence count less."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import power_base
from reefmu.diagnosis.inference.dispersion import dispersion
from reefmu.diagnosis.inference.nonparametric import CURVE_TERM, TermFit
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from tests.individual_records import problem_of_individual
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


def test_what_a_nonparametric_term_explains_is_no_dispersion(friction: tuple[Problem, Fit, Fit]) -> None:
    """Without the term, what it stands for would make all evidence count less, its own included."""
    problem, _, fit = friction
    wave = 30 * np.sqrt(problem.variance) * np.sin(np.arange(len(problem.torque)) / 7.0)
    disturbed = replace(problem)
    vars(disturbed)["torque"] = problem.torque + wave
    term = TermFit(CURVE_TERM, 0.0, wave)
    added = float((wave**2 / problem.variance).sum())
    worse = replace(fit, chi_square=fit.chi_square + added, cost=fit.cost + added)
    assert dispersion(disturbed, [(worse, None)]) > 20.0
    explained = replace(term, gain=added)
    assert dispersion(disturbed, [(worse, None), (worse, explained)]) == pytest.approx(
        dispersion(problem, [(fit, None)])
    )


def test_a_misfit_of_a_part_of_the_record_is_dispersion(friction: tuple[Problem, Fit, Fit]) -> None:
    """It is no noise of the whole record, which the median segment would show, but the likeliest explanation leaves
    it."""
    problem, _, fit = friction
    expected = problem.expected_chi_square(problem.weights)
    assert dispersion(problem, [(replace(fit, chi_square=0.5 * expected), None)]) >= 1.0
    assert dispersion(problem, [(replace(fit, chi_square=7 * expected), None)]) == pytest.approx(7.0)
    likelier = replace(fit, chi_square=5 * expected, cost=fit.cost - 10.0)
    both = [(replace(fit, chi_square=7 * expected), None), (likelier, None)]
    assert dispersion(problem, both) == pytest.approx(5.0)


@pytest.mark.parametrize("alone", [0.1, 1.0])
def test_an_individual_in_slow_noise_is_no_dispersion(alone: float) -> None:
    """What the scatter spans has the variance of noise and scatter together, however little noise a block has alone."""
    made = problem_of_individual(29)
    problem = replace(made, block_variance=alone * made.variance)
    rng, weights = np.random.default_rng(0), problem.weights
    residual = np.sqrt(problem.block_variance) * rng.standard_normal(len(weights.scale))
    residual += rng.standard_normal(len(weights.eigenvalues)) @ weights.components
    base, square = base_fit(problem), float((weights.whiten(residual) ** 2).sum())
    prediction = replace(base.prediction, torque=problem.torque - residual)
    fit = replace(base, weighting=weights, prediction=prediction, chi_square=square)
    assert dispersion(problem, [(fit, None)]) == pytest.approx(1.0, abs=0.12)
