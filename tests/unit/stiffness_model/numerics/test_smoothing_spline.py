"""Smoothing splines: an independent solution, what their slopes err by, and corners."""

import numpy as np
import pytest
from scipy.interpolate import make_smoothing_spline

from stiffness_model.numerics.smoothing_spline import smoothing_spline


def test_the_slopes_are_those_of_an_independent_solution_with_the_same_smoothness() -> None:
    rng = np.random.default_rng(0)
    time = np.sort(rng.uniform(0, 6, 200))
    values, variance = np.sin(3 * time) + 0.01 * rng.standard_normal(200), np.full(200, 1e-4)
    spline = smoothing_spline(time, values, variance)
    other = make_smoothing_spline(time, values, lam=1e-4 / spline.intensity)
    assert spline.slopes(values) == pytest.approx(other.derivative()(time), abs=1e-7)


@pytest.mark.parametrize("intensity", [1e-2, 1.0, 1e1])
def test_slopes_err_as_said_where_the_second_derivative_is_white_noise(intensity: float) -> None:
    """Of many functions that are sampled at uneven times, with a few times as much noise in half of the values."""
    rng = np.random.default_rng(1)
    step = rng.choice([0.01, 0.03], 300)
    time = np.concatenate([[0.0], step.cumsum()])
    variance = np.where(time < time[-1] / 2, 1e-6, 1e-5)
    found, said = [], []
    for _ in range(40):
        turn = np.sqrt(intensity * step) * rng.standard_normal(300)
        slope = np.concatenate([[0.0], turn.cumsum()])
        advance = step * slope[:-1] + step / 2 * turn + np.sqrt(intensity * step**3 / 12) * rng.standard_normal(300)
        path = np.concatenate([[0.0], advance.cumsum()])
        values = path + np.sqrt(variance) * rng.standard_normal(301)
        spline = smoothing_spline(time, values, variance)
        found.append((spline.slopes(values) - slope) ** 2)
        said.append((spline.slope_errors(20, rng) ** 2).mean(axis=0))
    half = np.arange(301) < 150
    for part in (half, ~half):
        ratio = np.sqrt(np.mean(found, axis=0)[part].mean() / np.mean(said, axis=0)[part].mean())
        assert ratio == pytest.approx(1.0, abs=0.2)


def test_a_corner_does_not_bend_what_is_beside_it() -> None:
    rng = np.random.default_rng(2)
    time = np.linspace(0, 4, 401)
    values, variance = np.abs(time % 2 - 1) + 0.003 * rng.standard_normal(401), np.full(401, 9e-6)
    slope = smoothing_spline(time, values, variance, [100, 200, 300]).slopes(values)
    true = np.where(np.arange(401) % 200 < 100, -1.0, 1.0)
    inside = np.delete(np.arange(400), [100, 200, 300])
    assert slope[inside] == pytest.approx(true[inside], abs=0.01)
    assert slope[[100, 200, 300]] == pytest.approx(0.0, abs=0.01)
    bent = smoothing_spline(time, values, variance).slopes(values)
    assert np.abs((bent - true)[inside]).max() > 0.3


@pytest.mark.parametrize("count", [2, 3, 4])
def test_few_values_have_the_slope_between_them(count: int) -> None:
    time = np.arange(count) * 0.5
    spline = smoothing_spline(time, 2 * time, np.full(count, 1e-12))
    assert spline.slopes(2 * time) == pytest.approx(2.0)
    assert np.isfinite(spline.slope_errors(3, np.random.default_rng(0))).all()


def test_a_long_record_has_slopes() -> None:
    """Of 120 000 values on a straight line, which are as smooth as any: the equations stay positive definite."""
    time = np.arange(120_000.0)
    values = 2.0 * time + 1e-3 * np.random.default_rng(4).standard_normal(len(time))
    spline = smoothing_spline(time, values, np.full(len(time), 1e-6))
    assert spline.slopes(values) == pytest.approx(2.0, abs=1e-4)
    assert spline.slope_errors(2, np.random.default_rng(5)).std() < 1e-4


@pytest.mark.parametrize("short", [1e-6, 1e-8, 1e-12])
def test_a_step_far_shorter_than_the_others_leaves_their_slopes(short: float) -> None:
    time = np.concatenate([np.arange(20.0), 19.0 + short + np.arange(20.0)])
    values = 2.0 * time + 0.01 * np.random.default_rng(6).standard_normal(40)
    assert smoothing_spline(time, values, np.full(40, 1e-4)).slopes(values) == pytest.approx(2.0, abs=0.01)
