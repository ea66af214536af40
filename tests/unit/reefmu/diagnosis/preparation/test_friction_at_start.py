"""Friction that is built up when a run starts: its shares are found, cost what they should, and are not invented."""

from __future__ import annotations

import functools
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import uniform

from reefmu.diagnosis.analysis import Analysis
from reefmu.diagnosis.estimation.least_squares import HELD_SIZE, Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import MIN_GAIN, Search, base_fit
from reefmu.diagnosis.estimation.weighting import make_weighting
from reefmu.diagnosis.estimation.worker_pool import WorkerPool
from reefmu.diagnosis.forward.predictor import Predictor
from reefmu.diagnosis.inference.evidence import Evidence
from reefmu.diagnosis.pipeline import _searched_anew, analyse
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem, with_friction_at_start
from reefmu.diagnosis.preparation.friction_at_start import DEVIATION
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.effects import IndependentVariable
from reefmu.model import build_model
from reefmu.record import make_record, read_record
from reefmu.simulate import simulate_record
from stiffness_model.numerics.arrays import Array
from tests import diagnosis_rig as rig
from tests.friction_record import GEAR
from tests.validation.fingerprint import gradually
from tests.validation.fingerprint import record as record_as_csv

TWIST, OUTPUT = IndependentVariable.TWIST, IndependentVariable.OUTPUT
START = {"hysteresis": np.array([4.0, 2e-4]), "coulomb_friction": np.array([4.0, 1e-4])}
FRICTION = {
    "hysteresis": (TWIST, {"torque": 6.0, "presliding": 2e-4}),
    "coulomb_friction": (OUTPUT, {"torque": 6.0, "presliding": 1e-4}),
}


@functools.cache
def problem_of(*names: str) -> Problem:
    """A record of a catalogue gear with friction that is not built up when a run starts: loops with a locked output and
    with one that turns back and forth, four runs each."""
    phase = 2 * np.pi * np.arange(300) / 150
    parts = [(a * 1e-3 * np.sin(phase), o * (1 - np.cos(phase))) for a in (0.6, 1.0, 1.4, -1.0) for o in (0.0, 0.02)]
    twist, output = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    angles = {"crank_angle": GEAR.ratio * (twist + output), "output_angle": output}
    time, run = 0.05 * np.arange(len(twist)), np.repeat(np.arange(float(len(parts))), len(phase))
    record = make_record({"time": time, "run": run, **angles, "output_torque": 0 * time})
    effects = {name: FRICTION[name][1] for name in names}
    torque = simulate_record(build_model(GEAR, effects, inherent=False), record)["measured.tau"]
    record = replace(record, output_torque=torque + rig.noise_of(len(time), 0.3, 0.5, 0))
    trace = make_trace(record, GEAR.ratio)
    problem = prepare_problem(record, trace, BaseCurveSource(GEAR).base_curve(trace))
    scatter = np.array([np.sin(k * output / 0.02) * twist * 1e3 for k in (1, 2)])
    return replace(problem, weights=make_weighting(problem.variance, scatter))


def torque_of(problem: Problem, name: str, shares: Array) -> Array:
    """(samples,) N.m, torque of the true friction where shares (runs,) of it are built up when runs start."""
    path, values = FRICTION[name]
    trace = replace(problem.trace, friction={path: shares})
    return Predictor(trace, problem.base, (name,))(np.array([*problem.start(0.0), *values.values()])).torque


def with_shares(problem: Problem, name: str, shares: Array) -> Problem:
    """The problem of a record whose runs start with these shares (runs,) of the friction."""
    change = torque_of(problem, name, shares) - torque_of(problem, name, 0 * shares)
    return replace(problem, trace=replace(problem.trace, torque=problem.trace.torque + change))


def fits_of(problem: Problem, *names: str) -> list[Fit]:
    """The fits without effects and with the friction."""
    base = base_fit(problem)
    return [base, problem.fit_from(names, np.concatenate([base.parameters, *(START[name] for name in names)]))]


def runs(problem: Problem) -> int:
    return len(problem.trace.run_ranges)


@pytest.mark.parametrize("name", FRICTION)
def test_the_shares_are_found_where_they_are_there(name: str) -> None:
    """And the friction of the fit with them is the true one."""
    path, values = FRICTION[name]
    shares = np.random.default_rng(1).uniform(-1, 1, runs(problem_of(name)))
    problem = with_shares(problem_of(name), name, shares)
    base, released = fits_of(problem, name)
    found = with_friction_at_start(problem, [base, released])
    assert np.sqrt(np.mean((found.trace.friction[path] - shares) ** 2)) < 0.06
    built_up = found.fit_from((name,), released.parameters, released.weighting, HELD_SIZE)
    assert released.cost - built_up.cost - found.cost_of_start[path] > 100
    assert found.layout((name,)).by_effect(built_up.parameters)[name] == pytest.approx(values, rel=0.03)


@pytest.mark.parametrize("name", FRICTION)
def test_runs_that_start_released_stay_so(name: str) -> None:
    problem = problem_of(name)
    assert with_friction_at_start(problem, fits_of(problem, name)) is problem


def test_two_frictions_have_shares_of_their_own() -> None:
    """In runs with a locked output, at whose start that of the output stays; else both are gone after a few samples."""
    problem, shares = problem_of(*FRICTION), dict[str, Array]()
    for seed, name in enumerate(FRICTION):
        shares[name] = np.random.default_rng(seed).uniform(-1, 1, runs(problem))
        problem = with_shares(problem, name, shares[name])
    found = with_friction_at_start(problem, fits_of(problem, *FRICTION))
    for name, (path, _) in FRICTION.items():
        assert np.abs(found.trace.friction[path] - shares[name])[::2].max() < 0.1
    assert set(found.cost_of_start) == {TWIST, OUTPUT}


def test_friction_that_is_not_there_has_no_shares() -> None:
    """Not even where a set with it costs a little less."""
    problem, names = problem_of("hysteresis"), ("coulomb_friction", "hysteresis")
    problem = with_shares(problem, "hysteresis", np.random.default_rng(0).uniform(-1, 1, runs(problem)))
    base, alone = fits_of(problem, "hysteresis")
    own = alone.parameters[len(base.parameters) :]
    both = problem.fit_from(names, np.concatenate([base.parameters, [0.0, 1e-4], own]))
    assert alone.cost - 1.0 < both.cost < alone.cost
    assert set(with_friction_at_start(problem, [base, both, alone]).trace.friction) == {TWIST}


def test_a_set_that_explains_more_without_wins() -> None:
    """The shares must gain over every set, not only over their own."""
    problem = with_shares(problem_of("hysteresis"), "hysteresis", np.full(runs(problem_of("hysteresis")), 0.8))
    base, released = fits_of(problem, "hysteresis")
    started = with_friction_at_start(problem, [base, released])
    gain = released.cost - started.fit_from(released.names, released.parameters).cost - started.cost_of_start[TWIST]
    rival = replace(base, cost=released.cost - gain + MIN_GAIN / 2)
    assert with_friction_at_start(problem, [rival, released]) is problem


def test_the_cost_is_the_likelihood_averaged_over_the_shares() -> None:
    """That of random effects with one column per run, as a Gaussian covariance counts them."""
    name, path = "hysteresis", TWIST
    shares = np.random.default_rng(2).uniform(-0.9, 0.9, runs(problem_of(name)))
    problem = with_shares(problem_of(name), name, shares)
    found = with_friction_at_start(problem, fits_of(problem, name))
    fit = found.fit_from((name,), np.concatenate([base_fit(problem).parameters, START[name]]))
    one = np.eye(len(shares))
    released, *built_up = (
        problem.blocks.mean(Predictor(at, problem.base, (name,))(fit.parameters).torque)
        for at in (replace(problem.trace, friction={path: own}) for own in (0 * shares, *one))
    )
    columns = np.array(built_up).T - released[:, None]
    random = problem.weights.with_size(fit.weighting.size).with_random_effects(DEVIATION * columns)
    of_priors = fit.chi_square - float((fit.weighting.whiten(found.torque - fit.prediction.torque) ** 2).sum())
    wanted = random.cost(problem.torque - released) + of_priors
    assert fit.cost + found.cost_of_start[path] == pytest.approx(wanted, abs=0.5)
    assert pytest.approx(uniform(-1, 2).std()) == DEVIATION


def test_no_share_is_beyond_its_bounds() -> None:
    """Where the torque at the start of runs differs by more than friction can hold, it is not explained by it."""
    name = "hysteresis"
    problem = with_shares(problem_of(name), name, np.full(runs(problem_of(name)), 1.8))
    found = with_friction_at_start(problem, fits_of(problem, name))
    assert np.abs(found.trace.friction[TWIST]).max() == 1.0


def test_the_likeliest_effect_goes_on_where_all_sets_are_fitted_anew() -> None:
    """Also where nothing leads a search to it, as here, where there are no candidates."""
    problem = replace(problem_of("hysteresis"), candidates=())
    base, known = fits_of(problem, "hysteresis")
    before = Evidence(problem, Search(base, {0: [base], 1: [known]}))
    (found,) = _searched_anew(before, WorkerPool(problem), lambda stage, share: None).search.best[1]
    assert found.names == ("hysteresis",)
    assert found.cost == pytest.approx(known.cost, abs=0.01)


def test_friction_that_is_built_up_from_the_start_needs_no_damping(tmp_path: Path) -> None:
    """Without a drawing. Of friction that is released at the start, less beside a damping would fit better. At a locked
    crank friction of the twist and of the output are one."""
    file = tmp_path / "record.csv"
    file.write_text(record_as_csv(gradually), encoding="utf-8")
    found = analyse(read_record(file))
    assert isinstance(found, Analysis)
    assert found.diagnosis.verdict == "ambiguous"
    (effect,) = found.diagnosis.effects
    likeliest = {hypothesis.effects for hypothesis in found.diagnosis.hypotheses[:2]}
    assert likeliest == {("hysteresis",), ("coulomb_friction",)}
    assert sum(h.probability for h in found.diagnosis.hypotheses if "damping" in h.effects) < 0.05
    assert effect.parameters["torque"].low < 6.0 < effect.parameters["torque"].high
    assert any("built up when runs start" in note for note in found.diagnosis.notes)
