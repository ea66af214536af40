"""Paths and speeds from noisy angles: noise is not motion."""

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reefmu.diagnosis.preprocessing.motion import (
    estimate_rate,
    estimate_speed,
    monotone_path,
    rate_errors,
    signal_noise,
    turning_points,
)

TRUE = np.concatenate(
    [
        np.linspace(0, 1, 30),
        np.full(190, 1.0),
        np.linspace(1, 0, 20),
        np.full(100, 0.0),
        np.linspace(0, -1, 25),
        np.linspace(-1, 1, 50),
        np.linspace(1, -1, 50),
    ]
)
TIME = np.linspace(0, 0.01 * (len(TRUE) - 1), len(TRUE))


@pytest.mark.parametrize("correlation", [0.0, 0.6])
def test_noise_does_not_lengthen_the_path(correlation: float) -> None:
    rng = np.random.default_rng(1)
    noise = rng.standard_normal(len(TRUE))
    for k in range(1, len(noise)):
        noise[k] = correlation * noise[k - 1] + np.sqrt(1 - correlation**2) * noise[k]
    angle = TRUE + 0.005 * noise
    size = signal_noise(angle, [(0, len(angle))])
    assert size == pytest.approx(0.005, rel=0.35)
    path = monotone_path(angle, size)
    length = np.abs(np.diff(TRUE)).sum()
    assert np.abs(np.diff(path)).sum() == pytest.approx(length, rel=0.01)
    assert np.abs(np.diff(angle)).sum() > 1.1 * length
    assert np.abs(path - TRUE).max() < 4 * 0.005
    speed = estimate_speed(angle, TIME, size)
    assert np.abs(speed[70:180]).max() < 0.02 * np.abs(speed[:30]).max()
    assert speed[5:20] == pytest.approx(1 / 0.29, rel=0.25)


@pytest.mark.parametrize("samples", [40, 300, 3000])
def test_an_angle_that_stands_still_has_no_path(samples: int) -> None:
    """Of a run that is all noise, whose range is that of the noise, as of one that moves as well."""
    angle = 0.3 + 0.005 * np.random.default_rng(2).standard_normal(samples)
    path = monotone_path(angle, 0.005)
    assert np.abs(np.diff(path)).sum() < 4 * 0.005
    assert np.mean(np.diff(path) == 0) > 0.8


def test_a_ripple_is_no_noise() -> None:
    """Two of three runs hold a torque while the crank turns: their twist follows the elements, a period in 12 samples;
    in a fourth nothing moves and the last digit stands still."""
    k, rng = np.arange(160), np.random.default_rng(4)
    ripple = 1e-5 * np.sin(2 * np.pi * k / 12)
    angle = np.concatenate([1e-3 * np.sin(2 * np.pi * k / 160), ripple, ripple]) + 1e-6 * rng.standard_normal(480)
    runs = [(0, 160), (160, 320), (320, 480), (480, 640)]
    found = signal_noise(np.concatenate([angle, np.full(160, 2e-4)]), runs)
    assert found == pytest.approx(1e-6, rel=0.3)
    path = monotone_path(angle[160:320], found)
    assert np.abs(path - ripple).max() < 5e-6


def test_loops_of_few_samples_are_no_noise_where_the_others_move_evenly() -> None:
    """Of simulated angles: two runs of slow loops, and one of loops of ten samples, nearly all reversals."""
    slow = np.abs(np.arange(240) % 60 - 30.0) * 3e-5
    fast = np.abs(np.arange(22) % 10 - 5.0) * 6e-4
    angle = np.concatenate([slow, slow, fast])
    runs = [(0, 240), (240, 480), (480, 502)]
    assert signal_noise(angle, runs) == 0.0
    noisy = angle + 1e-6 * np.random.default_rng(3).standard_normal(len(angle))
    assert signal_noise(noisy, runs) == pytest.approx(1e-6, rel=0.3)


def test_angles_without_noise_are_unchanged() -> None:
    np.testing.assert_array_equal(monotone_path(TRUE, 0.0), TRUE)
    smooth = np.sin(TIME)
    assert estimate_speed(smooth, TIME, 0.0) == pytest.approx(np.cos(TIME), abs=1e-2)


@pytest.mark.parametrize("change", ["to shorter steps", "to longer steps"])
def test_the_speed_is_exact_to_second_order_where_the_sampling_rate_changes(change: str) -> None:
    """Central differences over both steps alike would give the speed in their middle, 22 ms away."""
    time = np.concatenate([np.arange(0.0, 1.0, 0.05), 1.0 + 0.005 * np.arange(200)])
    if change == "to longer steps":
        time = (time[-1] - time)[::-1]
    angle = np.sin(time) + 2e-6 * np.random.default_rng(0).standard_normal(len(time))
    moving = np.abs(np.cos(time)) > 0.1
    assert np.abs(estimate_speed(angle, time, 2e-6) - np.cos(time))[moving].max() < 4e-3


@given(st.lists(st.floats(-1, 1), min_size=2, max_size=40), st.floats(0.01, 1))
def test_between_turning_points_no_return_exceeds_the_limit(values: list[float], least: float) -> None:
    angle = np.array(values)
    points = turning_points(angle, least)
    assert points[0] == 0
    assert points[-1] == len(angle) - 1
    assert np.all(np.diff(points[1:]) >= 0)
    inner = points[1:-1]
    assert np.all(np.abs(np.diff(angle[inner])) > least)
    for a, b in itertools.pairwise(inner):
        rising = np.sign(angle[b] - angle[a]) * angle[a : b + 1]
        assert (np.maximum.accumulate(rising) - rising).max() <= least


@pytest.mark.parametrize("noise", [0.0, 1e-7])
@pytest.mark.parametrize(("late", "gap"), [(4, 0.0), (4, 1e-6), (4, 2e-5), (40, 0.0)])
def test_late_time_stamps_do_not_distort_the_speed(late: int, gap: float, noise: float) -> None:
    """Time stamps repeat for some samples and go on a microsecond later, where the steps become shorter."""
    true = np.concatenate([np.arange(50) * 0.14, 49 * 0.14 + 1e-3 * np.arange(1, 200)])
    stamps = true.copy()
    stamps[49 : 50 + late] = stamps[49 + late] - gap
    speed = estimate_speed(2.0 * true + noise * np.random.default_rng(0).standard_normal(len(true)), stamps, noise)
    assert np.delete(speed, np.arange(46 - late, 54 + 2 * late)) == pytest.approx(2.0, rel=0.05)
    # A time stamp shared by many samples lies in their middle.
    assert np.abs(speed).max() < 2.0 * (late / 2 + 3)


@pytest.mark.parametrize("late", [0, 6])
def test_a_motion_has_its_speed_from_where_the_sampling_becomes_denser(late: int) -> None:
    """A drive stands still, is sampled slowly, and then turns; also where the clock is late as it begins, so that the
    first samples of the motion share a time stamp. A window over both would find hardly any speed."""
    true = np.concatenate([np.arange(50) * 0.14, 49 * 0.14 + 1e-3 * np.arange(1, 200)])
    stamps = true.copy()
    stamps[49 : 50 + late] = stamps[49 + late]
    angle = 2.0 * np.maximum(true - 49 * 0.14, 0.0)
    for seed in range(10):
        noisy = angle + 2e-6 * np.random.default_rng(seed).standard_normal(len(true))
        speed = estimate_speed(noisy, stamps, 2e-6)
        assert np.abs(speed[:48]).max() < 1e-3
        assert speed[50:] == pytest.approx(2.0, rel=0.05)


def test_a_rate_is_hardly_less_than_it_is_where_a_speed_loses_half() -> None:
    """A twist that swings by little more than its noise as the crank turns fast."""
    time, noise = 1e-3 * np.arange(400), 6e-6
    true, rate = 2e-5 * (1 - np.cos(200 * time)), 2e-5 * 200 * np.sin(200 * time)
    found: dict[str, list[float]] = {"rate": [], "speed": []}
    errors: list[float] = []
    said: list[float] = []
    for seed in range(40):
        rng = np.random.default_rng(seed)
        twist = true + noise * rng.standard_normal(len(true))
        for name, estimate in (("rate", estimate_rate), ("speed", estimate_speed)):
            found[name].append(float(estimate(twist, time, noise) @ rate / (rate @ rate)))
        errors.append(float(np.mean((estimate_rate(twist, time, noise) - rate) ** 2)))
        said.append(float(np.mean(rate_errors(twist, time, noise, 20, rng) ** 2)))
    assert np.mean(found["rate"]) > 0.8
    assert np.mean(found["speed"]) < 0.6
    assert np.mean(errors) == pytest.approx(np.mean(said), rel=0.35)


def test_the_rate_of_a_simulated_angle_has_no_errors() -> None:
    assert estimate_rate(np.sin(TIME), TIME, 0.0) == pytest.approx(np.cos(TIME), abs=1e-2)
    assert not rate_errors(np.sin(TIME), TIME, 0.0, 3, np.random.default_rng(0)).any()


@pytest.mark.parametrize("count", [1, 2, 3])
def test_few_samples_have_a_rate(count: int) -> None:
    """And a speed, from three on."""
    angle, time = 0.1 * np.arange(count), np.arange(count) * 1.0
    assert estimate_speed(angle, time, 1e-3) == pytest.approx(0.1 if count > 2 else 0.0, abs=1e-9)
    assert estimate_speed(angle, np.zeros(count), 1e-3) == pytest.approx(0.0)
    assert estimate_rate(angle, time, 1e-3) == pytest.approx(0.1 if count > 1 else 0.0, abs=1e-9)
    assert estimate_rate(angle, np.zeros(count), 1e-3) == pytest.approx(0.0)


def test_loops_at_three_rates_are_as_smooth_as_each_other_in_their_own_time() -> None:
    """In one run, ten and a hundred times as fast as the first, with a clock that jitters: errors grow as the rates."""
    rng, noise, steps = np.random.default_rng(0), 2e-6, np.repeat([0.5, 0.05, 0.005], 120)
    time, sample = (steps * (1 + 0.03 * rng.standard_normal(360))).cumsum(), np.arange(360) % 120
    # The sides of the loops bend, as where a torque rises evenly.
    side, turn = np.arcsin(np.sin(2 * np.pi * sample / 60)), 2 * np.pi / 60 / steps
    twist = 1e-3 * side**3 + noise * rng.standard_normal(360)
    rate = 3e-3 * side**2 * np.sign(np.cos(2 * np.pi * sample / 60)) * turn
    said = rate_errors(twist, time, noise, 50, rng).std(axis=0)
    error = np.abs(estimate_rate(twist, time, noise) - rate)
    inside = (sample % 15 > 2) & (sample % 15 < 13)
    slow, middle, fast = (said[k : k + 120][inside[k : k + 120]].mean() for k in (0, 120, 240))
    assert middle / slow == pytest.approx(10, rel=0.4)
    assert fast / middle == pytest.approx(10, rel=0.4)
    assert np.median((error / said)[inside]) < 0.8


@given(
    st.lists(st.sampled_from([0.0, 1e-9, 1e-6, 1e-3, 2e-3, 1.0, 1e3]), min_size=1, max_size=60),
    st.sampled_from([1e-9, 1e-3, 1.0]),
    st.integers(0, 99),
)
def test_rates_are_finite_whatever_the_clock(steps: list[float], noise: float, seed: int) -> None:
    rng, time = np.random.default_rng(seed), np.cumsum(steps)
    moved, read = rng.standard_normal((2, len(time)))
    angle = moved.cumsum() * 10 ** rng.uniform(-6, 2) + noise * read
    assert np.isfinite(estimate_rate(angle, time, noise)).all()
    assert np.isfinite(estimate_speed(angle, time, noise)).all()
    assert np.isfinite(rate_errors(angle, time, noise, 2, rng)).all()
