"""Virtual drives: reproducibility from the seed, and the statistics of the parts."""

from __future__ import annotations

import math

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.drawing.sampling import BLOCK, Deviations, blocks, draw, nominal

PARTS = ("element", "crank", "cage", "gear")
PINNED = (2.783058724271789, -0.66812828, -0.8478859)
"""Drive 1, seed 0: first position, rad, and the first two deviations of the gear, um."""


@pytest.fixture(scope="module")
def drive_2() -> sm.Drive:
    return sm.load_drive("drive_2")


@pytest.fixture(scope="module")
def many(drive_2: sm.Drive) -> Deviations:
    """960 drives of 87 elements."""
    parts = [draw(drive_2, block, BLOCK, seed=7) for block in range(60)]
    return Deviations(*(np.concatenate([getattr(p, name) for p in parts]) for name in ("beta", *PARTS)))


def same(a: Deviations, b: Deviations) -> bool:
    return all(np.array_equal(getattr(a, name), getattr(b, name)) for name in ("beta", *PARTS))


def test_blocks_cover_the_drives():
    assert [sum(count for _, count in blocks(n)) for n in (1, 15, 16, 17, 1000)] == [1, 15, 16, 17, 1000]
    assert [block for block, _ in blocks(40)] == [0, 1, 2]


def test_seed_fixes_the_drives(drive_2):
    assert same(draw(drive_2, 3, 16, seed=1), draw(drive_2, 3, 16, seed=1))
    assert not np.any(draw(drive_2, 3, 16, seed=1).gear == draw(drive_2, 3, 16, seed=2).gear)
    assert not np.any(draw(drive_2, 3, 16, seed=1).gear == draw(drive_2, 4, 16, seed=1).gear)


def test_a_drive_does_not_depend_on_how_many_are_drawn(drive_2):
    few, all_of_them = draw(drive_2, 2, 5, seed=1), draw(drive_2, 2, 16, seed=1)
    first = Deviations(*(getattr(all_of_them, name)[:5] for name in ("beta", *PARTS)))
    assert same(few, first)
    assert few.beta.shape == (5, 87)


def test_the_deviations_of_a_seed_are_fixed():
    """Saved lookups state their seed, from which the same drives must come in any later version."""
    first = draw(sm.load_drive("drive_1"), 0, 1, seed=0)
    assert first.beta[0, 0] == pytest.approx(PINNED[0], rel=1e-12)
    assert 1e6 * (first.gear[0, :2] - 7e-3) == pytest.approx(PINNED[1:], rel=1e-7)


@pytest.mark.parametrize("part", PARTS)
def test_means_and_sigmas(drive_2, many, part):
    values = getattr(many, part)
    tolerance = drive_2.tolerances[part]
    size = drive_2.crank_radius if part == "crank" else drive_2.element_radius
    error = tolerance.sigma / math.sqrt(values.size)
    assert values.mean() == pytest.approx(size + tolerance.offset, abs=5 * error)
    assert values.std() == pytest.approx(tolerance.sigma, rel=5 / math.sqrt(2 * values.size))
    outside = np.abs(values - values.mean()) > 3 * tolerance.sigma
    assert outside.mean() == pytest.approx(0.0027, abs=0.0009)


def test_parts_and_neighbours_are_independent(many):
    columns = np.stack([getattr(many, part).ravel() for part in PARTS])
    neighbours = np.stack([many.crank[:, :-1].ravel(), many.crank[:, 1:].ravel()])
    for correlation in (np.corrcoef(columns) - np.eye(4), np.corrcoef(neighbours) - np.eye(2)):
        assert np.abs(correlation).max() < 5 / math.sqrt(many.gear.size)


def test_cranks_deviation_per_eccentric(drive_2):
    workshop = sm.load_drive("drive_2", crank_deviation="eccentric")
    per_eccentric, per_element = draw(workshop, 0, 16, seed=3), draw(drive_2, 0, 16, seed=3)
    rows = per_eccentric.crank.reshape(16, 29, 3)
    assert np.all(rows == rows[:, :1])
    assert all(len(set(row)) == 3 for row in rows[:, 0])
    assert all(len(set(row)) == 87 for row in per_element.crank)
    # The other parts are not affected.
    assert np.array_equal(per_eccentric.gear, per_element.gear)
    radii = np.concatenate([draw(workshop, b, 16, seed=3).crank[:, :3] for b in range(200)])
    sigma = workshop.tolerances["crank"].sigma
    assert radii.std() == pytest.approx(sigma, rel=5 / math.sqrt(2 * radii.size))


def test_positions_are_spaced_evenly_from_a_uniform_start(many):
    steps = np.diff(many.beta, axis=1) % (2 * math.pi)
    np.testing.assert_allclose(steps, 2 * math.pi / 87, rtol=1e-11)
    assert np.all((many.beta > -math.pi) & (many.beta <= math.pi))
    starts = np.sort(many.beta[:, 0])
    uniform = np.linspace(-math.pi, math.pi, len(starts))
    # The Kolmogorov-Smirnov statistic exceeds 1.63/sqrt(n) for one seed in a hundred.
    assert np.abs(starts - uniform).max() / (2 * math.pi) < 1.63 / math.sqrt(len(starts))


def test_mean_offset_affects_only_the_cage():
    free, tight = sm.load_drive("drive_1"), sm.load_drive("drive_1", cage_offset=0.0)
    a, b = draw(free, 0, 4, seed=5), draw(tight, 0, 4, seed=5)
    np.testing.assert_allclose(a.cage - b.cage, free.tolerances["cage"].offset, rtol=1e-9)
    assert np.array_equal(a.gear, b.gear)


def test_nominal_drives(drive_2):
    ideal = nominal(drive_2, 8)
    assert ideal.beta.shape == (8, 87)
    assert np.all(ideal.crank == drive_2.crank_radius)
    assert all(np.all(getattr(ideal, part) == drive_2.element_radius) for part in ("element", "cage", "gear"))
    every = np.sort(ideal.beta.ravel())
    np.testing.assert_allclose(np.diff(every), 2 * math.pi / (8 * 87), rtol=1e-9)


@pytest.mark.parametrize("seed", [-1, 1.5, "one", None, True])
def test_bad_seeds(drive_2, seed):
    with pytest.raises(sm.InputError, match="seed: expected a whole number not below 0, got"):
        draw(drive_2, 0, 1, seed)
