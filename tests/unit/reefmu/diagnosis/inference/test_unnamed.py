"""What exceeds noise and tolerances, and effects that are fitted beside something unnamed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.estimation.weighting import Weighting, make_weighting
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.inference.nonparametric import fit_terms, fit_terms_to
from reefmu.diagnosis.inference.unnamed import (
    EXCESS,
    FURTHER_NOISE,
    FURTHER_SCATTER,
    NO_EXCESS,
    Excess,
    excess_gain,
    excess_part,
    fit_beside,
    likeliest_excess,
    strongest_beside,
    strongest_term,
)
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model.contacts.tables import cached_lookup
from stiffness_model.numerics.arrays import Array
from tests import diagnosis_rig as rig
from tests.friction_record import fitted_friction

ERROR, NAMES = 0.05, ("modulus_error",)
BLOCKS, COMPONENTS = 200, 20


def _weighting(seed: int, size: float) -> tuple[Weighting, Array, Array, np.random.Generator]:
    """A weighting with the covariances of its noise and of its scatter at size 1, (n, n) each."""
    rng = np.random.default_rng(seed)
    variance = rng.uniform(0.5, 2.0, BLOCKS)
    columns = 3.0 * rng.standard_normal((COMPONENTS, BLOCKS))
    return make_weighting(variance, columns, size), np.diag(variance), columns.T @ columns, rng


def _cost(covariance: Array, values: Array) -> float:
    return float(values @ np.linalg.solve(covariance, values) + np.linalg.slogdet(covariance)[1])


@given(
    st.integers(0, 1000),
    st.sampled_from([0.25, 1.0]),
    st.sampled_from(FURTHER_SCATTER),
    st.sampled_from(FURTHER_NOISE[:6]),
)
def test_an_excess_is_a_wider_covariance(seed: int, size: float, further: float, noise: float) -> None:
    """Gain, whitening and expected part, compared with those of the dense covariances."""
    weights, of_noise, of_scatter, rng = _weighting(seed, size)
    allowed, excess = of_noise + size**2 * of_scatter, noise**2 * of_noise + further**2 * of_scatter
    values, found = 3.0 * rng.standard_normal(BLOCKS), Excess(further, noise)
    gain = _cost(allowed, values) - _cost(allowed + excess, values)
    assert excess_gain(weights, values, found) == pytest.approx(gain, rel=1e-8, abs=1e-8)
    white = found.added_to(weights).whiten(values)
    assert white @ white == pytest.approx(values @ np.linalg.solve(allowed + excess, values), rel=1e-8)
    expected = excess @ np.linalg.solve(allowed + excess, values)
    np.testing.assert_allclose(excess_part(weights, values, found), expected, rtol=1e-7, atol=1e-9)


@pytest.mark.parametrize("excess", [NO_EXCESS, Excess(2.6, 0.0), Excess(0.0, FURTHER_NOISE[4]), Excess(1.7, 3.0)])
def test_the_likeliest_excess_is_the_true_one(excess: Excess) -> None:
    """To a step of the grid, and with none where there is none."""
    weights, of_noise, of_scatter, rng = _weighting(1, 1.0)
    covariance = (1 + excess.noise**2) * of_noise + (1 + excess.further**2) * of_scatter
    gain, found = likeliest_excess(weights, np.linalg.cholesky(covariance) @ rng.standard_normal(BLOCKS))
    assert (gain > 10.0) is (excess != NO_EXCESS)
    for true, fitted in ((excess.noise, found.noise), (excess.further, found.further)):
        assert np.hypot(1, fitted) == pytest.approx(np.hypot(1, true), rel=0.45)


def test_a_mean_drive_has_no_wider_tolerances() -> None:
    weights, _, of_scatter, rng = _weighting(2, 0.007)
    values = np.linalg.cholesky(of_scatter + 1e-9 * np.eye(BLOCKS)) @ rng.standard_normal(BLOCKS)
    assert likeliest_excess(weights, values)[1].further == 0.0


@pytest.fixture(scope="module")
def friction() -> tuple[Problem, Fit]:
    """A record of loops with a locked crank, and the fit of the friction in it."""
    return fitted_friction(1.5e-3 * np.sin(2 * np.pi * np.arange(1600) / 400), None, ("hysteresis",))


def test_what_shows_in_no_coordinate_is_told_as_an_excess(friction: tuple[Problem, Fit]) -> None:
    problem, fit = friction
    rough = problem.torque - fit.prediction.torque
    rough = rough + 3 * np.sqrt(problem.variance) * np.random.default_rng(3).standard_normal(len(rough))
    term = strongest_term(problem, fit, rough)
    assert term.term is EXCESS
    assert term.gain > 100
    assert np.corrcoef(term.torque, rough)[0, 1] > 0.99


def test_a_coordinate_is_found_beside_an_excess(friction: tuple[Problem, Fit]) -> None:
    """Together they gain more than either, and the part of both is what was added."""
    problem, fit = friction
    rng, time = np.random.default_rng(3), problem.blocks.mean(problem.trace.time)
    wave = 8 * np.sqrt(problem.variance) * np.sin(2 * np.pi * 37 * time / time[-1])
    added = wave + 3 * np.sqrt(problem.variance) * rng.standard_normal(len(time))
    residual = problem.torque - fit.prediction.torque + added
    term = strongest_term(problem, fit, residual)
    assert term.term.coordinate.startswith("time, period")
    assert term.gain > fit_terms_to(problem, fit, residual)[0].gain + 100
    assert term.gain > likeliest_excess(fit.weighting, residual)[0] + 100
    assert np.std(term.torque - added) < 0.5 * np.std(added - wave)


def _fitted(ripple: float) -> tuple[Problem, Fit]:
    """A record with a modulus error and a ripple over the twist that no effect makes, N.m, and the fit of the error."""
    record = rig.measured({"modulus_error": {"error": ERROR}}, noise=0.3)
    twist = record.twist(rig.drive().ratio)
    wave = ripple * np.sin(14 * np.pi * twist / rig.drive().max_twist)
    record = replace(record, output_torque=record.output_torque + wave)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    problem = prepare_problem(record, make_trace(record, rig.drive().ratio), base)
    start = np.append(base_fit(problem).parameters, 0.01)
    return problem, problem.fit_from(NAMES, start)


@pytest.mark.slow
def test_a_ripple_does_not_distort_the_effects_beside_it() -> None:
    problem, alone = _fitted(9.0)
    own, term = fit_beside(problem, alone, strongest_beside(problem, alone))
    assert own.cost - term.gain < alone.cost - fit_terms(problem, alone)[0].gain - 10
    assert own.weighting.size < alone.weighting.size
    found, before = (problem.layout(NAMES).by_effect(fit.parameters)["modulus_error"]["error"] for fit in (own, alone))
    assert abs(found - ERROR) < 0.5 * abs(before - ERROR)
    # The cost is that of the whole residual, which the fit does not minimise.
    assert own.cost == pytest.approx(own.weighting.cost(problem.torque - own.prediction.torque), rel=1e-3)


@pytest.mark.slow
def test_a_fit_beside_which_nothing_is_missing_stays_as_it_is() -> None:
    problem, alone = _fitted(0.0)
    own, term = fit_beside(problem, alone, strongest_beside(problem, alone))
    assert own.cost - term.gain <= alone.cost - fit_terms(problem, alone)[0].gain
    if term.gain <= 0:
        assert own is alone
