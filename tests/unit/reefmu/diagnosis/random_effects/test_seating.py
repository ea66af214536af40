"""Seats of the elements of a row, compared with the core's, and found again in records of simulated individuals."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.estimation.likeliest_seating import with_likeliest_seating
from reefmu.diagnosis.preprocessing.trace import Trace, make_blocks, make_trace
from reefmu.diagnosis.random_effects.element_motion import (
    at_blocks,
    element_motion,
    element_positions,
    inside_profile,
)
from reefmu.diagnosis.random_effects.individuals import simulate_individuals
from reefmu.diagnosis.random_effects.responses import element_responses
from reefmu.diagnosis.random_effects.scatter import Scatter
from reefmu.diagnosis.random_effects.seating import Seating, even_seats, possible_seatings
from stiffness_model import DoesNotFitWarning, Drive, load_drive
from stiffness_model.rotation.element_positions import element_lobe_pairs
from tests import diagnosis_rig as rig


def _drive(per_row: int) -> Drive:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DoesNotFitWarning)
        return load_drive("drive_1", elements=3 * per_row)


def _scatter(drive: Drive, trace: Trace) -> Scatter:
    blocks = make_blocks(trace, 4)
    twist = blocks.mean(trace.twist)
    return Scatter(drive, element_responses(drive), element_motion(drive, trace, blocks), twist)


@pytest.mark.parametrize("per_row", [7, 24, 29])
def test_elements_meet_the_lobes_of_the_core(per_row: int) -> None:
    """Elements on even seats share lobes with each other as in `stiffness_model.rotation`: numbered back to front."""
    drive = _drive(per_row)
    _, lobe = element_lobe_pairs(drive)
    ours = np.array(even_seats(drive))
    turn, number = np.divmod(np.arange(per_row * 4), per_row)
    core = lobe[:: drive.eccentrics][: len(number)]
    found = -drive.orientation * ours[number] - turn
    assert np.array_equal((core - core[0]) % drive.lobes, (found - found[0]) % drive.lobes)


def test_a_full_row_has_one_seating_and_a_row_with_free_seats_several() -> None:
    assert possible_seatings(_drive(29)) == (Seating(0.0, tuple(range(29))),)
    found = possible_seatings(_drive(24))
    assert len(found) == len(set(found)) == 48


@pytest.mark.parametrize("seats", ["even", "side by side"])
def test_a_record_of_an_individual_shows_its_seating(seats: str) -> None:
    drive = _drive(24)
    trace = make_trace(rig.protocol(), drive.ratio)
    scatter = _scatter(drive, trace)
    true = Seating(2 * np.pi * 5 / 24, even_seats(drive) if seats == "even" else tuple(range(24)))
    (torque,) = simulate_individuals(replace(scatter, seating=true), 1, seed=4, places=(0.0, 0.0))
    noise = 0.002 * float(np.abs(torque).max()) * np.random.default_rng(0).standard_normal(len(torque))
    variance = np.full(len(torque), float(np.var(noise)))
    blocks = make_blocks(trace, 4)
    found = with_likeliest_seating(scatter, trace, blocks, variance, torque + noise, 100.0).seating
    assert found is not None
    assert found.seats == true.seats
    (at, lobe), (true_at, true_lobe) = (element_positions(drive, scatter.motion, seating) for seating in (found, true))
    inside = np.minimum(*(inside_profile(drive, scatter.motion, beta) for beta in (at, true_at))) > 0.5
    assert np.mean((lobe == true_lobe)[inside]) > 0.9


def test_where_the_crank_stands_the_seats_are_even() -> None:
    drive = _drive(24)
    trace = make_trace(rig.protocol(full=False), drive.ratio)
    scatter = _scatter(drive, trace)
    assert scatter.crank_stands
    ones = np.ones(len(scatter.twist))
    found = with_likeliest_seating(scatter, trace, make_blocks(trace, 4), ones, ones, 100.0).seating
    assert found is not None
    assert found.seats == even_seats(drive)


def test_a_twist_at_a_locked_crank_moves_the_elements() -> None:
    """As in `stiffness_model.rotation`, where positions follow the output: by (ratio - 1) times its angle."""
    drive = _drive(29)
    trace = make_trace(rig.protocol(full=False), drive.ratio)
    motion = element_motion(drive, trace, make_blocks(trace, 1))
    assert np.ptp(trace.crank) == 0
    expected = (drive.ratio - 1) * trace.output
    assert np.allclose(motion.rotation - motion.rotation[0], expected - expected[0], atol=1e-3)
    assert np.ptp(motion.rotation) > 2 * np.pi / drive.elements


def test_where_the_crank_turns_fast_every_sample_is_a_point() -> None:
    """A sample sees the elements at one instant; few samples of a fast turn do not average over all positions."""
    drive = _drive(29)
    trace = make_trace(rig.protocol(), drive.ratio)
    blocks = make_blocks(trace, 4)
    motion = element_motion(drive, trace, blocks)
    turning = motion.count > 1
    assert turning.any()
    assert not turning.all()
    assert np.array_equal(motion.count[turning], blocks.count[turning])
    assert np.allclose(motion.mean(motion.rotation), blocks.mean(trace.output * (drive.ratio - 1)), atol=0.01)
    few = np.flatnonzero(turning)[:5]
    part = at_blocks(motion, few)
    assert np.allclose(part.mean(part.rotation), motion.mean(motion.rotation)[few])
