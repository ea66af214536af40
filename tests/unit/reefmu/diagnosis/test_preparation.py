"""What is known of the scatter before and after the seats of the elements are, on records of individuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.analysis import Analysis
from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.search import Search, base_fit, several_effects
from reefmu.diagnosis.estimation.worker_pool import WorkerPool
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.pipeline import analyse
from reefmu.diagnosis.preparation import (
    BaseCurveSource,
    prepare_problem,
    with_independent_scatter,
    with_scatter_beside,
)
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.random_effects.seating import Seating, even_seats
from reefmu.effects import find_effect
from reefmu.record import Record
from stiffness_model import Drive
from tests.individual_records import mean_lookup, record_of_individual, seated_drive

AMPLITUDE = 3e-4
"""rad, of the kinematic error: its torque is 9 to 12 times the scatter."""


def _seating(drive: Drive) -> Seating:
    return Seating(2 * np.pi * 5.37 / 24, even_seats(drive))


def _with_kinematic_error(record: Record) -> Record:
    """What twists the output beside the contacts moves none of them."""
    return replace(record, output_angle=record.output_angle - AMPLITUDE * np.sin(2 * record.crank_angle + 0.7))


def _amplitude(problem: Problem, fit: Fit) -> float:
    return problem.layout(fit.names).by_effect(fit.parameters)["kinematic_error"]["amplitude_2"]


def test_independent_scatter_has_the_variance_of_the_columns() -> None:
    drive = seated_drive(29)
    seating = Seating(0.02, even_seats(drive))
    record = record_of_individual(drive, seating)
    trace = make_trace(record, drive.ratio)
    problem = prepare_problem(record, trace, drawing_base(drive, mean_lookup(drive)), seating)
    apart = with_independent_scatter(problem)
    assert problem.scatter is not None
    assert apart.scatter is None
    columns, rest = problem.scatter.columns_at(problem.scatter.twist)
    np.testing.assert_allclose(
        apart.variance, problem.variance + np.diag(columns.T @ columns) + rest[len(rest) // 2], rtol=1e-9
    )
    # What is left of an individual is then about as large as expected, though not independent.
    left = apart.weights.whiten(problem.torque - problem.fit_from((), problem.start(0.0)).prediction.torque)
    assert 0.2 < np.mean(left**2) < 3
    assert with_independent_scatter(apart) is apart


def test_a_search_also_starts_from_fits_under_other_weights() -> None:
    """Effects that no single effect of the search leads to are among its sets."""
    drive = seated_drive(29)
    record = record_of_individual(drive, _seating(drive))
    trace = make_trace(record, drive.ratio)
    problem = prepare_problem(record, trace, drawing_base(drive, mean_lookup(drive)), _seating(drive))
    problem = replace(problem, candidates=("preload", "modulus_error"))
    base, apart = base_fit(problem), with_independent_scatter(problem)
    neutral = [np.array([p.neutral for p in find_effect(name).parameters]) for name in ("backlash", "damping")]
    pair = apart.fit_from(("backlash", "damping"), np.concatenate([base.parameters, *neutral]))
    found = several_effects(WorkerPool(problem), Search(base, {0: [base], 1: [base]}), 2, others=[pair])
    (fit,) = (fit for fit in found.best[2] if fit.names == pair.names)
    assert fit.weighting.individual is problem.weights.individual


@pytest.mark.slow
def test_seats_are_told_beside_an_effect_that_shows_without_them() -> None:
    """Its fit under independent scatter is nearly exact; beside it the record shows where the elements stand, and is
    likelier by thousands than with the position that shows beside nothing."""
    drive = seated_drive(24)
    record = _with_kinematic_error(record_of_individual(drive, _seating(drive), noise=0.1))
    trace = make_trace(record, drive.ratio)
    problem = prepare_problem(record, trace, drawing_base(drive, mean_lookup(drive)))
    apart, name = with_independent_scatter(problem), ("kinematic_error",)
    values = np.array([p.neutral for p in find_effect(*name).parameters])
    values[[p.name for p in find_effect(*name).parameters].index("amplitude_2")] = 1e-4
    shown = apart.fit_from(name, np.concatenate([base_fit(apart).parameters, values]))
    assert _amplitude(apart, shown) == pytest.approx(AMPLITUDE, rel=0.1)

    def fit_beside(fits: Sequence[Fit]) -> tuple[Fit, float]:
        seated = with_scatter_beside(problem, fits)
        fit = seated.fit_again(shown)
        return fit, _amplitude(seated, fit)

    (hidden, _), (found, amplitude) = fit_beside([base_fit(problem)]), fit_beside([base_fit(problem), shown])
    assert found.cost < hidden.cost - 2000
    assert amplitude == pytest.approx(AMPLITUDE, rel=0.02)
    assert found.weighting.roughness == 0 < hidden.weighting.roughness


@pytest.mark.slow
@pytest.mark.parametrize("per_row", [24, 29])
def test_a_large_kinematic_error_does_not_hide_in_the_scatter(per_row: int) -> None:
    """It moves the elements along the profile, also between the samples of a block, and hides their seats."""
    drive = seated_drive(per_row)
    record = _with_kinematic_error(record_of_individual(drive, _seating(drive), noise=0.1))
    found = analyse(record, BaseCurveSource(drive, make=lambda trace: drawing_base(drive, mean_lookup(drive))))
    assert isinstance(found, Analysis)
    (fit,) = (fit for fit in found.evidence.search.all_fits if fit.names == ("kinematic_error",))
    assert found.diagnosis.verdict == "named"
    assert [effect.name for effect in found.diagnosis.effects] == ["kinematic_error"]
    assert _amplitude(found.evidence.problem, fit) == pytest.approx(AMPLITUDE, rel=0.04)
    assert fit.weighting.size <= 1
    assert fit.weighting.roughness == 0
