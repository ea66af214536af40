"""Fits in several processes give the same diagnosis as fits in one."""

from __future__ import annotations

import os
import pickle
from concurrent.futures import Future, ProcessPoolExecutor
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.estimation.worker_pool import RANKING, Start, WorkerPool, fit_starts, spread_over
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model.contacts.tables import cached_lookup
from tests import diagnosis_rig as rig


class Counting(ProcessPoolExecutor):
    """Counts the jobs that are submitted."""

    submitted = 0

    def submit(self, *args: Any, **kwargs: Any) -> Future[Any]:
        self.submitted += 1
        return super().submit(*args, **kwargs)


@pytest.mark.slow
def test_several_processes_give_the_same_diagnosis() -> None:
    record = rig.measured({"coulomb_friction": {"torque": 5.0}, "backlash": {"clearance": 4e-6}}, full=False)
    here = diagnose_record(record, drive=rig.drive()).to_dict()
    with Counting(2) as pool:
        shared = diagnose_record(record, drive=rig.drive(), executor=pool).to_dict()
    assert here.pop("seconds") > 0 < shared.pop("seconds")
    assert here["effects"]
    assert pool.submitted > 20
    assert shared == here


def test_this_process_does_the_first_job_and_the_others_do_the_rest() -> None:
    with Counting(1) as pool:
        found = [*spread_over(pool)(_process_of, [3, 1, 2])]
    assert [job for job, _ in found] == [3, 1, 2]
    assert [process == os.getpid() for _, process in found] == [True, False, False]
    assert [*spread_over(None)(_process_of, [3, 1])] == [(3, os.getpid()), (1, os.getpid())]


@pytest.mark.parametrize("n", [0, 1, 2, 5])
def test_any_number_of_jobs_is_shared(n: int) -> None:
    with ProcessPoolExecutor(1) as pool:
        assert [*spread_over(pool)(abs, range(-n, 0))] == [*spread_over(None)(abs, range(-n, 0))] == [*range(n, 0, -1)]


def _process_of(job: int) -> tuple[int, int]:
    return job, os.getpid()


def test_a_fit_survives_sending_without_its_weights() -> None:
    """The problem's own weights are not sent; others are."""
    record = rig.measured({}, full=False)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    problem = prepare_problem(record, make_trace(record, rig.drive().ratio), base)
    fit = base_fit(problem)
    sent = pickle.dumps(problem.without_weights(fit))
    assert len(sent) < len(pickle.dumps(fit)) / 3
    back = problem.with_weights(pickle.loads(sent))
    assert back.weighting.basis is problem.weights.basis
    assert back.weighting.size == fit.weighting.size
    other = problem.fit_from((), fit.parameters, problem.weights.with_variance(2 * problem.variance))
    assert problem.with_weights(problem.without_weights(other)) is other


def test_sets_are_ranked_under_the_weights_of_the_set_that_they_extend() -> None:
    """Sets that extend nothing under those of the problem, others under those that they bring; in any order."""
    record = rig.measured({"hysteresis": {"torque": 4.0}}, full=False)
    base = drawing_base(rig.drive(), cached_lookup(rig.drive()))
    problem = prepare_problem(record, make_trace(record, rig.drive().ratio), base)
    parameters = [*base_fit(problem).parameters, 3.0, 1e-4]
    own, other = problem.weights, problem.weights.with_variance(2 * problem.variance)
    quieter = replace(other, scale=1.1 * other.scale)
    starts = [Start(("hysteresis",), np.array(parameters), w, w.size) for w in (other, own, other, quieter, other)]
    shares: list[float] = []
    found = fit_starts(WorkerPool(problem), starts, shares.append)
    assert [fit.weighting.basis is other.basis for fit in found] == [True, True, True, False, True]
    assert found[3].weighting.basis is own.basis
    assert shares[-1] == 1.0
    for fit, weights in ((found[0], other), (found[3], own), (found[4], quieter)):
        assert fit.cost == problem.fit_from(("hysteresis",), starts[0].parameters, weights, RANKING).cost
