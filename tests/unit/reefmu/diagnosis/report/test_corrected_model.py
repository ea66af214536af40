"""The written model comes as close to the record as its effects allow, and is not written where they do harm."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.commands.records.diagnose import diagnosis_text
from reefmu.diagnosis import Diagnosis, NamedEffect
from reefmu.diagnosis.estimation.held_out import held_out_blocks
from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.weighting import make_weighting
from reefmu.diagnosis.report.corrected_model import written_fit
from reefmu.diagnosis.report.html.next_commands import MODEL, next_commands
from reefmu.diagnosis.report.html.origin import Origin
from reefmu.diagnosis.report.text import cautions
from reefmu.diagnosis.schema import Gap
from tests.friction_record import fitted_friction

TWIST = 2e-3 * np.sin(np.linspace(0, 8 * np.pi, 1600))


def rms(values: np.ndarray) -> float:
    return float(np.sqrt(np.mean(values**2)))


def residual(problem: Problem, found: Fit) -> np.ndarray:
    return problem.torque - found.prediction.torque


@pytest.fixture(scope="module")
def beside_scatter() -> tuple[Problem, Fit]:
    """A fit whose zero is wrong by 0.2 mrad, a tenth of the twist, which a scatter of one drive takes up."""
    problem, found = fitted_friction(TWIST, None, ("hysteresis",))
    shifted = found.parameters + np.array([2e-4, *np.zeros(len(found.parameters) - 1)])
    prediction = problem.predictor(found.names)(shifted)
    taken_up = (found.prediction.torque - prediction.torque)[None]
    weights = make_weighting(problem.variance, taken_up)
    return problem, replace(found, parameters=shifted, prediction=prediction, weighting=weights)


def test_zero_and_base_curve_are_those_without_scatter(beside_scatter: tuple[Problem, Fit]) -> None:
    problem, found = beside_scatter
    _, without = fitted_friction(TWIST, None, ("hysteresis",))
    written = written_fit(problem, found)
    assert rms(residual(problem, found)) > 5 * rms(residual(problem, without))
    assert rms(residual(problem, written)) == pytest.approx(rms(residual(problem, without)), rel=0.02)
    base = problem.layout(()).n_base
    assert written.parameters[0] == pytest.approx(without.parameters[0], abs=5e-6)
    assert np.array_equal(written.parameters[base:], found.parameters[base:]), "effects are as they were found"
    assert written.weighting is found.weighting


def test_a_fit_without_scatter_is_the_written_one() -> None:
    problem, found = fitted_friction(TWIST, None, ("hysteresis",))
    assert written_fit(problem, found) is found


def test_blocks_that_are_held_out_do_not_count(beside_scatter: tuple[Problem, Fit]) -> None:
    problem, found = beside_scatter
    held = held_out_blocks(problem)
    spoilt = replace(problem)
    spoilt.__dict__["torque"] = problem.torque + np.where(held, 50.0, 0.0)
    assert written_fit(spoilt, found, held_out=True).parameters == pytest.approx(
        written_fit(problem, found, held_out=True).parameters, rel=1e-6
    )
    assert written_fit(spoilt, found).parameters[0] != pytest.approx(found.parameters[0], abs=1e-4)


@pytest.mark.parametrize(("after", "has_model"), [(4.0, True), (6.0, False)])
def test_effects_that_widen_the_gap_have_no_corrected_model(after: float, has_model: bool) -> None:
    diagnosis = Diagnosis("ambiguous", "", (NamedEffect("hysteresis", {}, 0.5),), (), (), Gap(5.0, after, 0.4), ())
    assert diagnosis.has_model == has_model
    told = "the gap does not shrink (5 to 6 N.m)"
    assert (told in diagnosis_text("record", diagnosis)) != has_model
    assert any(told in caution for caution in cautions(diagnosis)) != has_model
    assert any(MODEL in c.command for c in next_commands(diagnosis, Origin())) == has_model
    assert replace(diagnosis, effects=()).has_model
    assert not replace(diagnosis, verdict="insufficient").has_model
