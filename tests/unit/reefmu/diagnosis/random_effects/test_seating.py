"""Seats of the elements of a row, compared with the core's, and found again in records of simulated individuals."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.likeliest_seating import SIZES, least_cost
from reefmu.diagnosis.estimation.problem import Problem, make_weights
from reefmu.diagnosis.estimation.search import base_fit
from reefmu.diagnosis.forward.base_curve import drawing_base
from reefmu.diagnosis.forward.parameter_layout import DELAY
from reefmu.diagnosis.preparation import prepare_problem, with_scatter_beside
from reefmu.diagnosis.preprocessing.trace import make_blocks, make_trace
from reefmu.diagnosis.random_effects.curve_columns import curve_columns
from reefmu.diagnosis.random_effects.element_motion import (
    at_blocks,
    element_motion,
    elements_on_profile,
    inside_profile,
)
from reefmu.diagnosis.random_effects.responses import element_responses
from reefmu.diagnosis.random_effects.scatter import Scatter
from reefmu.diagnosis.random_effects.seating import Seating, even_seats, possible_seatings
from reefmu.record import Record
from stiffness_model import Drive
from stiffness_model.rotation.element_positions import element_lobe_pairs
from tests import diagnosis_rig as rig
from tests.individual_records import mean_lookup, record_at_held_torque, record_of_individual, seated_drive


@pytest.mark.parametrize("per_row", [7, 24, 29])
def test_elements_meet_the_lobes_of_the_core(per_row: int) -> None:
    """Elements on even seats share lobes with each other as in `stiffness_model.rotation`: numbered back to front."""
    drive = seated_drive(per_row)
    _, lobe = element_lobe_pairs(drive)
    ours = np.array(even_seats(drive))
    turn, number = np.divmod(np.arange(per_row * 4), per_row)
    core = lobe[:: drive.eccentrics][: len(number)]
    found = -drive.orientation * ours[number] - turn
    assert np.array_equal((core - core[0]) % drive.lobes, (found - found[0]) % drive.lobes)


def test_a_full_row_has_one_seating_and_a_row_with_free_seats_several() -> None:
    assert possible_seatings(seated_drive(29)) == (Seating(0.0, tuple(range(29))),)
    found = possible_seatings(seated_drive(24))
    assert len(found) == len(set(found)) == 48


def _seated(drive: Drive, record: Record) -> tuple[Problem, Scatter]:
    """The problem of a record, and its scatter with the likeliest seating."""
    trace = make_trace(record, drive.ratio)
    problem = prepare_problem(record, trace, drawing_base(drive, mean_lookup(drive)))
    assert isinstance(problem.scatter, Scatter)
    return problem, problem.scatter


def _share_of_right_lobes(drive: Drive, scatter: Scatter, true: Seating) -> float:
    assert scatter.seating is not None
    motion = scatter.motion
    # With this margin all elements of all parts, in the same order.
    at, true_at = (elements_on_profile(drive, motion, seating, np.pi) for seating in (scatter.seating, true))
    assert len(at.part) == len(true_at.part) == len(motion.rotation) * drive.elements
    inside = np.minimum(*(inside_profile(drive, motion, on.part, on.position) for on in (at, true_at))) > 0.5
    return float(np.mean((at.lobe == true_at.lobe)[inside]))


@pytest.mark.parametrize("seats", [pytest.param("even", marks=pytest.mark.slow), "side by side"])
def test_a_record_of_an_individual_shows_its_seating(seats: str) -> None:
    drive = seated_drive(24)
    true = Seating(2 * np.pi * 5 / 24, even_seats(drive) if seats == "even" else tuple(range(24)))
    _, scatter = _seated(drive, record_of_individual(drive, true))
    assert scatter.seating is not None
    assert scatter.seating.seats == true.seats
    assert _share_of_right_lobes(drive, scatter, true) > 0.9


@pytest.mark.slow
def test_wrong_seats_are_mended_beside_a_fit() -> None:
    """As where an effect hid them: the fit gets likelier by hundreds with those that its residual shows."""
    drive = seated_drive(24)
    true = Seating(2 * np.pi * 7 / 24, even_seats(drive))
    problem, right = _seated(drive, record_of_individual(drive, true))
    scatter = replace(right, seating=Seating(true.start + np.pi, tuple(range(24))))
    assert _share_of_right_lobes(drive, scatter, true) < 0.9
    wrong = replace(
        problem, scatter=scatter, weights=make_weights(problem.variance, scatter, scatter.twist), weights_cache=[]
    )
    fit = base_fit(wrong)
    found = with_scatter_beside(wrong, [fit])
    assert isinstance(found.scatter, Scatter)
    assert _share_of_right_lobes(drive, found.scatter, true) > 0.9
    assert base_fit(found).cost < fit.cost - 200


@pytest.mark.slow
@pytest.mark.parametrize(("made", "gain"), [(record_of_individual, 1000.0), (record_at_held_torque, 0.0)])
def test_a_late_torque_is_known_whether_the_rig_holds_twist_or_torque(made: Callable[..., Record], gain: float) -> None:
    """While the crank turns by several elements between two samples, of which one steps on within the delay. Where the
    twist is held the record is likelier with the elements as they were, where the torque is held as they are."""
    drive, late = seated_drive(24), 0.004
    true = Seating(2 * np.pi * 5 / 24, even_seats(drive))
    problem, _ = _seated(drive, made(drive, true, late=late))
    base = base_fit(problem)
    found = with_scatter_beside(problem, [base])
    fit = base_fit(found)
    assert fit.cost <= base.cost - gain
    assert (found is problem) == (gain == 0)
    assert fit.parameters[DELAY] == pytest.approx(late, abs=3e-4)
    assert fit.chi_square < 1.06 * found.expected_chi_square(fit.weighting)


def test_where_the_crank_stands_the_seats_are_even() -> None:
    drive = seated_drive(24)
    record = rig.protocol(full=False)
    noise = np.random.default_rng(0).standard_normal(len(record))
    twist = record.twist(drive.ratio)
    _, scatter = _seated(drive, replace(record, output_torque=mean_lookup(drive).torque(twist) + noise))
    assert scatter.crank_stands
    assert scatter.seating is not None
    assert scatter.seating.seats == even_seats(drive)


def test_a_twist_at_a_locked_crank_moves_the_elements() -> None:
    """As in `stiffness_model.rotation`, where positions follow the output: by (ratio - 1) times its angle."""
    drive = seated_drive(29)
    trace = make_trace(rig.protocol(full=False), drive.ratio)
    motion = element_motion(drive, trace, make_blocks(trace, 1))
    assert np.ptp(trace.crank) == 0
    expected = (drive.ratio - 1) * trace.output
    assert np.allclose(motion.rotation - motion.rotation[0], expected - expected[0], atol=1e-3)
    assert np.ptp(motion.rotation) > 2 * np.pi / drive.elements


@pytest.mark.parametrize("full", [True, False])
def test_the_covariance_of_blocks_is_that_of_their_samples(full: bool) -> None:
    """A sample sees the elements and the twist at one instant, whether the crank turns fast or stands: few samples of a
    fast turn do not average over all positions."""
    drive = seated_drive(29)
    trace = make_trace(rig.protocol(full=full), drive.ratio)

    def covariance(samples: int) -> np.ndarray:
        blocks = make_blocks(trace, samples)
        motion, twist = element_motion(drive, trace, blocks), blocks.mean(trace.smooth_twist)
        columns, _ = Scatter(drive, element_responses(drive), motion, twist).columns_at(twist)
        # The curve as a whole deviates by as much as the other columns do, which need not be alike.
        columns = columns[: -len(curve_columns(np.zeros(len(twist)), columns))]
        blocks = make_blocks(trace, 10)
        if samples == 1:
            columns = np.add.reduceat(columns, blocks.first, axis=1) / blocks.count
        return columns.T @ columns

    exact = covariance(1)
    assert np.linalg.norm(covariance(10) - exact) < 0.01 * np.linalg.norm(exact)


def test_motion_in_some_blocks_is_that_of_their_parts() -> None:
    drive = seated_drive(29)
    trace = make_trace(rig.protocol(), drive.ratio)
    blocks = make_blocks(trace, 4)
    motion = element_motion(drive, trace, blocks)
    assert motion.count.min() == 1
    assert motion.count.max() == 4
    assert np.allclose(motion.mean(motion.rotation), blocks.mean(trace.output * (drive.ratio - 1)), atol=0.01)
    assert np.allclose(motion.mean(motion.twist), 0.0, atol=1e-12)
    few = np.flatnonzero(motion.count > 1)[:5]
    part = at_blocks(motion, few)
    assert np.allclose(part.mean(part.rotation), motion.mean(motion.rotation)[few])


@pytest.mark.parametrize(("effects", "blocks"), [(5, 9), (9, 5)])
def test_seats_are_compared_by_the_likelihood_of_the_residual(effects: int, blocks: int) -> None:
    """However many random effects there are, the covariance of the blocks in full gives the same."""
    rng = np.random.default_rng(0)
    rows, residual = rng.standard_normal((effects, blocks)), rng.standard_normal(blocks)
    costs = []
    for size in SIZES:
        covariance = np.eye(blocks) + size**2 * rows.T @ rows
        costs.append(np.linalg.slogdet(covariance)[1] + residual @ np.linalg.solve(covariance, residual))
    assert least_cost(rows, residual) == pytest.approx(min(costs))
