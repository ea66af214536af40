"""What is known of the scatter before and after the seats of the elements are, on records of individuals."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.analysis import Analysis
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.pipeline import analyse
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem, with_independent_scatter
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.random_effects.seating import Seating, even_seats
from reefmu.record import Record
from stiffness_model import Drive
from tests.individual_records import mean_lookup, record_of_individual, seated_drive

AMPLITUDE = 3e-4
"""rad, of the kinematic error, six times the scatter."""


def _seating(drive: Drive) -> Seating:
    return Seating(2 * np.pi * 5.37 / 24, even_seats(drive))


def _with_kinematic_error(record: Record) -> Record:
    """What twists the output beside the contacts moves none of them."""
    return replace(record, output_angle=record.output_angle - AMPLITUDE * np.sin(2 * record.crank_angle + 0.7))


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


@pytest.mark.slow
@pytest.mark.parametrize("per_row", [24, 29])
def test_a_large_kinematic_error_does_not_hide_in_the_scatter(per_row: int) -> None:
    """It moves the elements along the profile, also between the samples of a block, and hides their seats."""
    drive = seated_drive(per_row)
    record = _with_kinematic_error(record_of_individual(drive, _seating(drive), noise=0.1))
    found = analyse(record, BaseCurveSource(drive, make=lambda trace: drawing_base(drive, mean_lookup(drive))))
    assert isinstance(found, Analysis)
    (fit,) = (fit for fit in found.evidence.search.all_fits if fit.names == ("kinematic_error",))
    values = found.evidence.problem.layout(fit.names).by_effect(fit.parameters)["kinematic_error"]
    assert found.diagnosis.verdict == "named"
    assert [effect.name for effect in found.diagnosis.effects] == ["kinematic_error"]
    assert values["amplitude_2"] == pytest.approx(AMPLITUDE, rel=0.04)
    assert fit.weighting.size <= 1
    assert fit.weighting.roughness == 0
