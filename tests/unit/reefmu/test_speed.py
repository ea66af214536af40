"""Time stamps that several samples share, of clocks that are late or coarse."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reefmu.speed import central_speed, spread_stamps

SLOW, FAST = 0.14, 1e-3


@pytest.mark.parametrize("late", [1, 6, 40])
def test_a_late_clock_is_set_right_where_the_sampling_becomes_denser(late: int) -> None:
    """The last sample of a slow part is stamped late, and those after it cannot be stamped earlier."""
    true = np.concatenate([np.arange(50) * SLOW, 49 * SLOW + FAST * np.arange(1, 200)])
    stamps = true.copy()
    stamps[49 : 50 + late] = stamps[49 + late]
    np.testing.assert_allclose(spread_stamps(stamps), true, atol=1e-9)
    start = np.maximum(true - 49 * SLOW, 0.0)
    assert central_speed(start**2, stamps) == pytest.approx(central_speed(start**2, true), abs=1e-6)


def test_a_coarse_clock_gives_the_speed_of_an_even_motion() -> None:
    true = 7e-4 * np.arange(400)
    stamps = np.floor(true / 2e-3) * 2e-3
    assert np.abs(spread_stamps(stamps) - true).max() < 2e-3
    speed = central_speed(3.0 * true, stamps)[10:-10]
    assert float(np.mean(speed)) == pytest.approx(3.0, rel=0.05)
    assert speed.max() < 1.6 * 3.0


@given(st.lists(st.sampled_from([0.0, 0.0, 1e-9, 0.01, 0.01, 0.01, 0.3]), min_size=1, max_size=60))
def test_stamps_never_run_backwards_and_others_stay(steps: list[float]) -> None:
    time = np.cumsum(np.array(steps))
    found = spread_stamps(time)
    assert len(found) == len(time)
    assert np.isfinite(found).all()
    assert (np.diff(found) >= 0).all()
    assert np.isfinite(central_speed(time, time)).all()


def test_single_stamps_are_kept() -> None:
    time = np.cumsum(np.random.default_rng(0).uniform(0.6, 1.4, 50))
    np.testing.assert_array_equal(spread_stamps(time), time)
