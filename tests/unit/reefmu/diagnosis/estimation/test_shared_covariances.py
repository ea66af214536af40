"""Costs under the covariances of other fits, compared with fits under them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.estimation.shared_covariances import least_costs
from reefmu.diagnosis.estimation.weighting import INDIVIDUAL_SIZE
from stiffness_model.numerics.arrays import Array
from tests.individual_records import problem_of_individual

EFFECT = ("kinematic_error",)


@pytest.fixture(scope="module")
def problem() -> Problem:
    return problem_of_individual(29)


def with_kinematic_error(problem: Problem, start: Array) -> Array:
    """Parameters of a fit without effects and a kinematic error of 0.1 mrad."""
    where = problem.layout(EFFECT).effects[EFFECT[0]]
    found = problem.bounds(EFFECT).prior_mean.copy()
    found[: len(start)] = start
    found[where] = 0.0
    found[where.start] = 1e-4
    return found


def test_a_covariance_of_one_fit_is_open_to_all(problem: Problem) -> None:
    """To nothing as well: what it gains by the scatter that a kinematic error would make is none of the effect's."""
    nothing = base_fit(problem)
    effect = problem.fit_from(EFFECT, with_kinematic_error(problem, nothing.parameters))
    # Half as in the record itself.
    own = nothing.weighting
    shown = (own.basis.T @ ((problem.torque - nothing.prediction.torque) * own.scale)) ** 2 / own.size**2
    likelier = replace(own, eigenvalues=(own.eigenvalues + shown) / 2, basis=own.basis.copy())
    effect = problem.fit_from(EFFECT, effect.parameters, likelier)
    refitted = problem.fit_from((), nothing.parameters, likelier)
    assert nothing.weighting.is_individual
    assert effect.weighting.is_individual
    costs = least_costs(problem, [nothing, effect])
    assert costs[0] < nothing.cost - 1.0
    assert costs[0] == pytest.approx(refitted.cost, abs=0.05)
    assert least_costs(problem, [nothing], [effect]) == costs[:1]
    assert costs[1] <= effect.cost


@pytest.mark.parametrize("clearances", [0.5, 3.0])
def test_a_covariance_at_another_clearance_costs_as_much_as_that_clearance(problem: Problem, clearances: float) -> None:
    """Its probability by the tolerances: a drive without effects is no preloaded one. clearances: in standard
    deviations of the mean clearance."""
    assert problem.scatter is not None
    nothing = base_fit(problem)
    likelier = replace(
        nothing.weighting, basis=nothing.weighting.basis.copy(), eigenvalues=nothing.weighting.eigenvalues / 2
    )
    at = nothing.prediction.contacts
    beside = at._replace(clearance=at.clearance - clearances * problem.scatter.mean_clearance_deviation)
    alike, apart = (
        replace(nothing, weighting=likelier, prediction=replace(nothing.prediction, contacts=contacts))
        for contacts in (at, beside)
    )
    (shared,), (moved,) = (least_costs(problem, [replace(nothing, cost=1e9)], [other]) for other in (alike, apart))
    assert moved - shared == pytest.approx(clearances**2, rel=1e-9)


def test_a_mean_drive_keeps_its_cost(problem: Problem) -> None:
    nothing = base_fit(problem)
    mean = replace(nothing, weighting=nothing.weighting.for_mean_drive(), cost=1e9)
    assert least_costs(problem, [mean], [nothing]) == [1e9]


def test_a_parameter_at_its_bound_stays_there(problem: Problem) -> None:
    """Beyond its bound it would explain what no drive does: here a zero of the twist that is off by a hundredth."""
    nothing = base_fit(problem)
    other = replace(nothing, weighting=replace(nothing.weighting, basis=nothing.weighting.basis.copy()))
    off = nothing.parameters + np.array([0.01 * problem.base.max_twist, *np.zeros(len(nothing.parameters) - 1)])
    prediction = problem.predictor(())(off)
    residual = problem.torque - prediction.torque
    added = nothing.weighting.cost(residual)
    added -= nothing.weighting.cost(problem.torque - nothing.prediction.torque)
    costs = {"cost": nothing.cost + added, "chi_square": nothing.chi_square + added}
    moved = replace(nothing, parameters=off, prediction=prediction, **costs)
    at_bound = replace(moved, at_bound=np.ones(len(off), bool))
    (followed,), (held,) = (least_costs(problem, [fit], [other]) for fit in (moved, at_bound))
    wider = nothing.weighting.with_likeliest_scatter(residual, INDIVIDUAL_SIZE)
    expected = moved.cost - nothing.weighting.cost(residual) + wider.cost(residual)
    assert held == pytest.approx(expected, abs=2.0)
    assert followed < held - 50.0


def test_a_covariance_that_is_shared_has_the_gain_of_each_fit(problem: Problem) -> None:
    """That of a drive whose effects scatter is open to nothing as it is without them, and to effects that were fitted
    under that of a drive without any as it is with them."""
    nothing = base_fit(problem)
    log = 0.1 * np.sin(np.arange(len(problem.torque)))
    gain = np.exp(log - log.mean())
    contacts = nothing.prediction.contacts._replace(gain=gain)
    scattering = replace(nothing, prediction=replace(nothing.prediction, contacts=contacts))
    own = replace(scattering, weighting=nothing.weighting.with_gain(gain))
    (cost,) = least_costs(problem, [replace(nothing, cost=1e9)], [own])
    assert cost == pytest.approx(nothing.cost, abs=1e-3 * abs(nothing.cost))
    under = problem.fit_from((), nothing.parameters, own.weighting)
    assert abs(under.cost - nothing.cost) > 1e-2 * abs(nothing.cost), "the gain is seen"
    _, cost = least_costs(problem, [nothing, replace(scattering, cost=0.0)])
    assert cost == pytest.approx(under.cost, abs=1e-3 * abs(under.cost))
