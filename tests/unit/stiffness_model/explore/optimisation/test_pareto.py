"""The front, the choice and the main effects."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from stiffness_model.explore.definition.metrics import METRICS
from stiffness_model.explore.definition.study import Choice, Limit, Study
from stiffness_model.explore.evaluation.evaluate import Evaluations, Outcome
from stiffness_model.explore.optimisation.pareto import choose, front, minimised_objectives, non_dominated, violations
from stiffness_model.explore.report.main_effects import main_effect
from tests.small_study import study


def brute_force(rows: np.ndarray) -> list[bool]:
    """Non-dominated rows by the definition, every row compared with every other."""
    return [not np.isnan(a).any() and not any((b <= a).all() and (b < a).any() for b in rows) for a in rows]


# Few different values, so that rows often have equal elements or are equal; and NaN.
VALUES = st.one_of(st.integers(-3, 3).map(float), st.floats(-1, 1), st.sampled_from([np.nan, 1e17, 1e17 + 64]))
TABLES = st.integers(1, 4).flatmap(lambda k: arrays(float, st.tuples(st.integers(0, 30), st.just(k)), elements=VALUES))


@given(TABLES)
def test_the_front_agrees_with_the_definition(rows: np.ndarray) -> None:
    assert non_dominated(rows).tolist() == brute_force(rows)


@given(TABLES, st.randoms())
def test_front_does_not_depend_on_the_order(rows: np.ndarray, random: object) -> None:
    order = list(range(len(rows)))
    random.shuffle(order)  # type: ignore[attr-defined]
    np.testing.assert_array_equal(non_dominated(rows[order]), non_dominated(rows)[order])


def random_designs(seed: int, count: int = 60) -> tuple[Study, Evaluations]:
    """Designs with random metrics, some out of limits, some not simulated."""
    rng = np.random.default_rng(seed)
    metrics = rng.uniform(1.0, 2.0, (count, len(METRICS)))
    names = list(METRICS)
    metrics[:, names.index("undercut")] = rng.uniform(0.3, 0.6, count)
    metrics[:, names.index("pressure")] = rng.uniform(4e9, 5.5e9, count)
    outcome = np.where(rng.random(count) < 0.15, Outcome.TOO_SOFT, Outcome.SIMULATED).astype(np.int8)
    metrics[outcome != Outcome.SIMULATED, names.index("stiffness")] = np.nan
    return study(), Evaluations(rng.random((count, 3)), metrics, outcome)


@settings(max_examples=30)
@given(st.integers(0, 10_000))
def test_members_keep_within_the_limits_and_no_feasible_design_dominates_them(seed: int) -> None:
    of, found = random_designs(seed)
    members = front(of, found)
    undercut, pressure = found.column("undercut"), found.column("pressure")
    feasible = (found.outcome == Outcome.SIMULATED) & (undercut <= 0.52) & (pressure <= 5e9)
    np.testing.assert_array_equal(violations(of, found) == 0, feasible)
    values = np.column_stack([found.column("lost_motion"), found.column("no_load_force"), -found.column("stiffness")])
    np.testing.assert_array_equal(minimised_objectives(of, found), values)
    inside = np.flatnonzero(feasible)
    assert set(members) == set(inside[brute_force(values[inside])])
    assert (np.diff(values[members, 0]) >= 0).all()


def test_violations_grow_with_the_excess_and_designs_without_metrics_rank_last() -> None:
    of, found = random_designs(0, 3)
    found.column("undercut")[:] = 0.0
    metrics = found.metrics.copy()
    metrics[:, list(METRICS).index("undercut")] = (0.5, 0.55, 0.59)
    metrics[:, list(METRICS).index("pressure")] = 4e9
    outcome = np.zeros(3, np.int8)
    a, b, c = violations(of, replace(found, metrics=metrics, outcome=outcome))
    assert 0 == a < b < c
    outcome[0] = Outcome.NO_DRIVE
    assert violations(of, replace(found, metrics=metrics, outcome=outcome))[0] > c


def test_the_knee_of_a_front_is_its_corner_and_the_best_member_keeps_its_limits() -> None:
    of, found = random_designs(0, 5)
    names = list(METRICS)
    metrics = found.metrics.copy()
    metrics[:, names.index("undercut")], metrics[:, names.index("pressure")] = 0.4, 4e9
    metrics[:, names.index("lost_motion")] = (1.0, 1.1, 1.2, 3.0, 5.0)
    metrics[:, names.index("no_load_force")] = (9.0, 6.0, 2.0, 1.5, 1.0)
    metrics[:, names.index("stiffness")] = 1.0
    found = replace(found, metrics=metrics, outcome=np.zeros(5, np.int8))
    members = front(of, found)
    assert members.tolist() == [0, 1, 2, 3, 4]
    assert choose(of, found, members) == 2
    best = replace(of, choice=Choice("best", "no_load_force", (Limit("lost_motion", high=4.0),)))
    assert choose(best, found, members) == 3
    none = replace(of, choice=Choice("best", "no_load_force", (Limit("lost_motion", high=0.5),)))
    assert choose(none, found, members) is None
    assert choose(of, found, members[:0]) is None


def test_main_effects_are_the_known_sobol_indices_of_the_ishigami_function() -> None:
    # Ishigami and Homma, 1990: S1 = 0.3139, S2 = 0.4424, S3 = 0.
    from scipy.stats import qmc

    x = np.pi * (2 * qmc.Sobol(3, scramble=False).random(4096) - 1)
    y = np.sin(x[:, 0]) + 7 * np.sin(x[:, 1]) ** 2 + 0.1 * x[:, 2] ** 4 * np.sin(x[:, 0])
    assert [main_effect(x[:, k], y).index for k in range(3)] == pytest.approx([0.3139, 0.4424, 0.0], abs=0.03)


def test_main_effects_of_constants_and_empty_samples_are_zero() -> None:
    assert main_effect([], []).index == 0
    assert main_effect([0.1, 0.2, 0.9], [2.0, 2.0, 2.0]).index == 0
    assert main_effect([0.5] * 40, np.arange(40.0)).index == 0
