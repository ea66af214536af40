"""Noise is estimated from repeated cycles, whatever its correlation, and marked as uncertain without them."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.signal import lfilter

from reefmu.diagnosis.preprocessing.autocorrelation import (
    LAG_ONE_CORRELATIONS,
    Autocorrelation,
    autocorrelation,
)
from reefmu.diagnosis.preprocessing.noise import Noise, block_variances, cycle_period, estimate_noise
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model.contacts.tables import cached_lookup
from reefmu.record import make_record, with_output_locked
from stiffness_model.numerics.arrays import Array
from tests import diagnosis_rig as rig


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_repeated_cycles_give_size_and_correlation_time(correlation: float) -> None:
    record = rig.measured({"hysteresis": {"torque": 4.0}}, noise=0.8, correlation=correlation, seed=3)
    trace = make_trace(record, rig.drive().ratio)
    found = estimate_noise(trace, cached_lookup(rig.drive()).stiffness(trace.twist))
    size = float(np.sqrt(np.mean(found.variance(cached_lookup(rig.drive()).stiffness(trace.twist)))))
    assert found.repeated
    assert size == pytest.approx(0.8, rel=0.2)
    assert found.correlation.correlation_time == pytest.approx((1 + correlation) / (1 - correlation), rel=0.45)


def loops(
    time: Array, phase: Array, torque: Array, temperature: Array | float = 20.0, amplitude: Array | float = 1.0
) -> Noise:
    """The noise of loops of a twist of 2 mrad times an amplitude along a phase (n,), in cycles, to a judge who takes
    the drive to have no stiffness at all; torque: (n,) N.m, without the noise of 0.5 N.m."""
    torque = torque + rig.noise_of(len(time), 0.5, 0.0, 0)
    columns = {"time": time, "twist": 2e-3 * amplitude * np.sin(2 * np.pi * phase), "output_torque": torque}
    columns["temperature"] = np.broadcast_to(temperature, time.shape)
    trace = make_trace(with_output_locked(make_record(columns)), 1.0)
    return estimate_noise(trace, np.zeros(len(trace)))


@pytest.mark.parametrize("samples", [80.0, 80.3, 80.5])
def test_a_period_that_is_no_whole_number_of_samples_is_no_noise(samples: float) -> None:
    """Where the stiffness is not known either: half a sample is 3.9 N.m of the 100 N.m here."""
    time = np.arange(1600) * 0.01
    phase = time / (0.01 * samples)
    found = loops(time, phase, 100 * np.sin(2 * np.pi * phase))
    assert found.repeated
    assert found.torque == pytest.approx(0.5, rel=0.15)


def test_cycles_of_other_speeds_are_not_compared() -> None:
    """Two loops of each of four speeds, with a damping that makes up to 19 N.m."""
    speed = np.repeat([1.0, 2.0, 4.0, 6.0], 160)
    phase, time = np.arange(640) / 80, np.cumsum(0.1 / speed)
    rate = np.gradient(np.sin(2 * np.pi * phase), time)
    found = loops(time, phase, 100 * np.sin(2 * np.pi * phase) + 4 * rate)
    assert found.torque == pytest.approx(0.5, rel=0.25)


def test_cycles_of_other_temperatures_are_not_compared() -> None:
    """Six loops while the drive warms by 2.5 K in each, in which it gets 2 N.m stiffer, and six at one temperature."""
    phase = np.arange(960) / 80
    temperature = 20 + 2.5 * np.minimum(phase, 6.0)
    torque = (100 + 0.8 * (temperature - 20)) * np.sin(2 * np.pi * phase)
    found = loops(np.arange(960) * 0.01, phase, torque, temperature)
    assert found.torque == pytest.approx(0.5, rel=0.15)


def test_the_ends_of_a_loop_before_another_one_are_not_compared() -> None:
    """Pairs of loops of growing amplitudes: the first samples of a larger one are nearly those of the smaller one."""
    phase = np.arange(1280) / 80
    growing = 0.2 + 0.1 * (phase // 2)
    torque = 500 * growing * np.sin(2 * np.pi * phase)
    found = loops(np.arange(1280) * 0.01, phase, torque, amplitude=growing)
    assert found.repeated
    assert found.torque == pytest.approx(0.5, rel=0.15)


def test_without_repeated_cycles_the_estimate_is_marked() -> None:
    record = rig.measured({}, noise=0.8, correlation=0.0, full=False)
    first = slice(0, 150)
    short = replace(
        record,
        **{
            name: getattr(record, name)[first]
            for name in ("time", "run", "crank_angle", "output_angle", "output_torque", "temperature")
        },
    )
    trace = make_trace(short, rig.drive().ratio)
    found = estimate_noise(trace, cached_lookup(rig.drive()).stiffness(trace.twist))
    assert not found.repeated
    assert found.torque < 2.0


@pytest.mark.parametrize("correlation", [0.0, 0.6, 0.9, 0.97])
def test_slow_noise_is_not_underestimated(correlation: float) -> None:
    """Detrended differences of cycles of 100 samples of slow plus faster noise, quantised."""
    sizes, sums = [], []
    line = np.stack([np.ones(100), np.linspace(-1, 1, 100)], axis=1)
    for seed in range(8):
        slow = rig.noise_of(7200, 0.9, correlation, seed).reshape(2, 36, 100)
        fast = rig.noise_of(7200, 0.436, 0.6 * correlation, seed + 100).reshape(2, 36, 100)
        first, second = 0.5 * np.round((slow + fast) / 0.5)
        segments = (first - second) / np.sqrt(2)
        segments = segments - segments @ line @ np.linalg.pinv(line)
        found = autocorrelation(list(segments))
        sizes.append(np.sqrt(found.variance))
        sums.append(found.variance * found.correlation_time)
    truth = sum(a**2 * (1 + r) / (1 - r) for a, r in ((0.9, correlation), (0.436, 0.6 * correlation)))
    assert np.mean(sizes) == pytest.approx(1.0, abs=0.1)
    assert 0.5 * truth < np.mean(sums) < 2 * truth


@given(st.integers(1, 12), st.integers(1, 6), st.integers(0, 1000))
def test_means_of_neighbours_have_the_covariance_of_their_samples(count: int, lags: int, seed: int) -> None:
    """Against sums over the autocorrelation of all samples, for any mixtures."""
    rng = np.random.default_rng(seed)
    rho = np.array(LAG_ONE_CORRELATIONS)
    shares, probability = rng.dirichlet(np.ones(len(rho)), 3), rng.dirichlet(np.ones(3))
    lag = np.abs(np.subtract.outer(np.arange(count * lags), np.arange(count * lags)))
    of_samples = (rho ** lag[..., None]) @ shares.T
    means = np.kron(np.eye(lags), np.full(count, 1 / count))
    expected = np.stack([(means @ of_samples[..., k] @ means.T)[0] for k in range(3)], axis=1)
    found = Autocorrelation(2.0, shares, probability)
    np.testing.assert_allclose(found.of_means(count, lags), expected @ probability, rtol=1e-9)
    drawn = found.draw_of_means(count, lags, 50, rng)
    assert all(any(np.allclose(one, some) for some in expected.T) for one in drawn.T)


def test_a_block_of_white_and_slow_noise_has_less_variance_than_one_of_slow_noise() -> None:
    """White noise averages out, and the block mean keeps the slow part alone."""
    slow = np.eye(1, len(LAG_ONE_CORRELATIONS), LAG_ONE_CORRELATIONS.index(0.97))
    white = np.eye(1, len(LAG_ONE_CORRELATIONS))
    noise = Noise(2.0, 0.0, Autocorrelation(4.0, 0.5 * slow + 0.5 * white), 4, 400, True)
    whole, own = block_variances(noise, np.ones(2), np.array([1.0, 10.0]))
    assert own[0] == pytest.approx(4.0)
    assert 2.0 * 0.9 + 0.2 < own[1] < 2.0 + 0.2
    assert whole[1] == pytest.approx(4.0 * (0.5 + 0.5 * 1.97 / 0.03) / 10)


def test_loops_of_growing_amplitude_have_a_period() -> None:
    """Two loops each to 0.4, 0.6 and 1.0: the first ones do not cross the middle of the whole range."""
    loop = (1 - np.cos(2 * np.pi * np.arange(100) / 100)) / 2
    loops = np.concatenate([np.linspace(0, 0.1, 10), *(0.1 + top * loop for top in (0.4, 0.4, 0.6, 0.6, 1.0, 1.0))])
    assert cycle_period(loops) == pytest.approx(100, abs=2)
    assert cycle_period(np.linspace(0, 1, 400)) == 0
    rng = np.random.default_rng(0)
    assert cycle_period(np.cumsum(rng.standard_normal(400))) == 0


@pytest.mark.parametrize("variation", [1e-14, 1e-9, 1e-5])
def test_a_stiffness_that_hardly_varies_tells_no_noise_of_the_twist(variation: float) -> None:
    """Where a play has no stiffness, the noise of the torque is as large as elsewhere."""
    trace = make_trace(rig.measured({}, noise=0.8, correlation=0.0, full=False), rig.drive().ratio)
    found = estimate_noise(trace, 2e4 * (1 + variation * np.arange(len(trace.twist))))
    assert found.torque == pytest.approx(0.8, rel=0.1)
    assert found.twist == 0.0


@pytest.mark.parametrize("correlation", [0.0, 0.8, 0.95])
def test_the_level_of_the_noise_is_as_uncertain_as_is_said(correlation: float) -> None:
    """Over records of 27 segments as of pairs of cycles, whose differences are worth half as many samples: errors of
    the variance of block means are within the stated deviation, and at least a quarter of it."""
    rng, errors, stated = np.random.default_rng(1), list[float](), list[float]()
    lag = np.abs(np.subtract.outer(np.arange(6), np.arange(6)))
    true = float((correlation**lag).mean())
    for _ in range(40):
        white = rng.standard_normal((27, 700))
        noise = lfilter([np.sqrt(1 - correlation**2)], [1, -correlation], white)[:, 600:]
        found = autocorrelation([*(row - row.mean() for row in noise)])
        errors.append(float(np.log(found.variance * found.of_means(6, 1)[0] / true)))
        stated.append(found.level_deviation(6, noise.size))
    assert 0.25 * np.mean(stated) < np.sqrt(np.mean(np.square(errors))) < np.mean(stated)
