"""A noise that is louder or slower than estimated is told from a misfit that has its place."""

from __future__ import annotations

from dataclasses import replace

import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.residuals import estimate_overdispersion
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.estimation.weighting import Weighting
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.pipeline import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model.contacts.tables import cached_lookup
from tests import diagnosis_rig as rig

pytestmark = pytest.mark.slow


def clean(correlation: float = 0.0) -> tuple[Problem, Fit]:
    """A clean record under its own noise."""
    record = rig.measured({}, noise=0.8, correlation=correlation, seed=5)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    problem = prepare_problem(record, make_trace(record, rig.drive().ratio), base)[0]
    return problem, base_fit(problem)


def quieter(problem: Problem, fit: Fit, factor: float) -> tuple[Problem, Fit]:
    """The same where the noise is believed to be smaller by a factor."""

    def own(weights: Weighting) -> Weighting:
        parts = {
            k: replace(
                getattr(weights, k),
                scale=factor * getattr(weights, k).scale,
                eigenvalues=factor**2 * getattr(weights, k).eigenvalues,
            )
            for k in ("mean", "individual")
        }
        return replace(weights, **parts)

    believed = replace(
        problem, variance=problem.variance / factor**2, block_variance=problem.block_variance / factor**2
    )
    return believed, replace(fit, weighting=own(fit.weighting))


@pytest.mark.parametrize("correlation", [0.0, 0.9])
def test_a_noise_as_estimated_counts_once(correlation: float) -> None:
    assert estimate_overdispersion(*clean(correlation)) < 1.35


def test_a_louder_noise_counts_by_its_variance() -> None:
    assert estimate_overdispersion(*quieter(*clean(), 2.0)) == pytest.approx(4.0, rel=0.25)


def test_a_misfit_in_its_place_is_no_noise() -> None:
    problem, fit = clean()
    rest = problem.torque - fit.prediction.torque
    rest[: len(rest) // 4] += 5.0
    assert estimate_overdispersion(problem, fit, rest) < 1.5
    assert estimate_overdispersion(problem, fit, 3 * rest) > 5, "but what is everywhere is"
