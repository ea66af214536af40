"""Friction at the crank from the torques of crank and output."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reefmu.diagnosis import diagnose_record
from reefmu.diagnosis.fitted_values import CrankLosses
from reefmu.diagnosis.losses.crank_losses import crank_losses
from reefmu.diagnosis.report.text import efficiency_text, sensor_text
from reefmu.model.drive_model import describe_effects
from reefmu.model.model_file import load_model
from reefmu.record import Record
from tests.both_torques import TRUE, both_torques
from tests.friction_record import GEAR

LAW = ("torque", "fraction", "viscous")


def losses(record: Record) -> CrankLosses:
    found = crank_losses(record, GEAR.ratio)
    assert isinstance(found, CrankLosses), found
    return found


def efficiency(load: float, speed: float) -> float:
    """With the crank driving, at a load at the output, from the true parameters."""
    useful = load / GEAR.ratio
    return useful / (useful + TRUE["torque"] + TRUE["fraction"] * useful + TRUE["viscous"] * speed)


def test_the_true_friction_is_found() -> None:
    found = losses(both_torques())
    assert found.kind == "cycles"
    for name in LAW:
        assert found.parameters[name].value == pytest.approx(TRUE[name], rel=0.05)
        assert found.parameters[name].low < TRUE[name] < found.parameters[name].high
    assert found.after < 0.1 * found.before
    for at in found.efficiencies:
        assert at.driving.value == pytest.approx(efficiency(at.load, at.speed), abs=0.003)
        assert at.driven_back.value == pytest.approx(2 - 1 / efficiency(at.load, at.speed), abs=0.005)


@pytest.mark.slow
@pytest.mark.parametrize("turning", [True, False])
def test_intervals_hold_what_cycles_differ_by(turning: bool) -> None:
    """Of 60 records whose friction differs by 10 % from cycle to cycle, intervals of 95 % hold the mean friction's
    efficiency in all but a few; without the scatter they are several times narrower."""
    held, width = 0, []
    for seed in range(60):
        at = losses(both_torques(seed, turning=turning, scatter=0.1, inside=0.0)).efficiencies[-1]
        held += at.driving.low <= efficiency(at.load, at.speed) <= at.driving.high
        width.append(at.driving.high - at.driving.low)
    assert held >= 52
    steady = losses(both_torques(turning=turning, inside=0.0)).efficiencies[-1].driving
    assert np.median(width) > 3 * (steady.high - steady.low)


def test_errors_of_the_sensors_are_no_friction() -> None:
    found = losses(both_torques(scale=1.06, offset=0.3))
    assert found.sensors["scale"].value == pytest.approx(1.06, abs=0.01)
    assert found.sensors["offset"].value == pytest.approx(0.3, abs=0.02)
    assert found.parameters["fraction"].value == pytest.approx(1.06 * TRUE["fraction"], rel=0.05)
    scale, offset = sensor_text(found)
    assert "torque constant" in scale
    assert "offset" in offset
    assert not sensor_text(losses(both_torques()))


def test_what_the_motion_does_not_separate_is_said() -> None:
    """The crank turns one way at one speed, and drives throughout."""
    record = both_torques(cycles=8)
    n = len(record)
    rng = np.random.default_rng(1)
    crank, load = 3.0 * record.time, 100 + 60 * np.sin(0.9 * record.time)
    motor = load / 50 * 1.2 + 0.01 * rng.standard_normal(n)
    one_way = replace(record, crank_angle=crank, output_torque=load, crank_torque=motor)
    found = losses(replace(one_way, output_angle=crank / 50 - load * 1e-5))
    assert found.kind == "turns of the crank"
    assert not found.sensors
    assert set(found.parameters) == {"torque", "fraction"}
    assert found.parameters["fraction"].value == pytest.approx(0.2, abs=0.01)
    said = " ".join(found.assumptions)
    for text in ("turns one way", "power flows one way", "speed hardly changes"):
        assert text in said


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda r: {"crank_torque": None}, "one torque"),
        (lambda r: {"crank_angle": 0 * r.time}, "the crank does not turn"),
        (lambda r: {"crank_torque": -r.crank_torque}, "wrong sign"),
        (lambda r: {"crank_angle": np.where(r.time < 0.5, r.crank_angle, r.crank_angle[25])}, "are needed"),
    ],
)
def test_a_record_that_shows_no_losses_has_a_reason(change: Any, reason: str) -> None:
    record = both_torques()
    found = crank_losses(replace(record, **change(record)), GEAR.ratio)
    assert isinstance(found, str)
    assert reason in found
    assert "ratio is not known" in str(crank_losses(record, None))


def test_a_diagnosis_states_the_losses_and_its_model_has_them(tmp_path: Path) -> None:
    found = diagnose_record(both_torques(scatter=0.03), "CHA-40A-50", out=tmp_path)
    assert found.losses is not None
    assert "crank_friction" not in found.not_candidates
    table = json.loads((tmp_path / "diagnosis.json").read_text("utf-8"))["crank_friction"]
    assert table["parameters"]["fraction"]["value"] == found.losses.parameters["fraction"].value
    assert table["efficiency"][-1]["driving"]["low"] < table["efficiency"][-1]["driving"]["high"]
    model = describe_effects(load_model(tmp_path / "model.toml"))["crank_friction"]
    assert {name: model[name] for name in LAW} == {n: v.value for n, v in found.losses.parameters.items()}
    page = (tmp_path / "report.html").read_text("utf-8")
    assert "efficiency, crank driving" in page
    assert "4 cycles differ by" in page
    first_screen = page.partition("What to do next")[0]
    assert "Friction at the crank, from both torques" in first_screen
    assert efficiency_text(found.losses.efficiencies[-1]) in first_screen


def test_a_diagnosis_says_why_both_torques_show_no_losses() -> None:
    record = both_torques()
    found = diagnose_record(replace(record, crank_torque=-(record.crank_torque + 0)), "CHA-40A-50")
    assert found.losses is None
    assert "wrong sign" in found.not_candidates["crank_friction"]
