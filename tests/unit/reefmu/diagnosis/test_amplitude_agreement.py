"""Sizes of small and large cycles are compared by the scatter of cycles, and equal ones seldom disagree."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.amplitude_agreement import MIXTURE, compare_amplitudes, welch_p
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.fitted_values import AmplitudeTest
from reefmu.diagnosis.forward.base_curve import power_base
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.report.text import amplitude_text
from reefmu.record import Record, join_records, make_record, with_output_locked

STIFFNESS = 500.0
"""N.m/rad."""


def loops(small: float, large: float, seed: int = 0, scatter: float = 0.1) -> Record:
    """Four cycles of 8 N.m and four of 24 N.m of a spring, with half widths of the loop, N.m, that differ by `scatter`
    from cycle to cycle."""
    rng = np.random.default_rng(seed)
    parts: list[Record] = []
    for run in range(8):
        n, amplitude, width = 700 + 40 * (run % 3), (8.0, 24.0)[run // 4], (small, large)[run // 4]
        phase = np.linspace(0, 1, n)
        elastic = amplitude * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * phase))
        friction = (width + scatter * rng.standard_normal()) * np.sign(np.cos(2 * np.pi * phase))
        columns = {
            "time": 20.0 * run + (8 + run % 3) * phase,
            "run": np.full(n, float(run)),
            "twist": elastic / STIFFNESS,
            "output_torque": elastic + friction + 0.1 * rng.standard_normal(n),
        }
        parts.append(with_output_locked(make_record(columns)))
    return join_records(parts)


def found(record: Record) -> AmplitudeTest:
    trace = make_trace(record, 1.0)
    problem = prepare_problem(record, trace, power_base(trace))
    start = np.concatenate([base_fit(problem).parameters, [2.0, 1e-4]])
    (test,) = compare_amplitudes(problem, problem.fit_from(("hysteresis",), start))
    return test


def test_sizes_that_differ_are_found_with_the_law_between() -> None:
    test = found(loops(2.0, 3.5))
    assert [round(s.amplitude) for s in test.sizes] == pytest.approx([10, 27], abs=2)
    assert [s.value for s in test.sizes] == pytest.approx([2.0, 3.5], abs=0.3)
    assert all(3 <= s.cycles <= 4 for s in test.sizes)
    assert test.p < 0.01
    assert test.laws == (MIXTURE,)
    text = amplitude_text(test)
    assert "differs with the amplitude" in text
    assert MIXTURE in text


def test_a_size_in_proportion_to_the_amplitude_is_called_so() -> None:
    test = found(loops(1.0, 2.8))
    assert test.p < 0.01
    assert any("proportion to the torque" in law for law in test.laws)


@pytest.mark.slow
def test_equal_sizes_disagree_as_often_as_chance_has_it() -> None:
    assert sum(found(loops(2.5, 2.5, seed=seed)).p < 0.05 for seed in range(12)) <= 3


def test_welch_of_equal_means_is_uniform() -> None:
    rng = np.random.default_rng(0)
    p = [welch_p([rng.standard_normal(3), 3 * rng.standard_normal(5)]) for _ in range(600)]
    assert np.mean(np.array(p) < 0.05) == pytest.approx(0.05, abs=0.03)
    assert np.mean(np.array(p) < 0.5) == pytest.approx(0.5, abs=0.05)


def test_a_record_of_one_amplitude_has_no_test() -> None:
    record = loops(2.0, 2.0)
    large = record.run >= 4
    kept = Record(**{k: v[large] if isinstance(v, np.ndarray) else v for k, v in vars(record).items()})
    trace = make_trace(kept, 1.0)
    problem = prepare_problem(kept, trace, power_base(trace))
    fit = problem.fit_from(("hysteresis",), np.concatenate([base_fit(problem).parameters, [2.0, 1e-4]]))
    assert compare_amplitudes(problem, fit) == ()
