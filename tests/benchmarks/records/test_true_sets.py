"""Records of individuals with their true sets of effects."""

from __future__ import annotations

import pytest

from .true_sets import true_set


@pytest.mark.slow
def test_the_true_set_of_an_individual_explains_its_record() -> None:
    """A single loop from which a hysteresis is missing, whose size generator and diagnosis share."""
    found = true_set(12, 21)
    assert found is not None
    assert found.fit.names == ("hysteresis",)
    fitted = found.fitted(found.scatter)
    problem = found.problem
    squares = fitted.weighting.whiten(problem.torque - fitted.prediction.torque) ** 2
    assert 0.5 < squares.sum() / problem.expected_squares(fitted.weighting).sum() < 1.5
    without = problem.fit_from((), found.fit.parameters[: problem.layout(()).n_base], fitted.weighting)
    assert without.cost - fitted.cost > 50


def test_a_mean_drive_has_no_true_set_of_an_individual() -> None:
    assert true_set(1, 21) is None
