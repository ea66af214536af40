"""Comparisons of synthetic states: signs, false alarms, coverage, and input that cannot be compared."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from reefmu.comparison import DriveState, StateComparison, compare_states, write_comparison
from reefmu.comparison.comparison_files import read_spread
from reefmu.comparison.state_changes import Change
from stiffness_model.errors import InputError
from tests.torque_ramps import Gear, measured

SPREAD = {"play": 2e-3, "friction": 0.15}
"""Standard deviations between positions of one state."""


def state(name: str, gear: Gear, seed: int, positions: int = 3, offsets: np.ndarray | None = None) -> DriveState:
    """A state at positions that differ by `SPREAD` in play and friction; offsets: (positions, 2) of positions that are
    the same in other states."""
    rng = np.random.default_rng(seed)
    records = []
    for k in range(positions):
        play, friction = rng.standard_normal(2) if offsets is None else offsets[k]
        there = replace(
            gear, play=gear.play + SPREAD["play"] * play, friction=gear.friction + SPREAD["friction"] * friction
        )
        records.append(measured(there, 100 * seed + k, large=2, n=700))
    return DriveState(name, tuple(records))


def change(comparison: StateComparison, quantity: str) -> Change:
    return next(c for c in comparison.changes if c.quantity == quantity)


def test_preload_takes_play_and_adds_friction() -> None:
    found = compare_states([state("loose", Gear(), 1), state("tight", Gear(play=0.005, friction=3.5), 2)])
    play, friction = change(found, "play"), change(found, "friction")
    assert (play.start, play.end, play.direction, friction.direction) == ("loose", "tight", "down", "up")
    assert play.difference.low < -0.015 < play.difference.high < 0
    assert 0 < friction.difference.low < 1.5 < friction.difference.high
    assert play.probability_up < 0.01 < 0.99 < friction.probability_up
    assert change(found, "load_dependent_friction").direction == "not decided"
    assert found.position_spread["play"].degrees == 4


@pytest.mark.slow
def test_equal_states_rarely_differ_and_intervals_hold_the_change() -> None:
    """The whole way from records: 40 comparisons of two states, of which every other one has a change."""
    alarms, covered = [], []
    for trial in range(40):
        shift = 0.006 * (trial % 2)
        found = compare_states(
            [state("a", Gear(), 2 * trial), state("b", Gear(play=0.02 + shift, friction=2 + 50 * shift), 2 * trial + 1)]
        )
        for quantity, size in (("play", shift), ("friction", 50 * shift)):
            one = change(found, quantity)
            covered.append(one.difference.low <= size <= one.difference.high)
            if not shift:
                alarms.append(one.direction != "not decided")
    assert np.mean(covered) >= 0.88
    assert np.mean(alarms) <= 0.15


def test_matched_positions_cancel_in_the_difference() -> None:
    offsets = np.array([[2.0, -5.0], [0.0, 0.0], [-2.0, 5.0]])
    states = [state("a", Gear(), 1, offsets=offsets), state("b", Gear(friction=2.4), 2, offsets=offsets)]
    apart, matched = compare_states(states), compare_states(states, matched=True)
    assert change(apart, "friction").direction == "not decided"
    assert change(matched, "friction").direction == "up"
    low, high = change(matched, "friction").difference.low, change(matched, "friction").difference.high
    assert low < 0.4 < high


def test_one_position_says_what_it_cannot_count(tmp_path: Path) -> None:
    states = [state("a", Gear(), 1, 1), state("b", Gear(), 2, 1)]
    alone = compare_states(states)
    assert any("cannot count what positions of one state differ by" in note for note in alone.notes)
    assert not alone.to_dict()["changes"][0]["counts_positions"]
    several = compare_states([state("c", Gear(), 3), state("d", Gear(), 4)])
    write_comparison(several, tmp_path / "several")
    known = compare_states(states, 1.0, read_spread(tmp_path / "several/compare.json"))
    assert not any("cannot count" in note for note in known.notes)
    narrow, wide = (change(c, "play").difference for c in (alone, known))
    assert wide.high - wide.low > 2 * (narrow.high - narrow.low)
    write_comparison(alone, tmp_path / "alone")
    with pytest.raises(InputError, match="one position each"):
        read_spread(tmp_path / "alone/compare.json")
    with pytest.raises(InputError, match=r"none\.json: expected a compare\.json"):
        read_spread(tmp_path / "none.json")


def test_all_pairs_are_in_the_file(tmp_path: Path) -> None:
    found = compare_states([state(name, Gear(), k) for k, name in enumerate("abc")])
    write_comparison(found, tmp_path / "out")
    written = json.loads((tmp_path / "out/compare.json").read_text())
    pairs = {(c["from"], c["to"]) for c in written["changes"]}
    assert pairs == {("a", "b"), ("a", "c"), ("b", "c")}
    first = written["changes"][0]
    assert first["quantity"] == "play"
    assert set(first["difference"]) == {"value", "low", "high", "unit"}
    assert first["difference"]["unit"] == "rad"
    assert 0 <= first["probability_up"] <= 1
    page = (tmp_path / "out/compare.html").read_text("utf-8")
    assert page.startswith("<!doctype html>")
    assert "http" not in page


def test_names_are_escaped_on_the_page(tmp_path: Path) -> None:
    write_comparison(compare_states([state("<b>", Gear(), 1, 1), state("b", Gear(), 2, 1)]), tmp_path)
    assert "<b>" not in (tmp_path / "compare.html").read_text("utf-8")


def test_what_cannot_be_compared_is_refused() -> None:
    one, other = state("a", Gear(), 1, 1), state("b", Gear(), 2, 1)
    with pytest.raises(InputError, match="expected at least two states to compare, got 'a'"):
        compare_states([one])
    with pytest.raises(InputError, match="expected states with different names, got 'a, a'"):
        compare_states([one, replace(other, name="a")])
    motor = DriveState("b", (replace(other.records[0], torque_side="motor"),))
    with pytest.raises(InputError, match="expected torques measured at one side in all records, got 'motor and output"):
        compare_states([one, motor])
    with pytest.raises(InputError, match="expected matched positions: as many in every state"):
        compare_states([one, state("b", Gear(), 2, 2)], matched=True)


def test_copies_are_no_repeats() -> None:
    one = state("a", Gear(), 1, 1)
    found = compare_states([one, replace(one, name="b")])
    assert any("hold the same samples" in note for note in found.notes)
    assert change(found, "play").direction == "not decided"
    with pytest.raises(InputError, match="expected different measurements at the positions of a state, got 'copies"):
        compare_states([DriveState("a", one.records * 2), state("b", Gear(), 2, 2)])


def test_the_same_records_give_the_same_numbers() -> None:
    states = [state("a", Gear(), 1), state("b", Gear(), 2)]
    assert compare_states(states).to_dict() == compare_states(states).to_dict()
