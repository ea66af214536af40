"""Cycles that repeat in torque: the spread between them is the one that was put in."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from reefmu.record import Record, join_records, make_record, read_record, torque_cycle_spread
from reefmu.record.torque_cycles import torque_branches
from stiffness_model.numerics.arrays import Array

RECORDS = Path(__file__).resolve().parents[5] / "shared/data/cycloidal"
STIFFNESS = 2e4
"""N.m/rad."""


def cycle(run: int, amplitude: float, duration: float, offset: float, n: int = 900, width: float = 0.0) -> Record:
    """One cycle of torque 0, +A, -A, 0 of an arbitrary duration: a spring with hysteresis, its twist offset."""
    phase = np.linspace(0, 1, n)
    torque = amplitude * 2 / np.pi * np.arcsin(np.sin(2 * np.pi * phase))
    direction = np.sign(np.gradient(torque))
    return make_record(
        {
            "time": duration * phase**1.3,
            "run": np.full(n, run),
            "twist": (torque - width * direction) / STIFFNESS + offset,
            "output_torque": torque,
        }
    )


def record(offsets: Array, amplitude: float = 30.0, width: float = 0.0) -> Record:
    """Cycles that repeat in torque and not in time: their durations and numbers of samples differ."""
    lengths = np.linspace(600, 1100, len(offsets)).round().astype(int)
    return join_records(
        [cycle(k, amplitude, 3.0 + k, o, n, width) for k, (o, n) in enumerate(zip(offsets, lengths, strict=True))]
    )


def test_the_spread_of_known_offsets_is_found() -> None:
    offsets = np.array([0.0, 3e-5, -4e-5, 7e-5])
    found = torque_cycle_spread(record(offsets, width=3.0))
    assert found.branches == 12
    assert [len(group.branches) for group in found.groups] == [4, 4, 4]
    assert found.twist == pytest.approx(offsets.std(ddof=1), rel=1e-3)
    assert found.torque == pytest.approx(STIFFNESS * offsets.std(ddof=1), rel=0.02)


def test_equal_cycles_have_no_spread() -> None:
    """Whatever their durations and sampling; hysteresis is not mistaken for it, since branches are compared."""
    found = torque_cycle_spread(record(np.zeros(4), width=5.0))
    assert found.twist < 1e-3 * 30 / STIFFNESS
    # One sample at each reversal may belong to the branch before.
    assert found.torque < 0.03 * 5


def test_cycles_of_other_amplitudes_are_not_paired() -> None:
    parts = [cycle(0, 4.0, 3.0, 0.0), cycle(1, 30.0, 4.0, 1e-4), cycle(2, 4.1, 3.0, 2e-5), cycle(3, 31.0, 5.0, 3e-4)]
    found = torque_cycle_spread(join_records(parts))
    assert sorted({tuple(b.run for b in group.branches) for group in found.groups}) == [(0, 2), (1, 3)]
    small = next(group for group in found.groups if group.branches[0].run == 0)
    assert small.twist == pytest.approx(2e-5 / np.sqrt(2), rel=1e-3)


def test_a_record_whose_cycles_do_not_repeat_says_so() -> None:
    found = torque_cycle_spread(join_records([cycle(0, 4.0, 3.0, 0.0), cycle(1, 30.0, 3.0, 0.0)]))
    assert found.groups == ()
    assert np.isnan(found.twist)
    assert np.isnan(found.torque)


def test_noise_counts_as_the_mean_of_a_level() -> None:
    """White noise of the torque leaves its standard deviation over the root of the samples in a level."""
    rng = np.random.default_rng(0)
    whole = record(np.zeros(6))
    sigma = 0.3
    noisy = make_record(
        {
            "time": whole.time,
            "run": whole.run,
            "twist": whole.twist(1.0),
            "output_torque": whole.output_torque + sigma * rng.standard_normal(len(whole)),
        }
    )
    found = torque_cycle_spread(noisy)
    # About 850 samples a cycle, of which the falling branch has half in 0.9/20 of its range each.
    falling = max(found.groups, key=lambda group: group.samples)
    assert falling.torque == pytest.approx(sigma / np.sqrt(850 / 2 * 0.9 / 20), rel=0.25)


def test_cycles_at_other_crank_angles_are_not_compared() -> None:
    def at(crank: float, run: int) -> Record:
        one = cycle(run, 30.0, 3.0, 0.0)
        columns = {"time": one.time, "run": one.run, "output_torque": one.output_torque}
        return make_record({**columns, "output_angle": one.output_angle, "crank_angle": np.full(len(one), crank)})

    assert torque_cycle_spread(join_records([at(0.0, 0), at(3.0, 1)]), 29.0).groups == ()
    assert len(torque_cycle_spread(join_records([at(0.0, 0), at(0.01, 1)]), 29.0).groups) == 3


def test_branches_lie_between_reversals() -> None:
    one = cycle(7, 30.0, 3.0, 0.0, 901)
    assert [(b.first, b.past) for b in torque_branches(one)] == [(0, 226), (225, 676), (675, 901)]
    assert [b.swing for b in torque_branches(one)] == pytest.approx([30, -60, 30], rel=1e-6)


@pytest.mark.slow
def test_measured_cycles_differ_by_more_than_their_noise() -> None:
    """Three large and five small cycles each, which differ by some newton metres; the sensor's noise is a tenth."""
    paths = sorted(RECORDS.glob("*/*.csv.gz"))
    if not paths:
        pytest.skip(f"measured records, which are not part of this repository: none in {RECORDS}")
    columns = {"TIME": "time [s]", "POSITION": "twist [rev]", "TORQUE": "output_torque [N.m]", "test_nr": "run"}
    spreads = []
    for path in paths:
        found = torque_cycle_spread(read_record(path, columns))
        large = [group for group in found.groups if abs(group.branches[0].swing) > 15]
        assert len(large) == 3, path
        assert all(b.run >= 100 for group in large for b in group.branches), path
        spreads.append(found.torque)
    assert 0.8 < np.median(spreads) < 1.3
