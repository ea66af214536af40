"""Runs that were not fitted refute an effect only where the fitted runs show it beside the scatter."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.held_out import fits_without_held_out, held_out_blocks, is_refuted
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.preparation import prepare_problem
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
    mean_drive = prepare_problem(record, trace, base)
    scatter = np.repeat(mean_drive.individuals[5], mean_drive.blocks.count.astype(int))
    record = replace(record, output_torque=record.output_torque + scatter)
    found = prepare_problem(record, make_trace(record, rig.drive().ratio), base)
    assert not found.is_mean_drive
    return found


@pytest.mark.parametrize(
    ("name", "parameters", "inside", "outside", "refuted"),
    [
        ("hysteresis", [8.0, 1e-4], 1.0, 1.0, False),
        ("hysteresis", [8.0, 1e-4], 1.0, -1.0, True),
        # The fitted runs differ by a small clearance, which scatter explains: their raw residual shrinks, not the cost.
        ("backlash", [3.5e-6], 0.5, -1.0, False),
    ],
)
def test_an_effect_is_refuted_where_it_is_shown_and_does_harm(
    problem: Problem, name: str, parameters: list[float], inside: float, outside: float, refuted: bool
) -> None:
    """inside, outside: factors of the effect in the runs that are fitted and in those that are held out."""
    base = base_fit(problem)
    start = np.concatenate([base.parameters, parameters])
    change = problem.predictor((name,))(start).torque - base.prediction.torque
    out = held_out_blocks(problem)
    other = replace(problem)
    other.__dict__["torque"] = problem.torque + change * np.where(out, outside, inside)
    fits = base_fit(other), other.fit_from((name,), start)
    held = fits_without_held_out(other, fits)
    before, after = (float(np.mean((other.torque - f.prediction.torque)[out] ** 2)) for f in held)
    assert (after > 2 * before) == (outside < 0)
    assert is_refuted(other, *fits, held) is refuted
