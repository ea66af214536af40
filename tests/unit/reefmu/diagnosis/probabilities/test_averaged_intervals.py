"""Intervals count the other explanations of a record, with their probabilities."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reefmu.diagnosis.estimation.intervals import standard_errors
from reefmu.diagnosis.hypotheses import Hypothesis
from reefmu.diagnosis.probabilities.averaged_intervals import Rival, averaged_interval, mixture_interval, rivals_of
from reefmu.diagnosis.probabilities.hypothesis_table import Row
from reefmu.diagnosis.probabilities.named_effects import named_effects
from tests.unit.reefmu.diagnosis.probabilities.conftest import Fitted

FRICTION = frozenset({"hysteresis"})
WITH_OFFSET = frozenset({"hysteresis", "torque_sensor_offset"})
part = st.tuples(st.floats(0.01, 1.0), st.floats(-5.0, 5.0), st.floats(0.1, 3.0))


def rival(odds: float, variable: float, error: float) -> Rival:
    return Rival(odds, {"hysteresis": 1}, np.array([0.0, variable]), np.array([1.0, error]))


@given(st.lists(part, min_size=1, max_size=4))
def test_a_mixture_has_the_quantiles_of_its_draws(parts: list[tuple[float, float, float]]) -> None:
    weights, centres, errors = np.transpose(parts)
    low, high = mixture_interval(weights, centres, errors)
    rng = np.random.default_rng(np.random.SeedSequence(1))
    which = rng.choice(len(parts), 20_000, p=weights / weights.sum())
    drawn = centres[which] + errors[which] * rng.standard_normal(len(which))
    assert np.mean(drawn < low) == pytest.approx(0.025, abs=0.006)
    assert np.mean(drawn > high) == pytest.approx(0.025, abs=0.006)


@pytest.mark.parametrize("weight", [0.01, 0.5])
@pytest.mark.parametrize("error", [0.0, 1e200, np.inf])
def test_a_parameter_that_is_exact_or_not_determined_has_an_interval(weight: float, error: float) -> None:
    low, high = mixture_interval(np.array([1.0, weight]), np.array([2.0, 3.0]), np.array([0.1, error]))
    assert low < 2.0 < high
    # Where it is not determined and improbable, the rest is little wider; where it is probable, anything is possible.
    assert high > 1e5 if error and weight == 0.5 else high < 3.0001


@given(st.lists(part, max_size=3), part)
def test_the_own_interval_is_inside(others: list[tuple[float, float, float]], own: tuple[float, float, float]) -> None:
    _, variable, error = own
    low, high = averaged_interval(variable, error, [rival(*other) for other in others], "hysteresis", 0)
    assert low <= variable - 1.95996 * error
    assert high >= variable + 1.95996 * error


def test_an_improbable_explanation_or_one_without_the_effect_changes_nothing() -> None:
    alone = averaged_interval(2.0, 0.1, [], "hysteresis", 0)
    assert averaged_interval(2.0, 0.1, [rival(0.002, 9.0, 0.1)], "hysteresis", 0) == pytest.approx(alone, abs=0.005)
    assert averaged_interval(2.0, 0.1, [rival(5.0, 9.0, 0.1)], "creep", 0) == pytest.approx(alone)
    assert averaged_interval(2.0, 0.1, [rival(0.5, 9.0, 0.1)], "hysteresis", 0)[1] > 8.9


def test_rivals_share_effects_with_the_chosen_explanation(fitted: Fitted) -> None:
    """Their odds are those to all that has its effects, with and without something unnamed beside."""
    problem, chosen = fitted.problem, fitted.hysteresis
    offset = problem.fit_from((*chosen.names, "torque_sensor_offset"), np.append(chosen.parameters, 0.5))
    fits = {frozenset(): fitted.base, FRICTION: chosen, WITH_OFFSET: offset}
    keys = [(frozenset(), False), (FRICTION, False), (FRICTION, True), (WITH_OFFSET, False)]
    rows = [Row(effects, unnamed, 0.0, fits[effects]) for effects, unnamed in keys]
    probabilities = (0.1, 0.3, 0.2, 0.4)
    chances = [Hypothesis(tuple(sorted(e)), u, p) for (e, u), p in zip(keys, probabilities, strict=True)]
    (other,) = rivals_of(problem, chosen, rows, chances)
    assert other.odds == pytest.approx(0.8)
    assert set(other.at) == WITH_OFFSET
    assert other.errors == pytest.approx(standard_errors(problem, offset))
    torque = other.variables[other.at["hysteresis"]] * offset.bounds.scale[other.at["hysteresis"]]
    assert torque == pytest.approx(4.0, rel=0.02), "the true friction, N.m"


def test_a_friction_that_is_less_beside_another_effect_may_be_less(fitted: Fitted) -> None:
    problem, chosen = fitted.problem, fitted.hysteresis
    (alone,) = named_effects(problem, chosen, fitted.base)
    at = problem.layout(chosen.names).effects["hysteresis"].start
    variables = chosen.bounds.to_free(chosen.parameters)
    less = np.where(np.arange(len(variables)) == at, 0.8 * variables, variables)
    other = Rival(0.5, {"hysteresis": at}, less, standard_errors(problem, chosen))
    (averaged,) = named_effects(problem, chosen, fitted.base, [other])
    torque, before = averaged.parameters["torque"], alone.parameters["torque"]
    assert torque.value == before.value
    assert torque.low < 0.8 * torque.value < before.low
    assert torque.high == pytest.approx(before.high, rel=1e-3)
    assert replace(averaged, parameters=alone.parameters) == alone
