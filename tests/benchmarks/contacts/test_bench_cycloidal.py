"""The benchmark of cycloidal drives runs; no test depends on the speed of the machine."""

from __future__ import annotations

import warnings

from tests.benchmarks.contacts.bench_cycloidal import CASES, measure


def test_every_case_is_measured() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        costs = [measure(case, drives=2, twists=3, rounds=1) for case in CASES.values()]
    assert all(cost.element > 0 and cost.ratio > 0 for cost in costs)
