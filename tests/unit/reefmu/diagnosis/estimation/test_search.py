"""Refined sets: the scatter at the contacts of each, computed once for those that are alike."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.least_squares import Fit, FitOptions
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import Search, base_fit, refine
from reefmu.diagnosis.estimation.worker_pool import WorkerPool
from tests.individual_records import problem_of_individual


@pytest.fixture(scope="module")
def problem() -> Problem:
    return problem_of_individual(29)


def at_clearance(problem: Problem, clearance: float) -> Fit:
    """The base curve with a clearance, m, beyond the drawn one."""
    start = np.append(base_fit(problem).parameters, clearance)
    return problem.fit_from(("backlash",), start, problem.weights, FitOptions(steps=0))


def test_sets_of_the_same_contacts_share_one_scatter_of_their_own(problem: Problem) -> None:
    assert problem.scatter is not None
    nothing, moved = base_fit(problem), at_clearance(problem, 5 * problem.scatter.clearance_deviation)
    first, *others = refine(WorkerPool(problem), [nothing, moved, moved])
    assert first.weighting.basis is problem.weights.basis
    assert all(other.cost <= moved.cost for other in others)
    ((contacts, weights),) = problem.weights_cache
    np.testing.assert_array_equal(contacts.clearance, moved.prediction.contacts.clearance)
    anew = replace(problem, weights_cache=[]).weights_of_contacts(moved)
    np.testing.assert_array_equal(weights.basis, anew.basis)


def test_a_set_whose_contacts_move_is_fitted_again_where_they_end(problem: Problem) -> None:
    """It starts from a backlash that the record has not, with the scatter of that: under which it costs far more."""
    assert problem.scatter is not None
    far = at_clearance(problem, 5 * problem.scatter.clearance_deviation)
    there = problem.fit_from(far.names, far.parameters, problem.weights_of_contacts(far))
    near = problem.fit_from(far.names, far.parameters, problem.weights)
    assert near.cost < there.cost - 10
    (found,) = refine(WorkerPool(replace(problem, weights_cache=[])), [far])
    assert found.cost == pytest.approx(near.cost, abs=0.1)


def test_another_fit_of_a_single_effect_counts_where_it_is_better(problem: Problem) -> None:
    nothing, known = base_fit(problem), at_clearance(problem, 1e-6)
    search = Search(nothing, {0: [nothing]}).with_single(known)
    assert search.best[1][0] is known
    better, worse = replace(known, cost=known.cost - 1), replace(known, cost=known.cost + 1)
    assert search.with_single(worse).best[1][0] is known
    assert search.with_single(better).best[1][0] is better
    other = replace(worse, names=("wear",))
    first, second = search.with_single(other).best[1]
    assert (first is known, second is other) == (True, True)
