"""A deviation that individuals of the population show is no gap; one that none of them shows is."""

from __future__ import annotations

import functools
import re
from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.estimation.weighting import INDIVIDUAL_SIZE
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.inference.individual_drive import (
    MAX_POPULATION_DEVIATIONS,
    as_individual,
    may_be_individual,
    population_deviations,
    residual_outside_population,
)
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.schema import Diagnosis
from reefmu.model.contacts.tables import cached_lookup
from stiffness_model.numerics.arrays import Array
from tests import diagnosis_rig as rig

pytestmark = pytest.mark.slow


@functools.cache
def problem() -> Problem:
    record = rig.measured({}, noise=0.3, full=False)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    return prepare_problem(record, make_trace(record, rig.drive().ratio), base)


def with_residual(rest: Array) -> tuple[Problem, Fit]:
    """The record without effects with a residual (n,) added, and its fit without effects."""
    other = replace(problem(), weights=problem().weights)
    other.__dict__["torque"] = base_fit(problem()).prediction.torque + rest
    return other, base_fit(other)


@pytest.mark.parametrize("number", [0, 7, 23])
def test_an_individual_is_within_the_population(number: int) -> None:
    individual = problem().individuals[number]
    of, fit = with_residual(individual)
    assert residual_outside_population(of, fit) == 0.0
    assert population_deviations(of, fit, individual) < 4.0


@pytest.mark.parametrize("less", [True, False])
def test_a_residual_larger_or_smaller_than_of_any_individual_is_outside(less: bool) -> None:
    """A small misfit that has not the form of scatter is outside too: an individual would deviate by more."""
    zero = base_fit(problem()).prediction.sensitivities[:, 0]
    drives = problem().individuals
    # The twist's zero is free.
    each = np.sqrt(np.mean((drives - np.outer(drives @ zero, zero) / (zero @ zero)) ** 2, axis=1))
    greatest = max(each.max(), MAX_POPULATION_DEVIATIONS * np.sqrt(np.mean(each**2)))
    rest = each.min() / 1.5 if less else greatest * 1.5
    size = np.sqrt(rest**2 + np.mean(problem().block_variance))
    of, fit = with_residual(np.sqrt(2) * size * np.sin(np.arange(problem().individuals.shape[1])))
    assert residual_outside_population(of, fit) > 0.5 * rest


def test_a_mean_drive_fitted_as_an_individual_is_less_likely() -> None:
    fit = base_fit(problem())
    assert fit.weighting.size < INDIVIDUAL_SIZE
    single = as_individual(problem(), fit)
    assert single.weighting.size >= INDIVIDUAL_SIZE
    assert single.cost > fit.cost


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


def test_one_loop_of_the_mean_drive_does_not_decide_about_a_sixth_of_a_tolerance() -> None:
    found = one_loop(None, clearance=2e-7)
    likeliest = max(found.hypotheses, key=lambda h: h.probability)
    assert (found.verdict, likeliest.effects) == ("ambiguous", ("backlash",))


@pytest.mark.parametrize("clearance", [4e-7, 8e-7, 1.6e-6])
def test_one_loop_of_the_mean_drive_shows_backlash(clearance: float) -> None:
    """The whole deviation is that of a clearance; an individual would have it only by chance."""
    found = one_loop(None, clearance=clearance)
    assert (found.verdict, [e.name for e in found.effects]) == ("named", ["backlash"])


@pytest.mark.parametrize("number", [0, 7])
def test_one_loop_of_an_individual_shows_backlash_beyond_its_tolerances(number: int) -> None:
    """Only a scatter wider than the tolerances could explain it, and such a scatter does not count."""
    found = one_loop(number, clearance=4.2e-6)
    assert (found.verdict, [e.name for e in found.effects]) == ("named", ["backlash"])
    assert found.effects[0].parameters["clearance"].value == pytest.approx(4.2e-6, rel=0.15)


def test_backlash_at_the_limit_of_the_tolerances_stays_open() -> None:
    found = one_loop(7, clearance=2.6e-6)
    assert found.verdict == "unknown"
    assert found.alternatives == (("backlash",),)
    assert "backlash together with this drive's own tolerances may" in found.sentence


def test_effects_that_tolerances_may_mask_are_reported() -> None:
    """One loop of an individual with a small clearance: most individuals of the drawing deviate by as much."""
    found = one_loop(5, clearance=8e-7)
    assert (found.verdict, found.effects) == ("none", ())
    assert ("backlash",) in found.alternatives
    assert "tolerances may mask backlash" in found.sentence
    assert any("backlash" in line and "second drive" in line for line in found.next_experiment)


def test_a_curve_that_deviates_within_the_tolerances_is_reported() -> None:
    record = rig.measured({}, noise=0.3, seed=3)
    torque = record.output_torque
    bent = replace(record, output_torque=torque * (1 + 0.02 * np.abs(torque) / np.abs(torque).max()))
    found = diagnose_record(bent, drive=rig.drive())
    assert found.verdict == "none"
    deviation = float(re.findall(r"the curve deviates by ([\d.]+) N\.m", found.sentence)[0])
    assert deviation == pytest.approx(np.sqrt(np.mean((bent.output_torque - torque) ** 2)), rel=0.2)


def test_an_effect_that_makes_the_scatter_plausible_is_not_put_down_to_scatter() -> None:
    """A kinematic error acts like the scatter of the lobes, but not where the scatter would have to be twice as
    wide."""
    base = base_fit(problem())
    named = replace(as_individual(problem(), base), names=("kinematic_error",))
    named = replace(named, weighting=named.weighting.with_size(0.75))
    for size, may in ((1.0, True), (2.8, False)):
        without = replace(named, names=(), cost=named.cost + 2000, weighting=named.weighting.with_size(size))
        assert may_be_individual(problem(), named, base, without, "kinematic_error", 1.0) is may
