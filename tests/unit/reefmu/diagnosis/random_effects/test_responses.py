"""Values between the nodes of an element's tables against SciPy's interpolation, the elements on the profile against a
loop over all samples, and the terms of the scatter against elements at random."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.interpolate import RegularGridInterpolator

from reefmu.diagnosis.preprocessing.trace import make_blocks, make_trace
from reefmu.diagnosis.random_effects.element_motion import element_motion, elements_on_profile, inside_profile
from reefmu.diagnosis.random_effects.part_responses import clearance_levels, part_responses
from reefmu.diagnosis.random_effects.responses import TERMS, element_responses, place_deviations, term
from stiffness_model import load_drive
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


def test_responses_of_parts_are_the_tables_at_their_twist_and_clearance() -> None:
    r, trace = element_responses(rig.drive()), make_trace(rig.protocol(full=False), rig.drive().ratio)
    blocks = make_blocks(trace, 4)
    motion, twist = element_motion(rig.drive(), trace, blocks), blocks.mean(trace.smooth_twist)
    clearance = 2 * r.deviation * np.sign(motion.twist_from(twist))
    level, groups = clearance_levels(r, clearance)
    tables = np.stack(list(r.at_clearances(groups).values()), axis=-1)
    rng = np.random.default_rng(2)
    part = rng.integers(0, len(motion.block), 400)
    position = 1.1 * rng.uniform(-1, 1, 400) * r.position[-1]
    expected = r.interpolate(tables, level[part], motion.twist_from(twist)[part], position, motion.weight[part])
    seen = part_responses(r, motion, twist, clearance)
    found = seen.at(part, position)
    for name, values in zip(r.tables, expected, strict=True):
        np.testing.assert_allclose(found[name], values, atol=1e-9 * np.abs(values).max())


@pytest.mark.parametrize("samples", [1, 20])
def test_elements_on_the_profile_are_those_of_every_sample(samples: int) -> None:
    """The share of its part for which an element is on the profile is the mean over the samples, with fading edges."""
    drive = rig.drive()
    trace = make_trace(rig.protocol(), drive.ratio)
    motion, start = element_motion(drive, trace, make_blocks(trace, samples)), 0.7
    some = np.arange(0, len(motion.rotation), 97)
    on = elements_on_profile(drive, motion, start, 0.0)
    share = np.zeros((len(motion.rotation), drive.elements))
    share[on.part, on.element] = inside_profile(drive, motion, on.part, on.position)
    step = 2 * np.pi / drive.elements
    for part in some:
        at = motion.rotation[part] + motion.offsets[part][np.isfinite(motion.offsets[part])]
        beta = start + step * np.arange(drive.elements) + at[:, None]
        edge = (drive.usable_limit - np.abs((beta + np.pi) % (2 * np.pi) - np.pi)) / (2 * FADE_HALF_WIDTH) + 0.5
        assert share[part] == pytest.approx(np.clip(edge, 0, 1).mean(axis=0), abs=1e-9)
    assert ((share > 0) & (share < 1)).any()


def test_terms_hold_the_covariance_of_one_element() -> None:
    """At two twists, of elements whose clearance and place deviate at random: an element whose bore lies ahead has less
    twist and stands farther on the profile. Where the element lifts off, the linear terms alone hold too little."""
    drive = load_drive("drive_1", gear_tolerance="IT9", cage_tolerance="IT8")
    r, places = element_responses(drive), place_deviations(drive)
    middle = [len(r.twist) // 2 + k for k in (3, 9)]
    at, position = r.twist[middle], r.position[36]
    rng = np.random.default_rng(5)
    outwards, along = rng.standard_normal((2, 20000))
    torque_of = RegularGridInterpolator((r.solved, r.twist, r.position), r.single, bounds_error=False, fill_value=None)
    clearance = np.clip(outwards * r.deviation, r.solved[0], r.solved[-1])
    moved = position + (drive.ratio - 1) * places.along * along
    torque = [torque_of(np.stack([clearance, twist - places.along * along, moved], axis=1)) for twist in at]
    tables = {name: table[0] for name, table in r.at_clearances(np.zeros(1)).items()}
    terms = np.array([[tables[term(*orders)][k, 36] for k in middle] for orders in TERMS])
    expected = np.cov(torque)
    assert terms.T @ terms == pytest.approx(expected, rel=0.04)
    assert (terms[:2] ** 2).sum(axis=0)[0] < 0.9 * expected[0, 0]
    mean = [tables[term(0, 0)][k, 36] for k in middle]
    assert mean == pytest.approx(np.mean(torque, axis=1), rel=0.02)


def test_a_bore_ahead_of_its_place_takes_twist_from_its_element_and_moves_it_on() -> None:
    """Of fine tolerances, under which the torque is linear: the derivatives along both axes."""
    drive = load_drive("drive_1", gear_tolerance="IT1", cage_tolerance="IT1")
    r, along = element_responses(drive), place_deviations(drive).along
    tables = {name: table[0] for name, table in r.at_clearances(np.zeros(1)).items()}
    by_twist, by_position = np.gradient(tables[term(0, 0)], r.twist, r.position)
    expected = along * ((drive.ratio - 1) * by_position - by_twist)
    loaded = np.s_[36:44, 30:44]
    error = np.abs(tables[term(0, 1)] - expected)[loaded].max()
    assert error < 0.1 * np.abs(along * (drive.ratio - 1) * by_position[loaded]).max()
