"""What has no name must show more than errors of the laws of the effects beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import FitOptions
from reefmu.diagnosis.estimation.residuals import torque_without
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.inference.law_errors import LAW_ERROR, SPREAD, beyond_law_errors, law_columns, within_law_errors
from reefmu.diagnosis.inference.nonparametric import fit_terms
from tests.individual_records import problem_of_individual
from tests.unit.reefmu.diagnosis.probabilities.conftest import Fitted, fitted

__all__ = ["fitted"]


def test_the_columns_are_shares_of_the_torque_of_the_effects(fitted: Fitted) -> None:
    """Of every column the greatest value is that share, where its function is greatest; nothing has no law."""
    problem, fit = fitted.problem, fitted.hysteresis
    assert law_columns(problem, fitted.base).shape == (len(problem.torque), 0)
    torque = fit.prediction.torque - torque_without(problem, fit, ["hysteresis"])
    columns = law_columns(problem, fit)[:, :-1]
    assert np.abs(columns).max() <= LAW_ERROR * np.abs(torque).max() * 1.001
    both = problem.fit_from(("hysteresis", "torque_sensor_offset"), np.append(fit.parameters, 1.0))
    assert law_columns(problem, both).shape[1] == 2 * columns.shape[1] + 1


@pytest.mark.parametrize("seed", range(3))
def test_a_spread_of_lengths_is_an_error_of_the_law(fitted: Fitted, seed: int) -> None:
    """Friction of many elements whose presliding lengths spread by a third about their mean differs from that of one by
    s^2 / 2 times the last column, which is taken off a residual; what varies otherwise stays."""
    problem, fit = fitted.problem, fitted.hysteresis
    spread, at = 0.35, problem.layout(fit.names).effects["hysteresis"].start + 1
    total = np.zeros(len(problem.torque))
    nodes, weights = np.polynomial.hermite_e.hermegauss(9)
    for node, weight in zip(nodes, weights / weights.sum(), strict=True):
        parameters = fit.parameters.copy()
        parameters[at] *= np.exp(spread * node)
        total += weight * problem.predictor(fit.names)(parameters).torque
    difference, errors = total - fit.prediction.torque, law_columns(problem, fit)
    np.testing.assert_allclose(difference, spread**2 / 2 * errors[:, -1] / SPREAD, atol=0.35 * np.abs(difference).max())
    rng = np.random.default_rng(seed)
    noise = np.sqrt(problem.block_variance) * rng.standard_normal(len(total))
    many = replace(fit, weighting=fit.weighting.with_variance(1e-6 * problem.variance))
    left = beyond_law_errors(problem, many, difference + 1e-3 * noise, errors)
    assert np.std(left) < 0.2 * np.std(difference)
    rough = beyond_law_errors(problem, fit, noise, errors)
    assert np.std(rough) == pytest.approx(np.std(noise), rel=0.1)


def test_an_effect_may_be_the_error_of_the_law_of_a_larger_one_of_its_kind(fitted: Fitted) -> None:
    """What counts is what it shows beside the larger one: friction with another dependence does from 0.2 of that on,
    one that the record hardly tells from it does at no size. An offset of the sensor is no error of friction."""
    problem, fit = fitted.problem, fitted.hysteresis

    def beside(name: str, *parameters: float) -> frozenset[str]:
        both = np.append(fit.parameters, parameters)
        return within_law_errors(problem, problem.fit_from((*fit.names, name), both, options=FitOptions(steps=0)))

    speed = float(np.sqrt(np.mean(problem.trace.output_speed**2)))
    assert beside("viscous_friction", 0.03 * 4.0 / speed) == {"viscous_friction"}
    assert not beside("viscous_friction", 0.3 * 4.0 / speed)
    assert beside("coulomb_friction", 0.5 * 4.0, 5e-5) == {"coulomb_friction"}
    assert beside("coulomb_friction", 12 * 4.0, 5e-5) == {"hysteresis"}
    assert not beside("torque_sensor_offset", 0.01)


@pytest.mark.parametrize(
    ("wear", "preload", "errors"),
    [(1e-8, 1e-6, ""), (1e-9, 1e-6, ""), (1e-8, 3e-8, "preload"), (5e-12, 1e-6, "wear")],
)
def test_an_error_is_small_as_a_torque_and_beside_the_scatter(wear: float, preload: float, errors: str) -> None:
    """Of an individual, whose scatter hides a preload more than a wear. wear: m/rad; preload: m. The first two have
    equal torques, of which the preload shows 6 %, and a wear with a tenth of the torque, which shows 13 times as
    much."""
    problem = problem_of_individual(29)
    start = np.append(base_fit(problem).parameters, [wear, preload])
    at_start = FitOptions(steps=0, estimate_size=False)
    fit = problem.fit_from(("wear", "preload"), start, problem.weights.with_size(1.0), at_start)
    assert within_law_errors(problem, fit) == {errors} - {""}


@pytest.mark.parametrize(("share", "remains"), [(0.1, False), (0.6, True)])
def test_what_a_law_error_explains_is_not_unnamed(fitted: Fitted, share: float, remains: bool) -> None:
    """A friction that grows with the torque is off its law by that share of its own torque; without errors of laws the
    smaller one would gain 38 as well."""
    problem, fit = fitted.problem, fitted.hysteresis
    own = fit.prediction.torque - torque_without(problem, fit, ["hysteresis"])
    size = np.abs(fit.prediction.torque) / np.abs(fit.prediction.torque).max()
    changed = replace(problem)
    vars(changed)["torque"] = problem.torque + share * own * size
    term = next(t for t in fit_terms(problem, fit) if t.term.coordinate.startswith("direction"))
    found = next(t for t in fit_terms(changed, fit) if t.term.coordinate.startswith("direction"))
    assert (found.gain - term.gain > 20.0) is remains


def test_the_direction_is_that_of_the_twist(fitted: Fitted) -> None:
    problem = fitted.problem
    rate = problem.blocks.mean(problem.trace.twist_rate)
    moving = np.abs(rate) > 0.5 * np.abs(rate).max()
    moving[problem.trace.start[problem.blocks.first]] = False
    direction = problem.blocks.mean(problem.trace.twist_direction)
    np.testing.assert_array_equal(np.sign(direction[moving]), np.sign(rate[moving]))
