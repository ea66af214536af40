"""The table of hypotheses: marginal likelihoods by quadrature, and rows in the order of the evidence."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import dblquad, quad

from reefmu.diagnosis.calibrated_odds import PRIOR_WIDTH
from reefmu.diagnosis.estimation.least_squares import HELD_SIZE
from reefmu.diagnosis.estimation.residuals import remainder
from reefmu.diagnosis.estimation.search import Search
from reefmu.diagnosis.hypotheses import Hypothesis
from reefmu.diagnosis.inference.evidence import Evidence
from reefmu.diagnosis.probabilities.assessment import record_isolability, record_sizes
from reefmu.diagnosis.probabilities.hypothesis_table import hypothesis_table
from reefmu.diagnosis.probabilities.marginal_likelihood import (
    log_evidence_of_faint,
    log_volume,
    material_effects,
    parameter_prior,
)
from reefmu.effects import IndependentVariable, find_effect
from tests import diagnosis_rig as rig
from tests.unit.reefmu.diagnosis.probabilities.conftest import Fitted, evidence_of

NOTHING, HYSTERESIS = frozenset[str](), frozenset({"hysteresis"})


def test_the_volume_is_the_integral_of_likelihood_times_prior(fitted: Fitted) -> None:
    """One amplitude beside one base parameter, which covary: Laplace's approximation against quadrature."""
    problem, size = fitted.problem, 14.0
    curvature = np.array([[9.0, 4.0], [4.0, 6.0]])
    n_base = problem.layout(()).n_base
    whole, parameters = np.eye(n_base + 1), np.zeros(n_base + 1)
    whole[np.ix_([0, n_base], [0, n_base])] = curvature
    parameters[-1] = 2.5
    names = ("torque_sensor_offset",)
    start = replace(fitted.base, names=names, parameters=parameters, curvature=whole, bounds=problem.bounds(names))
    unit = float(start.bounds.scale[-1])
    width = PRIOR_WIDTH * size / unit

    def likelihood(base: float, amplitude: float) -> float:
        v = np.array([base, amplitude])
        return math.exp(-0.5 * float(v @ curvature @ v))

    def joint(base: float, amplitude: float) -> float:
        prior = 1 / (math.pi * width * (1 + ((amplitude + 2.5 / unit) / width) ** 2))
        return likelihood(base, amplitude) * prior

    both = dblquad(joint, -6, 6, -6, 6)[0]
    alone = math.sqrt(2 * math.pi / curvature[0, 0])
    found = log_volume(problem, start, {"torque_sensor_offset.torque": size}, 1.0)
    assert found == pytest.approx(math.log(both / alone), abs=0.05)


@pytest.mark.parametrize(
    ("name", "parameter", "low", "high"),
    [
        ("torque_sensor_offset", "torque", -np.inf, np.inf),
        ("hysteresis", "torque", 0.0, np.inf),
        ("kinematic_error", "phase_1", -np.pi, np.pi),
        ("missing_ball", "windup", 0.0, 1.0),
    ],
)
def test_priors_are_densities(name: str, parameter: str, low: float, high: float) -> None:
    """Over the range of a parameter, in the units in which it is fitted, they integrate to 1."""
    declared = next(p for p in find_effect(name).parameters if p.name == parameter)
    unit = 0.25
    whole = quad(lambda x: math.exp(parameter_prior(declared, unit * x, 3.0, unit)[0]), low / unit, high / unit)[0]
    assert whole == pytest.approx(1.0, rel=1e-4)


def test_of_several_fits_of_a_set_the_best_counts(fitted: Fitted) -> None:
    better = fitted.hysteresis
    worse = replace(better, cost=better.cost + 60.0)
    sizes = record_sizes(fitted.problem)
    for fits in ([better, worse], [worse, better]):
        evidence = evidence_of(fitted)
        evidence = replace(evidence, search=Search(fitted.base, {0: [fitted.base], 1: fits}))
        both = {(r.effects, r.unnamed): r for r in hypothesis_table(evidence, sizes)}
        alone = {(r.effects, r.unnamed): r for r in hypothesis_table(evidence_of(fitted), sizes)}
        assert both[HYSTERESIS, False].log_evidence == pytest.approx(alone[HYSTERESIS, False].log_evidence)


def test_sets_with_friction_pay_for_what_is_built_up_of_it_when_runs_start(fitted: Fitted) -> None:
    evidence, sizes = evidence_of(fitted), record_sizes(fitted.problem)
    costs = {IndependentVariable.TWIST: 50.0, IndependentVariable.OUTPUT: 500.0}
    built_up = replace(evidence, problem=replace(fitted.problem, cost_of_start=costs))
    free, paid = ({(r.effects, r.unnamed): r for r in hypothesis_table(e, sizes)} for e in (evidence, built_up))
    before, after = free[HYSTERESIS, False], paid[HYSTERESIS, False]
    assert before.log_evidence - after.log_evidence == pytest.approx(50.0 / 2, rel=0.1)
    assert paid[NOTHING, False].log_evidence == free[NOTHING, False].log_evidence


def test_the_size_of_a_clearance_is_the_drawing_s_deviation(fitted: Fitted) -> None:
    drawn = replace(fitted.problem, base=replace(fitted.problem.base, drive=rig.drive()))
    assert record_sizes(drawn)["backlash.clearance"] == rig.drive().tolerances["gear"].sigma
    assert record_sizes(fitted.problem)["backlash.clearance"] == find_effect("backlash").parameters[0].nominal


def test_a_record_that_tells_little_leaves_a_larger_volume(fitted: Fitted) -> None:
    sizes = record_sizes(fitted.problem)
    sharp = log_volume(fitted.problem, fitted.hysteresis, sizes, 1.0)
    assert log_volume(fitted.problem, fitted.hysteresis, sizes, 4.0) > sharp
    assert log_volume(fitted.problem, fitted.base, sizes, 1.0) == 0.0


def test_the_evidence_of_a_faint_effect_is_that_of_its_fit(fitted: Fitted) -> None:
    """An offset is linear, so that what its score says is what a fit says."""
    problem, size = fitted.problem, {"torque_sensor_offset.torque": 0.5}
    problem = replace(problem, trace=replace(problem.trace, torque=problem.trace.torque + 1.2))
    base = fitted.hysteresis
    names = (*base.names, "torque_sensor_offset")
    found = problem.fit_from(names, np.append(base.parameters, 0.0), base.weighting, HELD_SIZE)
    again = problem.fit_from(base.names, base.parameters, base.weighting, HELD_SIZE)
    volume = log_volume(problem, found, size, 2.0) - log_volume(problem, again, size, 2.0)
    expected = (again.cost - found.cost) / (2 * 2.0) + volume
    assert expected > 10
    assert log_evidence_of_faint(problem, again, names[-1], size, 0.1, 2.0) == pytest.approx(expected, rel=0.02)


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("torque_sensor_offset", math.log(1 - 2 / math.pi * math.atan(0.1 / PRIOR_WIDTH))),
        ("hysteresis", math.log(1 - 2 / math.pi * math.atan(0.1 / PRIOR_WIDTH))),
        ("kinematic_error", 0.0),
    ],
)
def test_a_record_that_says_nothing_leaves_the_prior(fitted: Fitted, name: str, expected: float) -> None:
    """That of amplitudes that are large enough to count."""
    sizes = record_sizes(fitted.problem)
    found = log_evidence_of_faint(fitted.problem, fitted.base, name, sizes, 0.1, 1e30)
    assert found == pytest.approx(expected, abs=2e-3)


def test_what_has_no_evidence_does_not_show(fitted: Fitted) -> None:
    """Beside the true effect every other one may be missing, and none of these shows. (Of friction inside and at the
    output, which are one here, either shows.)"""
    rows = hypothesis_table(evidence_of(fitted), record_sizes(fitted.problem))
    beside = [r for r in rows if len(r.effects) == 2 and not r.unnamed]
    assert {name for r in beside for name in r.effects - HYSTERESIS} == set(fitted.problem.candidates) - HYSTERESIS
    beside = [r for r in beside if r.effects != HYSTERESIS | {"coulomb_friction"}]
    assert all(r.faint == r.effects - HYSTERESIS for r in beside)
    assert all(r.shown_as(0.1) == Hypothesis(("hysteresis",), False, 0.1) for r in beside)
    (own,) = (r for r in rows if r.effects == HYSTERESIS and not r.unnamed)
    assert not own.faint


def test_what_every_drive_deviates_by_is_immaterial_and_small_friction_is_not(fitted: Fitted) -> None:
    """An offset of the torque is like that of an individual drive without load; no tolerance makes friction, which is
    missing however small it is."""
    offset = fitted.problem.fit_from(("torque_sensor_offset",), np.append(fitted.base.parameters, 0.2))
    for fit, key, below in (
        (offset, "torque_sensor_offset.torque", NOTHING),
        (fitted.hysteresis, "hysteresis.torque", HYSTERESIS),
    ):
        (name,) = fit.names
        size = abs(float(fit.parameters[fitted.problem.layout(fit.names).effects[name].start]))
        assert material_effects(fitted.problem, fit, {key: size / 0.11}, 0.1) == {name}
        assert material_effects(fitted.problem, fit, {key: size / 0.09}, 0.1) == below
        assert material_effects(fitted.problem, fit, {}, 0.1) == {name}


def test_each_hypothesis_has_one_row_and_the_truth_the_most_evidence(fitted: Fitted) -> None:
    rows = hypothesis_table(evidence_of(fitted), record_sizes(fitted.problem))
    keys = [(r.effects, r.unnamed) for r in rows if not r.is_hidden]
    assert len(keys) == len(set(keys))
    assert set(keys) >= {(NOTHING, False), (HYSTERESIS, False), (NOTHING, True)}
    assert all(r.beside is None or r.beside.gain > 0 for r in rows)
    evidence = {(r.effects, r.unnamed): r.log_evidence for r in rows if not r.is_hidden}
    assert evidence[HYSTERESIS, False] > evidence[NOTHING, True]
    assert evidence[HYSTERESIS, False] > evidence[NOTHING, False] + 50


def test_something_unnamed_that_does_not_show_has_the_evidence_of_the_effects_alone(fitted: Fitted) -> None:
    rows = hypothesis_table(evidence_of(fitted), record_sizes(fitted.problem))
    alone = {r.effects: r.log_evidence for r in rows if not r.unnamed}
    assert {r.effects: r.log_evidence for r in rows if r.is_hidden} == alone
    assert all(r.unnamed for r in rows if r.is_hidden)


def test_what_every_drive_deviates_by_is_nothing(fitted: Fitted) -> None:
    problem, name = fitted.problem, "torque_sensor_offset"
    offset = problem.fit_from((name,), np.append(fitted.base.parameters, 0.2))
    evidence = Evidence(problem, Search(fitted.base, {0: [fitted.base], 1: [fitted.hysteresis, offset]}))

    def sets(typical: float) -> set[frozenset[str]]:
        return {r.effects for r in hypothesis_table(evidence, record_sizes(problem) | {f"{name}.torque": typical})}

    size = abs(float(offset.parameters[-1]))
    assert frozenset({name}) in sets(size / 0.11) - sets(size / 0.09)


def test_a_set_that_the_record_hardly_tells_from_the_likeliest_is_a_hypothesis(fitted: Fitted) -> None:
    """With a locked crank, friction at the output makes the same torque as friction inside; no search fitted it."""
    rows = hypothesis_table(evidence_of(fitted), record_sizes(fitted.problem))
    evidence = {r.effects: r.log_evidence for r in rows if not r.unnamed}
    other = frozenset({"coulomb_friction"})
    assert evidence[other] == pytest.approx(evidence[HYSTERESIS], abs=0.1)


def test_something_unnamed_that_shows_has_a_torque(fitted: Fitted) -> None:
    problem, base = fitted.problem, fitted.base
    rows = hypothesis_table(evidence_of(fitted), record_sizes(problem))
    (row,) = (r for r in rows if r.effects == NOTHING and r.unnamed and not r.is_hidden)
    assert row.beside is not None
    assert row.beside.rms > 0.5 * remainder(problem, base) > 0
    assert all(r.beside is None for r in rows if not r.unnamed)


def test_isolability_of_one_loop(fitted: Fitted) -> None:
    """A locked crank does not show whether friction is inside or at the output; an offset it shows."""
    found = record_isolability(fitted.problem, fitted.base, fitted.base, record_sizes(fitted.problem))
    place = {name: k for k, name in enumerate(found.names)}
    matrix = np.array(found.matrix)
    assert matrix.shape == (len(place), len(place))
    assert (matrix >= 0).all()
    assert (matrix.sum(axis=1) <= 1 + 1e-9).all()
    assert matrix[place["hysteresis"], place["hysteresis"]] < 0.6
    assert matrix[place["torque_sensor_offset"], place["torque_sensor_offset"]] > 0.9


def test_what_the_base_model_absorbs_is_not_named(fitted: Fitted) -> None:
    """With a free offset in the base model an offset of the sensor leaves nothing."""
    prediction = fitted.base.prediction
    columns = np.concatenate([prediction.sensitivities, np.ones((len(prediction.torque), 1))], axis=1)
    bounds = fitted.base.bounds
    bounds = replace(bounds, prior_deviation=np.append(bounds.prior_deviation, np.inf))
    base = replace(fitted.base, prediction=replace(prediction, sensitivities=columns), bounds=bounds)
    found = record_isolability(fitted.problem, base, fitted.base, record_sizes(fitted.problem))
    place = found.names.index("torque_sensor_offset")
    assert found.matrix[place][place] == 0
