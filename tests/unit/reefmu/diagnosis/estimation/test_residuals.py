"""Overdispersion distinguishes noise that is larger than estimated from a local misfit."""

from __future__ import annotations

from dataclasses import replace

import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.residuals import estimate_overdispersion
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model.contacts.tables import cached_lookup
from tests import diagnosis_rig as rig

pytestmark = pytest.mark.slow


def clean(correlation: float = 0.0) -> tuple[Problem, Fit]:
    """The problem and base fit of a record without effects, with noise."""
    record = rig.measured({}, noise=0.8, correlation=correlation, seed=5)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    problem = prepare_problem(record, make_trace(record, rig.drive().ratio), base)
    return problem, base_fit(problem)


def with_underestimated_noise(problem: Problem, fit: Fit, factor: float) -> tuple[Problem, Fit]:
    """The same with the standard deviation of the noise estimated too small by a factor."""
    weights = replace(
        fit.weighting, scale=factor * fit.weighting.scale, eigenvalues=factor**2 * fit.weighting.eigenvalues
    )
    underestimated = replace(
        problem, variance=problem.variance / factor**2, block_variance=problem.block_variance / factor**2
    )
    return underestimated, replace(fit, weighting=weights)


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_noise_as_estimated_is_not_overdispersed(correlation: float) -> None:
    assert estimate_overdispersion(*clean(correlation)) < 1.35


def test_overdispersion_is_the_ratio_of_the_variances() -> None:
    assert estimate_overdispersion(*with_underestimated_noise(*clean(), 2.0)) == pytest.approx(4.0, rel=0.25)


def test_a_local_misfit_is_not_overdispersion() -> None:
    problem, fit = clean()
    residual = problem.torque - fit.prediction.torque
    residual[: len(residual) // 4] += 5.0
    assert estimate_overdispersion(problem, fit, residual) < 1.5
    assert estimate_overdispersion(problem, fit, 3 * residual) > 5, "a misfit of the whole record is"
