"""Seats of the elements of a row, compared with the core's, and the motion of the elements along a record."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from reefmu.diagnosis.preprocessing.trace import make_blocks, make_trace
from reefmu.diagnosis.random_effects.element_columns import SeatedElements
from reefmu.diagnosis.random_effects.element_motion import element_motion, even_seats, repeating_elements, spread_starts
from reefmu.diagnosis.random_effects.part_responses import part_responses
from reefmu.diagnosis.random_effects.responses import element_responses
from stiffness_model import DoesNotFitWarning, load_drive
from stiffness_model.rotation.element_positions import element_lobe_pairs
from tests import diagnosis_rig as rig
from tests.individual_records import seated_drive


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


@pytest.mark.parametrize(("seats", "per_row", "expected"), [(29, 29, 1), (29, 27, 27), (33, 27, 9), (33, 24, 24)])
def test_gaps_between_seats_repeat(seats: int, per_row: int, expected: int) -> None:
    """As often as seats and elements have a common factor, but not where halves are rounded to even seats: the places
    of 24 elements on 33 are 1.375 seats apart."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DoesNotFitWarning)
        drive = load_drive("drive_1", transmission_ratio=seats, lobes=seats + 1, elements=3 * per_row)
    assert repeating_elements(drive) == expected


@pytest.mark.parametrize("per_row", [29, 24])
def test_starts_are_spread_over_the_turn(per_row: int) -> None:
    """And evenly over the distance between elements, whether or not all seats are occupied."""
    drive = seated_drive(per_row)
    for span, widest in ((2 * np.pi, 3.2), (2 * np.pi / drive.elements, 1.0)):
        start = np.sort(np.array(spread_starts(drive, 12)) % span) / span
        gaps = np.diff(np.append(start, start[0] + 1))
        assert gaps.max() <= (widest + 1e-9) / len(start)


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
        parts = drive, element_responses(drive), motion, twist, np.zeros(len(motion.rotation))
        seen = part_responses(*parts[1:])
        columns = SeatedElements(*parts[:3], seen, 0.7).columns()
        blocks = make_blocks(trace, 10)
        if samples == 1:
            columns = np.add.reduceat(columns, blocks.first, axis=1) / blocks.count
        return columns.T @ columns

    exact = covariance(1)
    assert np.linalg.norm(covariance(10) - exact) < 0.01 * np.linalg.norm(exact)


def test_the_motion_of_a_block_is_the_mean_of_its_parts() -> None:
    drive = seated_drive(29)
    trace = make_trace(rig.protocol(), drive.ratio)
    blocks = make_blocks(trace, 4)
    motion = element_motion(drive, trace, blocks)
    assert motion.count.min() == 1
    assert motion.count.max() == 4
    assert np.allclose(motion.mean(motion.rotation), blocks.mean(trace.output * (drive.ratio - 1)), atol=0.01)
    assert np.allclose(motion.mean(motion.twist), 0.0, atol=1e-12)
