"""The benchmark of unknown forms on residuals that are drawn from a covariance."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.weighting import UNKNOWN_FORMS
from tests.benchmarks.scatter.bench_unknown_forms import SHARES, as_drawn, left
from tests.individual_records import problem_of_individual

SLOW = 0.2
"""Variance of a block alone over that of the weights, of slow noise."""


@pytest.fixture(scope="module")
def problem() -> Problem:
    made = problem_of_individual(29)
    return replace(made, block_variance=SLOW * made.variance)


@pytest.mark.slow
@pytest.mark.parametrize("share", [0.0, UNKNOWN_FORMS])
def test_residuals_of_a_covariance_leave_what_they_should(problem: Problem, share: float) -> None:
    """The share with which they are drawn costs least; without other forms every bin has its variance."""
    rng, full_torque = np.random.default_rng(0), problem.base.full_torque
    drawn = as_drawn(problem.weights, full_torque)
    widened = drawn.with_unknown_forms(full_torque)
    np.testing.assert_allclose(widened.eigenvalues, problem.weights.eigenvalues, rtol=1e-9)
    true = widened if share else drawn
    noise = np.sqrt(problem.block_variance)[:, None] * rng.standard_normal((len(true.scale), 16))
    residuals = [own + rng.standard_normal(len(true.eigenvalues)) @ true.components for own in noise.T]
    found = [left(problem, problem.weights, residual) for residual in residuals]
    best = SHARES[int(np.mean([f.costs for f in found], axis=0).argmin())]
    assert best == pytest.approx(share, rel=0.5)
    if share:
        assert abs(np.mean([f.misfit for f in found]) - 1.0) < 0.05
    else:
        assert np.all(np.abs(np.nanmean([f.by_size for f in found], axis=0) - 1.0) < 0.25)
