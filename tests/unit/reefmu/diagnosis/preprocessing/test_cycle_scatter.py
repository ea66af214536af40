"""Scatter between cycles that repeat in torque: its size and correlation are found, and count as what they are."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from reefmu.diagnosis.forward.base_curve import power_base
from reefmu.diagnosis.preparation import prepare_problem
from reefmu.diagnosis.preprocessing.cycles import find_cycles
from reefmu.diagnosis.preprocessing.trace import make_blocks, make_trace
from reefmu.record import Record, join_records, make_record, with_output_locked
from stiffness_model.numerics.arrays import Array

STIFFNESS, AMPLITUDE = 500.0, 25.0
"""N.m/rad and N.m."""
SAMPLES = 900


def slow_process(n: int, rng: np.random.Generator, length: float) -> Array:
    """(n,) autoregression of standard deviation 1 whose correlation length is a share of n."""
    rho = np.exp(-1 / (length * n))
    values = [float(rng.standard_normal())]
    for e in rng.standard_normal(n - 1):
        values.append(rho * values[-1] + np.sqrt(1 - rho**2) * float(e))
    return np.array(values)


def ramps(scatter: float, cycles: int = 8, seed: int = 0, length: float = 0.15, noise: float = 0.1) -> Record:
    """Cycles of torque of different durations on a spring with friction; scatter, noise: N.m. length: of the scatter,
    over a cycle, which is two branches and two halves."""
    rng = np.random.default_rng(seed)
    parts: list[Record] = []
    for run in range(cycles):
        n = SAMPLES + 60 * (run % 3)
        phase = np.linspace(0, 1, n)
        elastic = AMPLITUDE * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * phase))
        torque = elastic + 2 * np.sign(np.cos(2 * np.pi * phase)) + scatter * slow_process(n, rng, length)
        columns = {
            "time": 20.0 * run + (8 + run % 3) * phase,
            "run": np.full(n, float(run)),
            "twist": elastic / STIFFNESS,
            "output_torque": torque + noise * rng.standard_normal(n),
        }
        parts.append(with_output_locked(make_record(columns)))
    return join_records(parts)


@pytest.mark.parametrize("scatter", [0.5, 1.5])
def test_size_and_correlation_are_found(scatter: float) -> None:
    record = ramps(scatter)
    trace = make_trace(record, 1.0)
    problem = prepare_problem(record, trace, power_base(trace))
    found = problem.cycle_scatter
    assert found is not None
    assert found.rms == pytest.approx(scatter, rel=0.3)
    # A cycle has two half branches and a whole one; 0.15 of it is 0.3 of a branch.
    assert 0.15 < found.length < 0.9
    assert np.sqrt(problem.block_variance.mean()) == pytest.approx(np.hypot(scatter, 0.1), rel=0.3)
    # It is no white noise of this size, which would average out over the blocks of a branch, two of them in a cycle.
    assert problem.variance.mean() > len(problem.torque) / 16 / 32 * problem.block_variance.mean()


def test_the_size_is_as_uncertain_as_is_said() -> None:
    """Errors of the variance over ten records are as large as their stated deviation, within a factor of two."""
    errors, stated = list[float](), list[float]()
    for seed in range(10):
        record = ramps(1.0, seed=seed)
        trace = make_trace(record, 1.0)
        found = prepare_problem(record, trace, power_base(trace)).cycle_scatter
        assert found is not None
        errors.append(2 * np.log(found.rms))
        stated.append(found.level_deviation)
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) / np.mean(stated) < 2


def test_simulated_scatter_has_the_estimated_size() -> None:
    record = ramps(1.0)
    trace = make_trace(record, 1.0)
    found = prepare_problem(record, trace, power_base(trace)).cycle_scatter
    assert found is not None
    drawn = found.simulate(300, np.random.default_rng(1))
    assert drawn.std() == pytest.approx(found.rms, rel=0.05)
    starts = np.flatnonzero(found.long == 0)
    assert len(starts) == 8
    # Independent between runs, correlated within: of neighbouring blocks as stated.
    inner, across = starts[1] - 50, starts[1]
    assert abs(np.corrcoef(drawn[across - 1], drawn[across])[0, 1]) < 0.25
    stated = found.long_share * found.long[inner] + (1 - found.long_share) * found.short[inner]
    assert np.corrcoef(drawn[inner - 1], drawn[inner])[0, 1] == pytest.approx(stated, abs=0.1)


def test_cycles_that_do_not_differ_add_no_variance() -> None:
    record = ramps(0.0, noise=0.5)
    trace = make_trace(record, 1.0)
    found = prepare_problem(record, trace, power_base(trace)).cycle_scatter
    assert found is None or found.rms < 0.15


def test_cycles_that_repeat_in_time_have_their_differences_in_the_noise() -> None:
    """A run of loops of one duration, as a rig makes them that drives the twist."""
    rng = np.random.default_rng(0)
    time = np.arange(4000) / 100
    twist = 0.05 * np.sin(2 * np.pi * time / 8)
    torque = STIFFNESS * twist + 2 * np.sign(np.cos(2 * np.pi * time / 8)) + 0.5 * rng.standard_normal(len(time))
    record = make_record({"time": time, "twist": twist, "output_torque": torque})
    trace = make_trace(record, 1.0)
    problem = prepare_problem(record, trace, power_base(trace))
    assert problem.noise.repeated
    assert problem.cycle_scatter is None


def test_cycles_of_one_kind_are_found_and_others_left_out() -> None:
    large = ramps(0.0, cycles=3)
    small = replace(large, output_torque=0.2 * large.output_torque)
    both = join_records([small, ramps(0.0, cycles=4)])
    trace = make_trace(both, 1.0)
    found = find_cycles(both, make_blocks(trace, 5))
    assert found is not None
    assert found.kind.tolist() == [0, 0, 0, 1, 1, 1, 1]
    assert found.amplitude[0] == pytest.approx(0.2 * found.amplitude[3], rel=0.1)
    assert set(found.number.tolist()) == set(range(7))
    alone = ramps(0.0, cycles=1)
    assert find_cycles(alone, make_blocks(make_trace(alone, 1.0), 5)) is None
