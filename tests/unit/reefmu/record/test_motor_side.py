"""Torques that were not measured at the output: the conversion, what it needs, and what it refuses."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.record import join_records, make_column_map, make_record, read_record
from reefmu.record.motor_side import GRAVITY, acceleration
from stiffness_model.numerics.arrays import Array

RATIO = -29.0
TIME = np.linspace(0, 4, 2001)
CRANK = 20 * np.sin(1.5 * TIME)
"""rad."""
OUTPUT = CRANK / RATIO - 1e-3 * np.sin(3 * TIME)
TORQUE = 40 * np.sin(3 * TIME)
"""N.m, on the output."""


def columns(**more: Array) -> dict[str, Array]:
    return {"time": TIME, "crank_angle": CRANK, "output_angle": OUTPUT, **more}


def constants(table: Mapping[str, Any]) -> Any:
    return make_column_map(table).constants


def test_power_at_crank_and_output_is_the_same_without_losses() -> None:
    """With ratio = d(crank)/d(output): torque x speed of a rigid drive is what the motor puts in, with its sign."""
    motor = 1.5 * np.cos(TIME)
    rigid = CRANK / RATIO
    record = make_record(
        {"time": TIME, "crank_angle": CRANK, "output_angle": rigid, "motor_torque": motor},
        constants=constants({"ratio": RATIO}),
    )
    assert record.output_torque * np.gradient(rigid, TIME) == pytest.approx(motor * np.gradient(CRANK, TIME))
    assert record.torque_side == "motor"


def test_a_current_gives_the_torque_of_the_motor() -> None:
    current = make_record(
        columns(motor_current=TORQUE / RATIO / 0.095),
        constants=constants({"ratio": RATIO, "torque_constant": "95 mN.m/A"}),
    )
    assert current.output_torque == pytest.approx(TORQUE)
    assert current.torque_side == "motor"


def test_inertia_and_a_pendulum_on_the_crank_are_taken_off() -> None:
    """An independent solution: the motor torque that moves known masses along a known path, by its exact derivative."""
    inertia, mass, length, zero = 4e-5, 0.05, 0.1, 0.3
    second = -20 * 1.5**2 * np.sin(1.5 * TIME)
    motor = TORQUE / RATIO + (inertia + mass * length**2) * second + mass * GRAVITY * length * np.sin(CRANK - zero)
    table = {
        "ratio": RATIO,
        "motor_inertia": "0.4 kg.cm2",
        "pendulum": {"mass": "50 g", "length": "10 cm", "shaft": "crank", "zero": zero},
    }
    record = make_record(columns(motor_torque=motor), constants=constants(table))
    inner = slice(60, -60)  # at its ends a run has no centred window
    assert record.output_torque[inner] == pytest.approx(
        TORQUE[inner], abs=0.02 * 29 * inertia * np.abs(second).max() + 0.1
    )
    without = make_record(columns(motor_torque=motor), constants=constants({"ratio": RATIO}))
    assert np.abs(without.output_torque - TORQUE).max() > 1.0


def test_a_pendulum_on_the_output_is_a_torque_at_the_output() -> None:
    record = make_record(columns(), constants=constants({"pendulum": {"mass": 3.0, "length": 0.4}}))
    assert record.torque_side == "output"
    still = 3.0 * GRAVITY * 0.4 * np.sin(OUTPUT)
    second = np.gradient(np.gradient(OUTPUT, TIME), TIME)
    assert record.output_torque[60:-60] == pytest.approx((still + 3.0 * 0.4**2 * second)[60:-60], abs=0.01)


def test_acceleration_of_a_coarse_clock() -> None:
    """Stamps of 15.6 ms, as some operating systems give them, several samples each."""
    coarse = np.floor(TIME / 0.0156) * 0.0156
    exact = -20 * 1.5**2 * np.sin(1.5 * TIME)
    found = acceleration(20 * np.sin(1.5 * TIME), coarse, np.zeros(len(TIME)))
    assert np.abs(found - exact)[100:-100].max() < 0.05 * np.abs(exact).max()
    again = acceleration(np.tile(CRANK, 2), np.tile(TIME, 2), np.repeat([0, 1], len(TIME)))
    assert again[: len(TIME)] == pytest.approx(again[len(TIME) :])


def test_both_torques_are_kept_each_at_its_side(tmp_path: Path) -> None:
    """The torque at the output is the record's; the motor's stays at the crank, whatever states it."""
    motor = TORQUE / RATIO + 0.1 * np.sign(np.cos(1.5 * TIME))
    table = {"ratio": RATIO, "torque_constant": "95 mN.m/A"}
    stated = {
        "motor_torque": (motor, {}),
        "motor_current": (motor / 0.095, {"torque_constant": table["torque_constant"]}),
        "referred_motor_torque": (motor * RATIO, {"ratio": RATIO}),
    }
    for name, (values, known) in stated.items():
        record = make_record(columns(output_torque=TORQUE, **{name: values}), constants=constants(known))
        assert record.torque_side == "output"
        assert record.output_torque is TORQUE or np.array_equal(record.output_torque, TORQUE)
        assert record.crank_torque == pytest.approx(motor)
    record.to_dataframe().to_csv(tmp_path / "both.csv", index=False)
    assert read_record(tmp_path / "both.csv").crank_torque == pytest.approx(motor)
    assert join_records([record, record]).crank_torque == pytest.approx(np.tile(motor, 2))
    assert join_records([record, make_record(columns(output_torque=TORQUE))]).crank_torque is None
    assert make_record(columns(output_torque=TORQUE)).crank_torque is None


def test_the_inertia_is_taken_off_the_torque_at_the_crank_only() -> None:
    second = -20 * 1.5**2 * np.sin(1.5 * TIME)
    record = make_record(
        columns(output_torque=TORQUE, motor_torque=TORQUE / RATIO + 4e-3 * second),
        constants=constants({"motor_inertia": "40 kg.cm2"}),
    )
    assert record.crank_torque is not None
    assert record.crank_torque[60:-60] == pytest.approx(TORQUE[60:-60] / RATIO, abs=0.01)
    assert np.array_equal(record.output_torque, TORQUE)


def test_a_pendulum_on_the_output_goes_with_the_motor_s_torque() -> None:
    record = make_record(
        columns(motor_torque=TORQUE / RATIO), constants=constants({"pendulum": {"mass": 3.0, "length": 0.4}})
    )
    assert record.torque_side == "output"
    assert record.crank_torque == pytest.approx(TORQUE / RATIO)


def test_the_drive_gives_the_ratio_that_the_map_lacks(tmp_path: Path) -> None:
    path = tmp_path / "motor.csv"
    names = ("time [s]", "crank_angle [rad]", "output_angle [rad]", "motor_torque [N.m]")
    table = np.stack([TIME, CRANK, OUTPUT, TORQUE / RATIO], axis=1)
    np.savetxt(path, table, delimiter=",", header=",".join(names), comments="")
    assert read_record(path, drive_ratio=RATIO).output_torque == pytest.approx(TORQUE)
    assert read_record(path, {"ratio": RATIO}, RATIO).output_torque == pytest.approx(TORQUE)
    with pytest.raises(sm.InputError, match=r"expected the ratio of the drive, -29, in the column map, got 29"):
        read_record(path, {"ratio": -RATIO}, RATIO)
    path.write_text(path.read_text("utf-8").replace("motor_torque", "output_torque"), "utf-8")
    assert read_record(path, drive_ratio=RATIO).output_torque == pytest.approx(TORQUE / RATIO)
    path.write_text(path.read_text("utf-8").replace("output_torque", "referred_motor_torque"), "utf-8")
    inertia = {"motor_inertia": "1e-4 kg.m2"}
    by_map = read_record(path, {"ratio": 2 * RATIO, **inertia}, RATIO).output_torque
    assert by_map == pytest.approx(read_record(path, {"ratio": 2 * RATIO, **inertia}).output_torque)
    assert np.abs(by_map - read_record(path, inertia, RATIO).output_torque).max() > 0.05


@pytest.mark.parametrize(
    ("more", "table", "message"),
    [
        (("motor_torque",), {}, "expected ratio for motor_torque; state it in the file of --columns: ratio = -29"),
        (("motor_current",), {"ratio": -29}, "expected torque_constant for motor_current"),
        (("output_torque",), {"ratio": -29}, "expected no ratio beside output_torque"),
        (("output_torque",), {"motor_inertia": 1e-5}, "expected no motor_inertia beside output_torque"),
        (("output_torque", "motor_current"), {}, "expected torque_constant for motor_current"),
        (("output_torque", "referred_motor_torque"), {}, "expected ratio for referred_motor_torque"),
        (
            ("motor_torque", "motor_current"),
            {},
            "one statement of the torque of the motor, got 'motor_torque and motor",
        ),
        (("output_torque",), {"pendulum": {"mass": 1, "length": 1}}, "output_torque and a pendulum on the output"),
        (("referred_motor_torque",), {"motor_inertia": 1e-5}, "expected ratio for referred_motor_torque"),
        ((), {}, "expected a column 'output_torque'"),
        ((), {"pendulum": {"mass": 1}}, "pendulum: expected a length"),
        ((), {"pendulum": {"mass": 1, "lenght": 1}}, "did you mean 'length'"),
        ((), {"pendulum": {"mass": "1 m", "length": 1}}, "expected a unit of mass such as [kg], got [m]"),
        (("motor_torque",), {"ratio": 0}, "ratio: expected a positive number"),
        (("motor_torque",), {"ratio": -29, "motor_inertia": "-1 kg.m2"}, "motor_inertia: expected a positive number"),
    ],
)
def test_contradictions_are_refused_in_one_line(more: tuple[str, ...], table: dict[str, Any], message: str) -> None:
    with pytest.raises(sm.InputError, match=re.escape(message)):
        make_record(columns(**dict.fromkeys(more, TORQUE)), "record.csv", constants(table))


def test_an_inertia_needs_the_crank_angle() -> None:
    twist = {"time": TIME, "twist": 1e-3 * np.sin(3 * TIME), "motor_torque": TORQUE / RATIO}
    with pytest.raises(sm.InputError, match="expected a column 'crank_angle' for motor_inertia"):
        make_record(twist, constants=constants({"ratio": RATIO, "motor_inertia": 1e-5}))


def test_the_side_is_kept(tmp_path: Path) -> None:
    """Through joining and through a table, in which the column's name states it."""
    at_motor = make_record(columns(referred_motor_torque=TORQUE))
    at_output = make_record(columns(output_torque=TORQUE))
    assert join_records([at_motor, at_motor]).torque_side == "motor"
    with pytest.raises(sm.InputError, match="torques measured at one side"):
        join_records([at_motor, at_output])
    at_motor.to_dataframe().to_csv(tmp_path / "record.csv", index=False)
    again = read_record(tmp_path / "record.csv")
    assert again.torque_side == "motor"
    assert again.output_torque == pytest.approx(TORQUE)
    assert replace(at_motor, source="x").torque_side == "motor"
    assert "referred_motor_torque" in at_motor._repr_html_()
