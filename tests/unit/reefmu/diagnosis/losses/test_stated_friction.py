"""A motor's torque is solved to the output with the friction at the crank that the drive states."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.losses.stated_friction import without_stated_friction
from reefmu.model.chosen_effects import inherent_effects
from reefmu.model.drive_model import describe_effects
from reefmu.model.model_file import load_model
from reefmu.record import Record, make_record
from stiffness_model.catalog.efficiency_table import EfficiencyTable
from tests.both_torques import TRUE, both_torques
from tests.friction_record import GEAR

LOSSY = replace(
    GEAR, name="lossy", efficiency=EfficiencyTable((50.0, 200.0), (50.0, 200.0), ((0.6, 0.75), (0.55, 0.72)))
)
STATED = inherent_effects(LOSSY)["crank_friction"]


def at_motor(record: Record, locked: bool = False) -> Record:
    """The record with the motor's torque, referred to the output, as its only one."""
    assert record.crank_torque is not None
    angles = {"crank_angle": record.crank_angle, "output_angle": record.output_angle}
    motion = {"twist": record.twist(GEAR.ratio)} if locked else angles
    return make_record(
        {"time": record.time, **motion, "referred_motor_torque": GEAR.ratio * record.crank_torque}, "motor.csv"
    )


@pytest.mark.parametrize("turning", [True, False])
def test_the_torque_at_the_output_is_recovered(turning: bool) -> None:
    both = both_torques(turning=turning, inside=0.0, noise=0.0)
    motor = at_motor(both)
    solved = without_stated_friction(motor, TRUE, GEAR.ratio)
    before, after = (np.std(r.output_torque - both.output_torque) for r in (motor, solved))
    assert after < 0.02 * before
    assert solved.torque_side == "motor"


def test_friction_that_no_motor_overcomes_is_refused() -> None:
    motor = at_motor(both_torques())
    with pytest.raises(sm.InputError, match="grows by less than the load"):
        without_stated_friction(motor, TRUE | {"fraction": 1.5}, GEAR.ratio)


@pytest.mark.slow
@pytest.mark.parametrize("turning", [True, False])
def test_stated_losses_are_not_named_and_stay_in_the_model(turning: bool, tmp_path: Path) -> None:
    """Hysteresis of 3 N.m inside a gear that loses a quarter of the power at the crank, from the motor's torque."""
    record = at_motor(both_torques(turning=turning, friction=STATED))
    found = diagnose_record(record, LOSSY, out=tmp_path)
    assert [effect.name for effect in found.effects] == ["hysteresis"]
    size = found.effects[0].parameters["torque"]
    assert size.low < 3.0 < size.high
    assert any("is taken off the motor's torque" in note for note in found.notes)
    kept = describe_effects(load_model(tmp_path / "model.toml"))["crank_friction"]
    assert {name: kept[name] for name in STATED} == STATED
    # Against a sheet without efficiencies the same record shows more than hysteresis.
    other = diagnose_record(record, GEAR)
    assert (other.verdict, [effect.name for effect in other.effects]) != ("named", ["hysteresis"])


@pytest.mark.slow
def test_friction_that_cannot_be_taken_off_is_in_the_model_once(tmp_path: Path) -> None:
    """A record of a twist alone does not show how the crank turns."""
    found = diagnose_record(at_motor(both_torques(turning=False, friction=STATED), locked=True), LOSSY, out=tmp_path)
    assert any("is not taken off" in note for note in found.notes)
    assert "crank_friction" not in describe_effects(load_model(tmp_path / "model.toml"))
