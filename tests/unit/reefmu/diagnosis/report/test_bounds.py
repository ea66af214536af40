"""Parameters that stop at a bound of their range: which count, on which side their interval is open, what is said."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import power_base
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.probabilities.named_effects import named_effects
from reefmu.diagnosis.report.assemble import base_refusal
from reefmu.diagnosis.report.bounds import parameters_at_bounds
from reefmu.diagnosis.report.text import bound_text
from reefmu.diagnosis.schema import Gap
from reefmu.diagnosis.shared_exponent import SharedExponent, fixed_exponent_base
from reefmu.record import Record, make_record

PHASE = 2 * np.pi * np.arange(1600) / 400
TWIST = 2e-3 * np.sin(PHASE)


def record(torque: np.ndarray) -> Record:
    """Four loops of 40 s with a noise of 0.1 N.m."""
    noise = 0.1 * np.random.default_rng(0).standard_normal(len(TWIST))
    return make_record({"time": 0.1 * np.arange(len(TWIST)), "twist": TWIST, "output_torque": torque + noise}, "loops")


def power(exponent: float) -> np.ndarray:
    return 50 * np.sign(TWIST) * np.abs(TWIST / 2e-3) ** exponent


def fitted(measured: Record, shared: SharedExponent | None = None) -> tuple[Problem, Fit]:
    trace = make_trace(measured, None)
    problem = prepare_problem(
        measured, trace, power_base(trace) if shared is None else fixed_exponent_base(shared)(trace)
    )
    return problem, base_fit(problem)


@pytest.mark.parametrize(("exponent", "bound", "value"), [(12.0, "high", 6.0), (0.1, "low", 0.3)])
def test_an_exponent_at_its_bound_has_a_one_sided_interval(exponent: float, bound: str, value: float) -> None:
    (found,) = parameters_at_bounds(*fitted(record(power(exponent))))
    assert (found.parameter, found.bound, found.value) == ("exponent", bound, value)
    open_end, limit = (found.high, found.low) if bound == "high" else (found.low, found.high)
    assert open_end is None
    assert limit is not None
    assert 0 < abs(limit - value) < 0.5 * value
    assert f"exponent ended at its {'upper' if bound == 'high' else 'lower'} bound, {value:g}" in bound_text(found)
    assert ("at least" if bound == "high" else "at most") in bound_text(found)


def test_an_exponent_within_its_range_is_not_mentioned() -> None:
    assert parameters_at_bounds(*fitted(record(power(1.5)))) == ()


@pytest.mark.parametrize(("exponent", "refused"), [(1.5, False), (12.0, True)])
def test_a_gap_that_effects_mend_is_refused_only_if_they_stop_at_a_bound(exponent: float, refused: bool) -> None:
    problem, found = fitted(record(power(exponent)))
    spread = float(np.std(problem.trace.torque))
    assert bool(base_refusal(problem, found, Gap(2 * spread, 0.1 * spread, 0.1))) == refused
    assert "not of this gear" in base_refusal(problem, found, Gap(2 * spread, 2 * spread, 0.1))
    assert base_refusal(problem, found, Gap(0.5 * spread, 0.1 * spread, 0.1)) == ""


def test_a_shared_exponent_at_its_bound_is_mentioned_and_a_play_of_zero_is_a_result() -> None:
    problem, found = fitted(record(power(1.0)), SharedExponent(1.0, 1.0, 1.1))
    assert found.parameters[-1] == pytest.approx(0.0, abs=2e-5), "no play"
    (exponent,) = parameters_at_bounds(problem, found)
    assert (exponent.parameter, exponent.bound, exponent.low, exponent.high) == ("exponent", "low", None, None)
    assert parameters_at_bounds(*fitted(record(power(1.0)), SharedExponent(1.2, 1.1, 1.3))) == ()


def test_an_effect_parameter_at_its_bound_has_a_one_sided_interval() -> None:
    """Friction that reverses at once: its presliding twist is below what is fitted."""
    problem, base = fitted(record(power(1.5) + 4 * np.sign(np.cos(PHASE))))
    start = np.concatenate([base.parameters, [4.0, 1e-7]])
    found = problem.fit_from(("hysteresis",), start)
    (effect,) = named_effects(problem, found, base)
    presliding, torque = effect.parameters["presliding"], effect.parameters["torque"]
    assert (presliding.bound, presliding.warning, presliding.low) == ("low", "at its bound", presliding.value)
    assert presliding.high > presliding.value
    assert (torque.bound, torque.warning) == ("", "")
    (at_bound,) = parameters_at_bounds(problem, found)
    assert at_bound.parameter == "hysteresis.presliding"
    assert (at_bound.low, at_bound.high) == (None, pytest.approx(presliding.high, rel=0.05))
    assert "does not resolve" in at_bound.meaning
