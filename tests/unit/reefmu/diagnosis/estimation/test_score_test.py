"""First-order gains of effects: every true effect is near a variant that is tried."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.score_test import (
    absorbing_basis,
    amplitude_beside_alike,
    linearise,
    rank_directions,
    score_gains,
)
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import power_base
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from tests import diagnosis_rig as rig
from tests.individual_records import problem_of_individual


@pytest.fixture(scope="module")
def individual() -> Problem:
    return problem_of_individual(29)


@pytest.mark.parametrize("place", [0.0, 0.5, 1.5])
def test_a_missing_ball_anywhere_is_near_one_that_is_tried(individual: Problem, place: float) -> None:
    """Beside the scatter of an individual the trace of one element is like that of its neighbour, and less like those
    farther away: of twelve positions around the turn the best has 58 % of the gain of the third. place: in distances of
    the elements."""
    fit = base_fit(individual)
    assert individual.base.drive is not None
    true = np.array([0.0, 1.0 + place * 2 * np.pi / individual.base.drive.elements, 0.0])
    *tried, exact = linearise(individual, "missing_ball", fit, [true])
    basis = absorbing_basis(fit.weighting, fit.prediction.sensitivities, fit.bounds.prior_deviation)
    residual = fit.weighting.whiten(exact.columns[:, 0])
    residual -= basis @ (basis.T @ residual)
    best, expected = (
        max(gain for gain, _ in score_gains(some, fit.weighting, basis, residual)) for some in (tried, [exact])
    )
    assert best > 0.65 * expected


@pytest.mark.parametrize("name", ["missing_ball", "kinematic_error", "stribeck_friction", "creep", "wear"])
def test_variants_that_are_predicted_together_have_the_columns_of_each(individual: Problem, name: str) -> None:
    """Beside another effect as well; those of a kinematic error are sines, then cosines."""
    base = base_fit(individual)
    beside = individual.fit_from(("hysteresis",), np.concatenate([base.parameters, [1.0, 5e-5]]))
    for fit in (base, beside):
        found = linearise(individual, name, fit)
        for one in (found[0], found[-1]):
            alone = individual.for_ranking.predictor((*fit.names, name))
            vector = np.concatenate([fit.parameters, one.start])
            columns = alone(vector).sensitivities[:, len(fit.parameters) + np.array(one.sizes)]
            np.testing.assert_allclose(one.columns[:, : len(one.sizes)], columns, atol=1e-9 * np.abs(columns).max())


@pytest.mark.parametrize(
    ("effects", "damping"), [(("hysteresis",), 0.0), (("damping",), 500.0), (("damping", "hysteresis"), 500.0)]
)
def test_friction_is_not_taken_for_damping_that_it_looks_like(effects: tuple[str, ...], damping: float) -> None:
    sizes = {"damping": {"coefficient": 500.0}, "hysteresis": {"torque": 5.0, "presliding": 1e-4}}
    record = rig.measured({name: sizes[name] for name in effects}, noise=0.3)
    trace = make_trace(record, rig.drive().ratio)
    problem = prepare_problem(record, trace, power_base(trace))
    base = base_fit(problem)
    ((_, _, (alone,)),) = rank_directions(problem, base, linearise(problem, "damping", base), base.weighting.size)
    assert (alone > 700) == ("hysteresis" in effects)
    assert amplitude_beside_alike(problem, base, "damping") == pytest.approx(damping, rel=0.1, abs=1.0)
