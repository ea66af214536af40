"""Fits without the runs that are held out do not see them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.held_out import fits_without_held_out, held_out_blocks
from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.preparation import prepare_problem, with_individuals
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model.contacts.tables import cached_lookup
from tests import diagnosis_rig as rig

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def problem() -> Problem:
    """A record of an individual drive without any effect."""
    record = rig.measured({}, noise=0.3, seed=3)
    trace = make_trace(record, rig.drive().ratio)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    mean_drive = with_individuals(prepare_problem(record, trace, base))
    scatter = np.repeat(mean_drive.individuals[5], mean_drive.blocks.count.astype(int))
    record = replace(record, output_torque=record.output_torque + scatter)
    return prepare_problem(record, make_trace(record, rig.drive().ratio), base)


def test_fits_without_held_out_runs_do_not_see_them(problem: Problem) -> None:
    """A hysteresis in all runs, or one of the other sign in those that are held out: the same parameters."""
    base, name = base_fit(problem), "hysteresis"
    start = np.concatenate([base.parameters, [4.0, 1e-4]])
    change = problem.predictor((name,))(start).torque - base.prediction.torque
    out = held_out_blocks(problem)
    assert 0.2 < out.mean() < 0.5
    found: list[Fit] = []
    for outside in (1.0, -1.0):
        other = replace(problem)
        other.__dict__["torque"] = problem.torque + change * np.where(out, outside, 1.0)
        fit = replace(base, names=(name,), parameters=start, bounds=problem.bounds((name,)))
        found += fits_without_held_out(other, [fit])
    alike, opposite = found
    assert alike.parameters == pytest.approx(opposite.parameters, rel=1e-6, abs=1e-12)
    assert alike.parameters[-2] == pytest.approx(4.0, rel=0.1)
