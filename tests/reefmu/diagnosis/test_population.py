"""What single drives of the population do by themselves is no gap; what none of them does is one."""

from __future__ import annotations

import functools
import re
from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.base import drawing_base
from reefmu.diagnosis.fit import Fit
from reefmu.diagnosis.identify import base_fit
from reefmu.diagnosis.population import as_individual, over_scatter, unlike_population
from reefmu.diagnosis.study import Study
from reefmu.diagnosis.trace import trace_of
from reefmu.diagnosis.weighting import INDIVIDUAL
from reefmu.diagnosis.workflow import prepare
from reefmu.tables import cached_lookup
from tests import diagnosis_rig as rig

Array = NDArray[np.float64]


@functools.cache
def study() -> Study:
    record = rig.measured({}, noise=0.3, full=False)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    return prepare(record, trace_of(record, rig.drive().ratio), base)[0]


def with_residual(rest: Array) -> tuple[Study, Fit]:
    """The clean record with something added to it, and its fit without effects."""
    other = replace(study(), weights=study().weights)
    other.__dict__["torque"] = base_fit(study()).prediction.torque + rest
    return other, base_fit(other)


@pytest.mark.parametrize("number", [0, 7, 23])
def test_a_single_drive_is_like_the_population(number: int) -> None:
    single = study().individuals[number]
    of, fit = with_residual(single)
    assert unlike_population(of, fit) == 0.0
    assert over_scatter(of, fit, single) < 4.0


@pytest.mark.parametrize("less", [True, False])
def test_more_and_less_than_any_single_drive_is_not(less: bool) -> None:
    """A misfit of another form than the scatter's may be small: an individual would differ by more."""
    each = np.sqrt(np.mean(study().individuals**2, axis=1))
    rest = each.min() / 1.5 if less else each.max() * 1.5
    size = np.sqrt(rest**2 + np.mean(study().block_variance))
    of, fit = with_residual(np.sqrt(2) * size * np.sin(np.arange(study().individuals.shape[1])))
    assert unlike_population(of, fit) > 0.5 * rest


def test_as_an_individual_a_drive_scatters() -> None:
    fit = base_fit(study())
    assert fit.weighting.size < INDIVIDUAL
    single = as_individual(study(), fit)
    assert single.weighting.size >= INDIVIDUAL
    assert single.cost > fit.cost


def test_what_tolerances_may_hide_is_told() -> None:
    """One loop of a drive with a little play: most single drives of the drawing differ by as much."""
    found = diagnose_record(rig.measured({"backlash": {"clearance": 4e-7}}, noise=0.3, full=False, seed=3),
                            drive=rig.drive())
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
