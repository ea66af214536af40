"""Play, friction and stiffness of cycles are those that were put in; cycles that stick do not count."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.comparison.drive_states import DriveState, Position, common_load, state_positions
from reefmu.comparison.loop_quantities import loop_quantities
from reefmu.comparison.torque_loops import torque_loops
from reefmu.record import Record, join_records, make_record
from stiffness_model.errors import InputError
from tests.torque_ramps import AMPLITUDE, Gear, measured, ramp


def one_position(record: Record) -> Position:
    (position,) = state_positions(DriveState("state", (record,)), 1.0)
    return position


def medians(record: Record) -> dict[str, float]:
    position = one_position(record)
    return {name: float(np.median(v)) for name, v in position.values(common_load([position])).items() if len(v)}


@pytest.mark.parametrize(
    "gear",
    [
        Gear(),
        Gear(play=0.0),
        Gear(play=0.04, stiffness=200.0),
        Gear(friction=4.0, loss=0.2),
        Gear(friction=0.1, loss=0.0),
        Gear(stick=0.004),
        Gear(stick=0.008, friction=4.0, noise=0.5),
    ],
    ids=str,
)
def test_known_quantities_are_found(gear: Gear) -> None:
    found = medians(measured(gear, small=2))
    assert found["play"] == pytest.approx(gear.play, rel=0.06, abs=2e-4)
    assert found["friction"] == pytest.approx(gear.friction, rel=0.06, abs=0.05)
    assert found["load_dependent_friction"] == pytest.approx(gear.loss, abs=0.025)
    assert found["stiffness_high"] == pytest.approx(gear.stiffness, rel=0.05)


def test_quantities_do_not_depend_on_signs_and_zeros() -> None:
    """The zero of the twist is arbitrary, and so is the sense that counts as positive."""
    record = measured(Gear())
    twist, torque = record.twist(1.0), record.output_torque
    other = make_record({"time": record.time, "run": record.run, "twist": 0.3 - twist, "output_torque": -torque})
    assert medians(other) == pytest.approx(medians(record), rel=0.02, abs=1e-3)


def test_continuous_cycles_in_one_run_are_found() -> None:
    """A rig that swings without pause: the first quarter completes the first cycle."""
    turns = measured(Gear(), large=4)
    together = make_record(
        {"time": turns.time, "twist": turns.twist(1.0), "output_torque": turns.output_torque}, "one run"
    )
    loops, stuck = torque_loops(together)
    assert len(loops) >= 3
    assert stuck == 0
    assert [loop_quantities(loop, 12.0)["play"] for loop in loops] == pytest.approx([0.02] * len(loops), rel=0.1)


def test_cycles_below_the_friction_stick_and_do_not_count() -> None:
    position = one_position(measured(Gear(friction=3.0), small=4, small_amplitude=4.5))
    assert (len(position.loops), position.sticking, position.small) == (3, 4, 0)
    assert position.friction == pytest.approx(3.0, rel=0.1)
    position = one_position(measured(Gear(friction=0.5), small=4, small_amplitude=4.5))
    assert (len(position.loops), position.sticking, position.small) == (3, 0, 4)


def test_a_record_that_only_sticks_is_refused() -> None:
    with pytest.raises(InputError, match=r"expected cycles of more than 2 times the friction.*larger torque"):
        one_position(measured(Gear(friction=3.0), large=0, small=4, small_amplitude=4.5))


def test_a_record_without_a_full_cycle_is_refused() -> None:
    torque = np.linspace(0, AMPLITUDE, 400)
    record = make_record({"time": np.arange(400.0), "twist": torque / 400, "output_torque": torque}, "rise.csv")
    with pytest.raises(InputError, match=r"rise\.csv: expected at least one full cycle of the torque"):
        one_position(record)


def test_a_torque_of_the_other_sign_is_refused() -> None:
    record = measured(Gear())
    turned = make_record(
        {"time": record.time, "run": record.run, "twist": -record.twist(1.0), "output_torque": record.output_torque}
    )
    with pytest.raises(InputError, match=r"torque that grows with the twist.*-output_torque"):
        one_position(turned)


def test_a_loop_of_one_direction_has_no_play() -> None:
    """Torque from zero to its greatest value and back: friction and stiffness, but no play."""
    torque = np.abs(ramp(AMPLITUDE, 3000))[:1500]
    sense = np.sign(np.gradient(torque))
    record = make_record({"time": np.arange(1500.0), "twist": (torque - 2 * sense) / 400, "output_torque": torque})
    position = one_position(record)
    found = position.values(common_load([position]))
    assert len(found["play"]) == 0
    assert found["friction"] == pytest.approx([2.0], rel=0.1)
    assert found["stiffness_middle"] == pytest.approx([400.0], rel=0.05)


def test_crank_angles_of_one_record_are_positions() -> None:
    def at(crank: float, seed: int) -> Record:
        record = measured(Gear(), seed)
        columns = {"time": record.time, "run": record.run, "output_torque": record.output_torque}
        angles = {"output_angle": -record.twist(1.0), "crank_angle": np.full(len(record), crank)}
        return make_record(columns | angles)

    # The twist of a locked crank counts from its angle, which only moves the zero.
    positions = state_positions(DriveState("state", (join_records([at(0.0, 0), at(2.0, 1)]),)), 29.0)
    assert [len(position.loops) for position in positions] == [3, 3]
