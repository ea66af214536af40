"""A discrepancy that no effect describes gets no name: nonparametric terms, ripple of individuals, robust intervals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.estimation.intervals import standard_errors
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.estimation.weighting import MEAN_DRIVE_SIZE
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.inference.nonparametric import fit_terms
from reefmu.diagnosis.preparation import prepare_problem, with_individuals
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model.contacts.tables import cached_lookup
from reefmu.record import Record
from stiffness_model.numerics.arrays import Array
from tests import diagnosis_rig as rig

pytestmark = pytest.mark.slow


def problem_of(record: Record) -> Problem:
    trace = make_trace(record, rig.drive().ratio)
    return with_individuals(prepare_problem(record, trace, drawing_base(rig.drive(), cached_lookup(rig.drive()))))


def softer_when_warm(record: Record) -> Array:
    return record.output_torque * (1 - 0.05 * (record.temperature - 20) / 25)


def stiffer_flank(record: Record) -> Array:
    return record.output_torque * (1 + 0.05 * (record.output_torque > 0))


def offset_after_run_8(record: Record) -> Array:
    return record.output_torque + 4.0 * (record.run > 8)


@pytest.mark.parametrize(
    ("change", "coordinate"),
    [(softer_when_warm, "temperature"), (stiffer_flank, "torque"), (offset_after_run_8, "a jump before run 9")],
)
def test_a_discrepancy_without_a_name_is_located(change: Callable[[Record], Array], coordinate: str) -> None:
    clean = rig.measured({}, seed=11)
    found = diagnose_record(replace(clean, output_torque=change(clean)), drive=rig.drive())
    assert found.verdict == "unknown"
    assert not found.effects
    assert found.remainder_where[0].coordinate.startswith(coordinate)


def test_noise_gives_nonparametric_terms_no_gain() -> None:
    for correlation in (0.0, 0.9):
        problem = problem_of(rig.measured({}, correlation=correlation, seed=12))
        assert fit_terms(problem, base_fit(problem))[0].gain < 12


def test_a_fit_finds_whether_the_drive_is_an_individual() -> None:
    """The mean drive lacks the ripple that every individual has, with an effect as without one."""
    problem = problem_of(rig.measured({"backlash": {"clearance": 3e-6}}, noise=0.3, seed=13))
    start = np.append(problem.start(0.0), 3e-6)
    assert problem.fit_from(("backlash",), start).weighting.size < MEAN_DRIVE_SIZE
    problem.__dict__["torque"] = problem.torque + problem.individuals[0]
    assert 0.5 <= problem.fit_from(("backlash",), start).weighting.size <= 2.0


def test_a_misfit_correlated_over_loops_widens_the_intervals() -> None:
    problem = problem_of(rig.measured({"hysteresis": {"torque": 4.0}}, seed=14))
    fit = problem.fit_from(("hysteresis",), np.concatenate([problem.start(0.0), [4.0, 1e-4]]))
    before = standard_errors(problem, fit)
    direction = problem.blocks.mean(np.sign(problem.trace.twist_rate))
    loops = direction * np.sin(problem.trace.run[problem.blocks.first])
    problem.__dict__["torque"] = problem.torque + loops
    worse = problem.fit_from(("hysteresis",), fit.parameters)
    # The misfit more than doubles the sum of squares; as noise it would widen the intervals by less than a factor of 2.
    assert worse.chi_square < 3 * fit.chi_square
    torque = problem.layout(fit.names).effects["hysteresis"].start
    assert standard_errors(problem, worse)[torque] > 2.5 * before[torque]
