"""What is said of a record: sampling, quantisation, repeats, and what the diagnosis can make of it."""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from reefmu.diagnosis import diagnose_record
from reefmu.effects.effect_facts import select_candidates
from reefmu.inspection import RecordInspection, inspect_record, inspection_text
from reefmu.inspection.diagnosability import diagnosability
from reefmu.inspection.sampling import quantisation_step, sampling
from reefmu.record import TORQUE_SIDES, make_record, read_file
from stiffness_model.numerics.arrays import Array
from tests.both_torques import both_torques

TIME = np.linspace(0, 10, 1001)


def inspected(folder: Path, head: str, *columns: Array) -> RecordInspection:
    path = folder / "record.csv"
    np.savetxt(path, np.stack(columns, axis=1), fmt="%.12g", delimiter=",", header=head, comments="")
    return inspect_record(read_file(path))


def at_times(time: Array) -> RecordInspection | object:
    return sampling(make_record({"time": time, "twist": 1e-3 * np.sin(time), "output_torque": 9 * np.sin(time)}))


def test_rates_of_regular_irregular_and_coarse_clocks() -> None:
    regular = at_times(TIME)
    assert regular.rate == pytest.approx(100)
    assert not regular.irregular
    assert not regular.coarse_clock
    rng = np.random.default_rng(0)
    uneven = at_times(np.cumsum(rng.uniform(0.005, 0.015, 1000)))
    assert uneven.irregular
    assert uneven.rate == pytest.approx(100, rel=0.05)
    coarse = at_times(np.floor(TIME / 0.05) * 0.05)
    assert coarse.coarse_clock
    assert coarse.step == pytest.approx(0.05)
    assert coarse.rate == pytest.approx(100, rel=0.01)
    assert coarse.shared_stamps == pytest.approx(0.8, abs=0.01)
    gap = at_times(np.concatenate([TIME, TIME + 15]))
    assert gap.gaps == 1
    assert gap.longest_step == pytest.approx(5)


def test_runs_at_different_rates_are_regular() -> None:
    time = np.concatenate([np.arange(0, 5, 0.01), np.arange(0, 5, 0.1)])
    run = np.repeat([0, 1], [500, 50])
    found = sampling(make_record({"time": time, "run": run, "twist": np.sin(time), "output_torque": np.sin(time)}))
    assert not found.irregular


@pytest.mark.parametrize("step", [1.5e-5, 0.378, 2.0])
def test_quantisation_is_found_behind_the_rounding_of_the_file(step: float) -> None:
    signal = 40 * step * np.sin(np.linspace(0, 20, 5000))
    rounded = np.array([float(f"{x:.7g}") for x in np.round(signal / step) * step])
    assert quantisation_step(rounded) == pytest.approx(step, rel=1e-4)
    assert quantisation_step(signal) is None
    assert quantisation_step(np.zeros(10)) is None


def test_candidates_are_those_of_the_diagnosis(tmp_path: Path) -> None:
    found = inspected(tmp_path, "time [s],twist [mrad],output_torque [N.m]", TIME, np.sin(TIME), 9 * np.sin(TIME))
    able = found.diagnosis
    for base in ("drawing", "power law"):
        assert (able.candidates[base], able.excluded[base]) == select_candidates(found.reading.record.missing, base)
    text = inspection_text(found, "reefmu diagnose record.csv")
    assert "thermal_clearance: the record has no temperature that changes" in text
    assert "missing: run, crank_angle, temperature" in text
    assert "twist [mrad] -> twist [rad], [mrad] by the header (x 0.001)" in text


def test_a_constant_temperature_shows_no_more_than_none(tmp_path: Path) -> None:
    head = "time [s],twist [mrad],output_torque [N.m],temperature [degC]"
    loop = np.sin(TIME), 9 * np.sin(TIME)
    able = inspected(tmp_path, head, TIME, *loop, 0 * TIME + 21.5).diagnosis
    assert "that changes" in able.excluded["power law"]["thermal_clearance"]
    assert (
        "thermal_clearance" in inspected(tmp_path, head, TIME, *loop, 20 + TIME / 100).diagnosis.candidates["power law"]
    )


def test_a_wrong_sign_prevents_a_diagnosis_and_is_said(tmp_path: Path) -> None:
    found = inspected(tmp_path, "time [s],twist [mrad],output_torque [N.m]", TIME, np.sin(TIME), -9 * np.sin(TIME))
    assert "can show nothing as it is: the torque falls as the twist grows" in " ".join(
        inspection_text(found, "").split()
    )


def test_angles_without_a_ratio_are_said(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    head = "time [s],crank_angle [rad],output_angle [rad],output_torque [N.m]"
    found = inspected(tmp_path, head, TIME, rng.uniform(0, 6, 1001), rng.uniform(0, 0.1, 1001), np.sin(TIME))
    assert found.diagnosis.ratio is None
    assert "without a drawing: expected a crank that turns" in " ".join(inspection_text(found, "").split())


def test_cycles_that_repeat_in_time_and_in_torque_are_told_apart(tmp_path: Path) -> None:
    head = "time [s],twist [mrad],output_torque [N.m]"
    in_time = inspected(tmp_path, head, TIME, np.sin(2 * np.pi * TIME / 2), 9 * np.sin(2 * np.pi * TIME / 2))
    assert in_time.diagnosis.pairs_in_time > 0
    assert in_time.cycles.groups
    drifting = np.sin(2 * np.pi * (TIME / 2 + 0.035 * TIME**2))
    in_torque = inspected(tmp_path, head, TIME, drifting + 0.2 * TIME, 9 * drifting)
    assert in_torque.diagnosis.pairs_in_time == 0
    assert in_torque.cycles.groups
    text = inspection_text(in_torque, "")
    assert "in time: no cycles" in text
    assert "standard deviation between cycles" in text
    assert re.search(r"\n +-9 to 9 N.m, \d+ branches of run 0: ", text)


def test_torques_of_branches_have_no_exponent(tmp_path: Path) -> None:
    head = "time [s],twist [mrad],output_torque [N.m]"
    text = inspection_text(inspected(tmp_path, head, TIME, np.sin(np.pi * TIME), 140 * np.sin(np.pi * TIME)), "")
    assert "140 to -140 N.m, " in text
    assert "1.4e+02" not in text


def test_a_torque_of_the_motor_is_said_here_and_by_the_diagnosis(tmp_path: Path) -> None:
    head = "time [s],twist [mrad],referred_motor_torque [N.m]"
    found = inspected(tmp_path, head, TIME, np.sin(TIME), 9 * np.sin(TIME))
    text = " ".join(inspection_text(found, "").split())
    assert TORQUE_SIDES["motor"] in text
    assert "friction that is found is that of motor, crank and drive together" in text
    few = make_record({"time": TIME[:50], "twist": np.sin(TIME[:50]), "referred_motor_torque": TIME[:50]})
    assert TORQUE_SIDES["motor"] in diagnose_record(few).notes
    at_output = make_record({"time": TIME[:50], "twist": np.sin(TIME[:50]), "output_torque": TIME[:50]})
    assert TORQUE_SIDES["motor"] not in diagnose_record(at_output).notes


def test_the_conversion_of_a_current_is_stated(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    head = "time [s],crank_angle [rad],output_angle [rad],motor_current [A]"
    table = np.stack([TIME, 5 * np.sin(TIME), 5 * np.sin(TIME) / -29, np.cos(TIME)], axis=1)
    np.savetxt(path, table, fmt="%.12g", delimiter=",", header=head, comments="")
    columns = {"ratio": -29, "torque_constant": "95 mN.m/A", "motor_inertia": "0.4 kg.cm2"}
    found = inspect_record(read_file(path, columns))
    text = " ".join(inspection_text(found, "").split())
    assert "motor_current x torque constant 0.095 N.m/A x ratio -29, less motor inertia 4e-05 kg.m2" in text
    assert found.to_dict()["torque_constants"]["torque_constant"] == pytest.approx(0.095)
    hanging = inspect_record(
        read_file(
            path,
            {
                "time": "time",
                "output_angle": "output_angle",
                "pendulum": {"mass": 3, "length": 0.4},
            },
        )
    )
    assert "that of a pendulum of 3 kg at 0.4 m on the output" in inspection_text(hanging, "")


def test_both_torques_show_friction_at_the_crank() -> None:
    record = both_torques()
    able = diagnosability(record)
    assert able.shows_losses
    assert "crank_friction" not in able.excluded["drawing"]
    still = diagnosability(replace(record, crank_torque=-(0 + record.output_torque) / 50))
    assert not still.shows_losses
    assert "wrong sign" in still.excluded["drawing"]["crank_friction"]
