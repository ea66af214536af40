"""What single drives of the population do by themselves is no gap; what none of them does is one."""

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
from reefmu.diagnosis.inference.individual_drive import may_be_individual
from reefmu.diagnosis.inference.population_spread import (
    as_individual_drive,
    population_deviations,
    residual_outside_population,
)
from reefmu.diagnosis.pipeline import prepare_problem
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
    return prepare_problem(record, make_trace(record, rig.drive().ratio), base)[0]


def with_residual(rest: Array) -> tuple[Problem, Fit]:
    """The clean record with something added to it, and its fit without effects."""
    other = replace(problem(), weights=problem().weights)
    other.__dict__["torque"] = base_fit(problem()).prediction.torque + rest
    return other, base_fit(other)


@pytest.mark.parametrize("number", [0, 7, 23])
def test_a_single_drive_is_like_the_population(number: int) -> None:
    single = problem().individuals[number]
    of, fit = with_residual(single)
    assert residual_outside_population(of, fit) == 0.0
    assert population_deviations(of, fit, single) < 4.0


@pytest.mark.parametrize("less", [True, False])
def test_more_and_less_than_any_single_drive_is_not(less: bool) -> None:
    """A misfit of another form than the scatter's may be small: an individual would differ by more."""
    each = np.sqrt(np.mean(problem().individuals ** 2, axis=1))
    rest = each.min() / 1.5 if less else each.max() * 1.5
    size = np.sqrt(rest**2 + np.mean(problem().block_variance))
    of, fit = with_residual(np.sqrt(2) * size * np.sin(np.arange(problem().individuals.shape[1])))
    assert residual_outside_population(of, fit) > 0.5 * rest


def test_as_an_individual_a_drive_scatters() -> None:
    fit = base_fit(problem())
    assert fit.weighting.size < INDIVIDUAL_SIZE
    single = as_individual_drive(problem(), fit)
    assert single.weighting.size >= INDIVIDUAL_SIZE
    assert single.cost > fit.cost


def one_loop(number: int | None, **clearance: float) -> Diagnosis:
    """Of one loop at one angle of the crank: the mean drive, or a single one, with a clearance, m."""
    record = rig.measured({"backlash": clearance} if clearance else {}, noise=0.3, full=False, seed=3)
    own = 0.0 if number is None else problem().individuals[number]
    return diagnose_record(replace(record, output_torque=record.output_torque + own), drive=rig.drive())


@pytest.mark.parametrize("number", [3, 4, 10])
def test_one_loop_of_a_single_drive_names_nothing(number: int) -> None:
    """At one angle it is as smooth as the mean drive: that it does not ripple is no sign of the mean drive."""
    assert one_loop(number).verdict == "none"


@pytest.mark.parametrize("clearance", [2e-7, 4e-7, 1.6e-6])
def test_one_loop_shows_play_that_no_single_drive_has(clearance: float) -> None:
    """All there is follows the play: a single drive would have to differ by chance in this one direction."""
    found = one_loop(None, clearance=clearance)
    assert (found.verdict, [e.name for e in found.effects]) == ("named", ["backlash"])


@pytest.mark.parametrize("number", [0, 7])
def test_one_loop_of_a_single_drive_shows_play_beyond_its_tolerances(number: int) -> None:
    """A scatter wider than the tolerances make could explain it, so it does not count."""
    found = one_loop(number, clearance=2.4e-6)
    assert (found.verdict, [e.name for e in found.effects]) == ("named", ["backlash"])
    assert found.effects[0].parameters["clearance"].value == pytest.approx(2.4e-6, rel=0.15)


def test_one_loop_at_the_edge_of_the_tolerances_is_said_to_be_open() -> None:
    found = one_loop(0, clearance=1.6e-6)
    assert found.verdict == "unknown"
    assert found.alternatives == (("backlash",),)
    assert "backlash and this drive's own tolerances together may" in found.sentence


def test_what_tolerances_may_hide_is_told() -> None:
    """One loop of a single drive with a little play: most single drives of the drawing differ by as much."""
    found = one_loop(3, clearance=8e-7)
    assert (found.verdict, found.effects) == ("none", ())
    assert ("backlash",) in found.alternatives
    assert "tolerances may hide backlash" in found.sentence
    assert any("backlash" in line and "second drive" in line for line in found.next_experiment)


def test_a_curve_that_is_off_within_the_tolerances_is_told() -> None:
    record = rig.measured({}, noise=0.3, seed=3)
    torque = record.output_torque
    bent = replace(record, output_torque=torque * (1 + 0.02 * np.abs(torque) / np.abs(torque).max()))
    found = diagnose_record(bent, drive=rig.drive())
    assert found.verdict == "none"
    off = float(re.findall(r"the curve is off by ([\d.]+) N\.m", found.sentence)[0])
    assert off == pytest.approx(np.sqrt(np.mean((bent.output_torque - torque) ** 2)), rel=0.2)


def test_a_name_that_brings_a_scatter_back_within_the_tolerances_is_none_of_it() -> None:
    """A kinematic error does what lobes do; but not if single drives would have to scatter twice as much for it."""
    base = base_fit(problem())
    named = replace(as_individual_drive(problem(), base), names=("kinematic_error",))
    named = replace(named, weighting=named.weighting.with_size(0.75))
    for size, may in ((1.0, True), (2.8, False)):
        without = replace(named, names=(), cost=named.cost + 2000, weighting=named.weighting.with_size(size))
        assert may_be_individual(problem(), named, base, without, "kinematic_error", 1.0) is may
