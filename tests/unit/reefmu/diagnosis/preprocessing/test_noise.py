"""Noise is found where cycles repeat, whatever its correlation, and admitted to be a guess where none do."""

import numpy as np
import pytest

from reefmu.diagnosis.preprocessing.autocorrelation import autocorrelation
from reefmu.diagnosis.preprocessing.noise import cycle_period, estimate_noise
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.model.contacts.tables import cached_lookup
from tests import diagnosis_rig as rig


@pytest.mark.parametrize("correlation", [0.0, 0.5, 0.9])
def test_size_and_correlation(correlation: float) -> None:
    record = rig.measured({"hysteresis": {"torque": 4.0}}, noise=0.8, correlation=correlation, seed=3)
    trace = make_trace(record, rig.drive().ratio)
    found = estimate_noise(trace, cached_lookup(rig.drive()).stiffness(trace.twist))
    size = float(np.sqrt(np.mean(found.variance(cached_lookup(rig.drive()).stiffness(trace.twist)))))
    assert found.repeated
    assert size == pytest.approx(0.8, rel=0.2)
    assert found.correlation_time == pytest.approx((1 + correlation) / (1 - correlation), rel=0.45)


def test_without_repeats_it_says_so() -> None:
    record = rig.measured({}, noise=0.8, correlation=0.0, full=False)
    some = slice(0, 150)
    from dataclasses import replace

    short = replace(
        record,
        **{
            name: getattr(record, name)[some]
            for name in ("time", "run", "crank_angle", "output_angle", "output_torque", "temperature")
        },
    )
    trace = make_trace(short, rig.drive().ratio)
    found = estimate_noise(trace, cached_lookup(rig.drive()).stiffness(trace.twist))
    assert not found.repeated
    assert found.torque < 2.0


@pytest.mark.parametrize("correlation", [0.0, 0.6, 0.9, 0.97])
def test_a_slow_noise_is_not_taken_for_a_small_one(correlation: float) -> None:
    """Differences of cycles of 100 samples, less mean and slope, of a quantised sum of a slow and a faster noise."""
    sizes, sums = [], []
    line = np.stack([np.ones(100), np.linspace(-1, 1, 100)], axis=1)
    for seed in range(8):
        slow = rig.noise_of(7200, 0.9, correlation, seed).reshape(2, 36, 100)
        fast = rig.noise_of(7200, 0.436, 0.6 * correlation, seed + 100).reshape(2, 36, 100)
        first, second = 0.5 * np.round((slow + fast) / 0.5)
        pieces = (first - second) / np.sqrt(2)
        pieces = pieces - pieces @ line @ np.linalg.pinv(line)
        found = autocorrelation(list(pieces))
        sizes.append(np.sqrt(found.variance))
        sums.append(found.variance * found.correlation_time)
    truth = sum(a**2 * (1 + r) / (1 - r) for a, r in ((0.9, correlation), (0.436, 0.6 * correlation)))
    assert np.mean(sizes) == pytest.approx(1.0, abs=0.1)
    assert 0.5 * truth < np.mean(sums) < 2 * truth


def test_loops_of_growing_size_have_a_period_too() -> None:
    """Two pushes each to two, three and five parts: the first never cross the middle of the whole."""
    push = (1 - np.cos(2 * np.pi * np.arange(100) / 100)) / 2
    pushes = np.concatenate([np.linspace(0, 0.1, 10), *(0.1 + top * push for top in (0.4, 0.4, 0.6, 0.6, 1.0, 1.0))])
    assert cycle_period(pushes) == pytest.approx(100, abs=2)
    assert cycle_period(np.linspace(0, 1, 400)) == 0
    rng = np.random.default_rng(0)
    assert cycle_period(np.cumsum(rng.standard_normal(400))) == 0
