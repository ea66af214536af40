"""The twist of a block is that of its neighbours: its noise stays in the residual and leaves what explains it."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reefmu.diagnosis.preprocessing.trace import Trace, make_blocks, make_trace
from reefmu.diagnosis.preprocessing.twist_noise import N_PATHS, at_twist_of_neighbours, noisy_paths
from reefmu.record import make_record
from stiffness_model.numerics.arrays import Array

N, STIFFNESS, NOISE = 600, 2e5, 1e-5


def trace_of(twist: Array, noise: float, seed: int) -> tuple[Trace, Array]:
    """A trace in two runs with a locked crank and a linear drive, and the noise of its twist."""
    error = noise * np.random.default_rng(seed).standard_normal(N)
    columns = {
        "time": 0.1 * np.arange(N),
        "run": np.repeat([1.0, 2.0], N // 2),
        "crank_angle": np.zeros(N),
        "output_angle": -(twist + error),
        "output_torque": STIFFNESS * twist,
        "temperature": np.full(N, 20.0),
    }
    return make_trace(make_record(columns, "twist"), 29.0), error


@pytest.mark.parametrize("samples", [1, 4])
def test_the_noise_of_a_block_leaves_its_twist_and_stays_in_its_residual(samples: int) -> None:
    """Under a constant load the residual is the noise of the twist; only as measured is that twist correlated with
    it."""
    trace, error = trace_of(np.full(N, 1e-3), NOISE, 1)
    blocks = make_blocks(trace, samples)
    found = at_twist_of_neighbours(trace, blocks, np.full(len(blocks.count), STIFFNESS))
    residual = blocks.mean(found.torque - STIFFNESS * found.twist)
    np.testing.assert_allclose(residual, -STIFFNESS * blocks.mean(error), atol=1e-9 * STIFFNESS)
    count = len(residual) // 2
    inside = np.concatenate([np.arange(2, count - 2), np.arange(count + 2, 2 * count - 2)])
    measured, of_neighbours = blocks.mean(trace.twist)[inside], blocks.mean(found.twist)[inside]
    assert np.corrcoef(residual[inside], measured)[0, 1] == pytest.approx(-1.0, abs=1e-6)
    assert abs(np.corrcoef(residual[inside], of_neighbours)[0, 1]) < 4 / np.sqrt(len(inside))


@given(st.integers(0, 1000), st.floats(20.0, 200.0))
def test_the_twist_of_neighbours_is_that_of_a_smooth_motion(seed: int, period: float) -> None:
    """What the neighbours have is as noisy as what is measured, and exact to fourth order."""
    true = 1e-3 * np.sin(2 * np.pi * np.arange(N) / period)
    trace, _ = trace_of(true, NOISE, seed)
    found = at_twist_of_neighbours(trace, make_blocks(trace, 1), np.full(N, STIFFNESS))
    error = found.twist - true
    curvature = 1e-3 * (2 * np.pi / period) ** 4 / 6
    assert np.abs(error).max() < curvature + 6 * NOISE
    assert np.sqrt(np.mean(error**2)) < curvature + 1.1 * NOISE


def test_a_step_is_motion() -> None:
    """Beside a step far above the noise a block keeps its twist, and so do the ends of the runs."""
    true = np.where(np.arange(N) < 100, 0.0, 1e-3)
    trace, _ = trace_of(true, NOISE, 2)
    found = at_twist_of_neighbours(trace, make_blocks(trace, 1), np.full(N, STIFFNESS))
    kept = [0, 1, 98, 99, 100, 101, N // 2 - 2, N // 2 - 1, N // 2, N // 2 + 1, N - 2, N - 1]
    np.testing.assert_array_equal(found.twist[kept], trace.twist[kept])
    assert (found.twist[102 : N // 2 - 2] != trace.twist[102 : N // 2 - 2]).mean() > 0.99


def test_a_twist_without_noise_is_kept() -> None:
    """Up to the fourth derivative of a motion that the third differences of its samples take for noise."""
    trace, _ = trace_of(1e-3 * np.sin(2 * np.pi * np.arange(N) / 60), 0.0, 0)
    found = at_twist_of_neighbours(trace, make_blocks(trace, 1), np.full(N, STIFFNESS))
    np.testing.assert_allclose(found.twist, trace.twist, atol=1e-3 * (2 * np.pi / 60) ** 4 / 6)


def test_paths_differ_by_the_noise_where_they_reverse() -> None:
    """At a reversal by what the noise moves the extreme; on the way between two only by less than the noise, since they
    are monotone there; not at all without noise."""
    true = 1e-3 * np.abs((np.arange(N) / 75) % 2 - 1)
    trace, _ = trace_of(true, NOISE, 3)
    paths = np.array([*noisy_paths(trace)])
    assert paths.shape == (N_PATHS, N)
    deviation = np.sqrt(np.mean((paths - trace.smooth_twist) ** 2, axis=0))
    assert 0.3 * NOISE < np.median(deviation) < 1.5 * NOISE
    assert deviation.max() < 5 * NOISE
    for path in paths:
        up = slice(76, 149)
        assert (np.diff(path[up]) >= 0).all()
    assert not [*noisy_paths(trace_of(np.full(N, 1e-3), 0.0, 0)[0])]
