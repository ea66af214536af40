"""A deviation that individuals of the population show is no gap; one that none of them shows is."""

from __future__ import annotations

import functools
import re
from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.analysis import Analysis
from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.inference.tolerance_curve import (
    curve_deviation,
    population_deviations,
    weights_of_curve_within_tolerance,
)
from reefmu.diagnosis.pipeline import analyse
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem, with_individuals
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.probabilities.assessment import stated_sizes
from reefmu.diagnosis.probabilities.hypothesis_table import hypothesis_table
from reefmu.diagnosis.random_effects.curve_columns import CURVE_DEGREE
from reefmu.diagnosis.schema import Diagnosis
from reefmu.model.contacts.tables import cached_lookup
from stiffness_model.numerics.arrays import Array
from tests import diagnosis_rig as rig

pytestmark = pytest.mark.slow


@functools.cache
def problem() -> Problem:
    record = rig.measured({}, noise=0.3, full=False)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    return with_individuals(prepare_problem(record, make_trace(record, rig.drive().ratio), base))


def with_residual(rest: Array) -> tuple[Problem, Fit]:
    """The record without effects with a residual (n,) added, and its fit without effects."""
    other = replace(problem(), weights=problem().weights)
    other.__dict__["torque"] = base_fit(problem()).prediction.torque + rest
    return other, base_fit(other)


@pytest.mark.parametrize("number", [0, 7, 23])
def test_an_individual_is_within_the_population(number: int) -> None:
    individual = problem().individuals[number]
    of, fit = with_residual(individual)
    assert population_deviations(of, fit, individual) < 4.0


def test_the_mean_drive_s_curve_may_be_off_as_far_as_those_of_individuals() -> None:
    """Scale, bend and curvature of the individuals' curves are three independent deviations of 1 under the weights,
    less where noise hides one, and impossible for the mean drive as drawn."""
    of, torque = problem(), base_fit(problem()).prediction.torque
    size = np.abs(torque) / np.abs(torque).max()
    curves = torque * np.stack([size**k for k in range(CURVE_DEGREE + 1)])
    smooth = of.individuals @ np.linalg.pinv(curves) @ curves
    weights = weights_of_curve_within_tolerance(of, torque)
    assert weights is not None
    squares = (weights.whiten(smooth.T) ** 2).sum(axis=0)
    assert CURVE_DEGREE < squares.mean() <= CURVE_DEGREE + 1
    assert (of.weights.for_mean_drive().whiten(smooth.T) ** 2).sum(axis=0).mean() > 1000 * squares.mean()
    assert weights_of_curve_within_tolerance(replace(of, scatter=None), torque) is None


def one_loop(number: int | None, **clearance: float) -> Diagnosis:
    """Diagnosis of one loop at one angle of the crank; number: of an individual, None for the mean drive; clearance:
    m."""
    record = rig.measured({"backlash": clearance} if clearance else {}, noise=0.3, full=False, seed=3)
    own = 0.0 if number is None else problem().individuals[number]
    return diagnose_record(replace(record, output_torque=record.output_torque + own), drive=rig.drive())


@pytest.mark.parametrize("number", [3, 4, 10])
def test_one_loop_of_an_individual_names_nothing(number: int) -> None:
    """At one angle an individual is as smooth as the mean drive, so that the lack of ripple proves nothing."""
    assert one_loop(number).verdict == "none"


@pytest.mark.parametrize("clearance", [4e-7, 8e-7, 1.6e-6])
def test_one_loop_of_the_mean_drive_shows_backlash(clearance: float) -> None:
    """The whole deviation is that of a clearance; an individual would have it only by chance."""
    found = one_loop(None, clearance=clearance)
    assert (found.verdict, [e.name for e in found.effects]) == ("named", ["backlash"])


def test_a_clearance_below_a_tenth_of_its_tolerance_is_nothing() -> None:
    assert one_loop(None, clearance=1e-7).verdict == "none"


@pytest.mark.parametrize("number", [0, 1, 7])
def test_one_loop_of_an_individual_shows_backlash_beyond_its_tolerances(number: int) -> None:
    """Only a scatter nearly three times as wide as the tolerances could explain it, which is less likely; one loop does
    not exclude it."""
    found = one_loop(number, clearance=4.2e-6)
    probability = {h.effects: h.probability for h in found.hypotheses if not h.unnamed}
    assert found.verdict in ("named", "ambiguous")
    assert [e.name for e in found.effects] == ["backlash"]
    assert probability["backlash",] > probability[()]
    assert found.effects[0].parameters["clearance"].value == pytest.approx(4.2e-6, rel=0.15)


def test_a_curve_that_deviates_within_the_tolerances_is_reported() -> None:
    record = rig.measured({}, noise=0.3, seed=3)
    torque = record.output_torque
    bent = replace(record, output_torque=torque * (1 + 0.02 * np.abs(torque) / np.abs(torque).max()))
    found = diagnose_record(bent, drive=rig.drive())
    assert found.verdict == "none"
    assert found.sentence.endswith("modulus or tolerance.")
    deviation = float(re.findall(r"the curve deviates by ([\d.]+) N\.m", found.sentence)[0])
    assert deviation == pytest.approx(np.sqrt(np.mean((bent.output_torque - torque) ** 2)), rel=0.2)


def test_nothing_missing_stands_for_a_curve_within_tolerance() -> None:
    record = rig.measured({}, noise=0.3, seed=3)
    stiffer = replace(record, output_torque=1.02 * record.output_torque)
    found = analyse(stiffer, BaseCurveSource(rig.drive()))
    assert isinstance(found, Analysis)
    rows = hypothesis_table(found.evidence, stated_sizes(found.evidence.problem))
    nothing = next(row for row in rows if not row.effects and not row.unnamed)
    assert nothing.fit.cost < found.evidence.search.base.cost - 100


def test_the_modulus_that_would_make_a_deviation_is_told_within_the_tolerances() -> None:
    of, names = problem(), ("modulus_error",)
    base = base_fit(of)
    assert curve_deviation(of, base) is None, "the record of the mean drive shows none"

    def softer(error: float) -> tuple[Problem, Fit]:
        change = of.predictor(names)(np.append(base.parameters, error)).torque - base.prediction.torque
        return with_residual(change + of.torque - base.prediction.torque)

    found = curve_deviation(*softer(0.04))
    assert found is not None
    assert found.modulus_error == pytest.approx(0.04, rel=0.1)
    assert curve_deviation(*softer(0.04 + 4 * found.population)) is None, "no drive of the drawing has such a curve"
    named = of.fit_from(names, np.append(base.parameters, 0.0))
    changed, _ = softer(0.04)
    own = curve_deviation(changed, changed.fit_from(names, named.parameters, changed.weights.for_mean_drive()))
    assert own is not None, "of a modulus that is named as well"
    assert own.modulus_error == pytest.approx(found.modulus_error, rel=0.02)
    spring = of.fit_from(("structural_compliance",), np.append(base.parameters, 1e-7))
    assert curve_deviation(of, spring) is None, "another effect has changed the curve"
