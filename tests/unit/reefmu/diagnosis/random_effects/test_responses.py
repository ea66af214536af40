"""Values between the nodes of an element's tables against SciPy's interpolation, and the elements on the profile
against a loop over all samples."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from reefmu.diagnosis.preprocessing.trace import make_blocks, make_trace
from reefmu.diagnosis.random_effects.element_motion import element_motion, elements_on_profile, inside_profile
from reefmu.diagnosis.random_effects.responses import element_responses
from reefmu.diagnosis.random_effects.seating import Seating, even_seats
from stiffness_model.lookup.element_table import FADE_HALF_WIDTH
from tests import diagnosis_rig as rig


def test_values_between_nodes_are_those_of_scipy() -> None:
    """Two tables of two names, also beyond the ends of the axes, where they are held, and times a weight."""
    r, rng = element_responses(rig.drive()), np.random.default_rng(3)
    tables = np.stack([r.tables["mean"][:2], r.tables["slope"][:2]], axis=-1)
    number = rng.integers(0, 2, 500)
    twist, position = 1.1 * rng.uniform(r.twist[0], r.twist[-1], 500), 1.1 * rng.uniform(-1, 1, 500) * r.position[-1]
    weight = rng.uniform(0, 1, 500)
    held = np.stack([np.clip(twist, r.twist[0], r.twist[-1]), np.clip(position, r.position[0], r.position[-1])], axis=1)
    expected = np.empty((500, 2))
    for k in (0, 1):
        there = RegularGridInterpolator((r.twist, r.position), tables[k])
        expected[number == k] = there(held[number == k])
    found = r.interpolate(tables, number, twist, position, weight).T
    assert np.allclose(found, weight[:, None] * expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


@pytest.mark.parametrize("samples", [1, 20])
def test_elements_on_the_profile_are_those_of_every_sample(samples: int) -> None:
    """The share of its part for which an element is on the profile is the mean over the samples, with fading edges."""
    drive = rig.drive()
    trace = make_trace(rig.protocol(), drive.ratio)
    motion, seating = element_motion(drive, trace, make_blocks(trace, samples)), Seating(0.7, even_seats(drive))
    some = np.arange(0, len(motion.rotation), 97)
    on = elements_on_profile(drive, motion, seating, 0.0)
    share = np.zeros((len(motion.rotation), drive.elements))
    share[on.part, on.element] = inside_profile(drive, motion, on.part, on.position)
    step = 2 * np.pi / drive.elements
    for part in some:
        at = motion.rotation[part] + motion.offsets[part][np.isfinite(motion.offsets[part])]
        beta = seating.start + step * np.arange(drive.elements) + at[:, None]
        edge = (drive.usable_limit - np.abs((beta + np.pi) % (2 * np.pi) - np.pi)) / (2 * FADE_HALF_WIDTH) + 0.5
        assert share[part] == pytest.approx(np.clip(edge, 0, 1).mean(axis=0), abs=1e-9)
    assert ((share > 0) & (share < 1)).any()
