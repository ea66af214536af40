"""Steps at the edges of the profile, against elements that are placed one by one at every sample."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.preprocessing.trace import Blocks, make_blocks, make_trace
from reefmu.diagnosis.random_effects.element_columns import average_torque
from reefmu.diagnosis.random_effects.element_motion import (
    ElementMotion,
    element_motion,
    elements_on_profile,
    inside_profile,
)
from reefmu.diagnosis.random_effects.part_responses import PartResponses, part_responses
from reefmu.diagnosis.random_effects.profile_steps import PHASES, profile_steps
from reefmu.diagnosis.random_effects.responses import element_responses
from stiffness_model.numerics.arrays import Array
from tests import diagnosis_rig as rig
from tests.individual_records import seated_drive


@pytest.mark.parametrize("full", [True, False])
@pytest.mark.parametrize("phase", [0, 17, PHASES - 1])
def test_steps_are_those_of_elements_at_one_position(full: bool, phase: int) -> None:
    """In total and by position, in fast turns and where the crank stands."""
    drive = seated_drive(29)
    trace = make_trace(rig.protocol(full=full), drive.ratio)
    blocks, single = make_blocks(trace, 10), make_blocks(trace, 1)

    def along(of: Blocks) -> tuple[ElementMotion, PartResponses, Array]:
        """Motion, responses and average torque by blocks."""
        motion, responses = element_motion(drive, trace, of), element_responses(drive)
        parts = responses, motion, of.mean(trace.smooth_twist), np.zeros(len(motion.rotation))
        return motion, part_responses(*parts), average_torque(drive, *parts)

    motion, seen, average = along(single)
    start = 2 * np.pi / drive.elements * (phase + 0.5) / PHASES
    on = elements_on_profile(drive, motion, start, 0.0)
    torque = seen.at(on.part, on.position)["mean"] * inside_profile(drive, motion, on.part, on.position)

    def of_samples(weight: Array) -> Array:
        return np.asarray(np.bincount(on.part, torque * weight, len(trace)), float)

    expected = [of_samples(np.ones_like(torque)), of_samples(on.position / drive.usable_limit)] - average
    motion, seen, average = along(blocks)
    found = profile_steps(drive, seen, motion, average)[2 * phase : 2 * phase + 2] * np.sqrt(PHASES)
    for one, exact in zip(found, expected, strict=True):
        of_blocks = blocks.mean(exact)
        assert np.linalg.norm(one - of_blocks) < 0.1 * np.linalg.norm(of_blocks)
        assert np.linalg.norm(of_blocks) > 0.005 * np.linalg.norm(average)
