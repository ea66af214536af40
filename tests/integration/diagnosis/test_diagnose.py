"""Diagnoses of simulated records whose effects are known."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from reefmu.diagnosis import Diagnosis, diagnose_record
from reefmu.diagnosis.schema import PROBABILITY_SCHEMA, SCHEMA, VERDICTS
from reefmu.model.model_file import load_model
from reefmu.record import Record, make_record
from stiffness_model.errors import InputError
from tests import diagnosis_rig as rig


def names(found: Diagnosis) -> set[str]:
    return {effect.name for effect in found.effects}


def test_a_record_without_effects_gets_none() -> None:
    found = diagnose_record(rig.measured({}, correlation=0.9, seed=1), drive=rig.drive())
    assert found.verdict == "none"
    assert not found.effects
    assert found.hypotheses[0] == replace(found.hypotheses[0], effects=(), unnamed=False)
    assert found.global_p is not None
    assert found.global_p > 0.01


@pytest.mark.slow
def test_probabilities_are_those_of_the_schema() -> None:
    """Sorted, with a sum of 1; an effect's is that of its hypotheses; the matrix has rows below 1."""
    answer = diagnose_record(rig.measured({"hysteresis": {"torque": 4.0}}, seed=3), drive=rig.drive()).to_dict()
    assert answer["schema"] == PROBABILITY_SCHEMA
    shown = [h["probability"] for h in answer["hypotheses"]]
    assert shown == sorted(shown, reverse=True)
    assert 0.99 <= sum(shown) <= 1 + 1e-6
    assert answer["hypotheses"][0]["effects"] == ["hysteresis"]
    (effect,) = answer["effects"]
    containing = sum(h["probability"] for h in answer["hypotheses"] if "hysteresis" in (h["effects"] or ()))
    assert effect["probability"] == pytest.approx(containing, abs=0.01)
    assert effect["probability"] > 0.9
    matrix = np.array(answer["isolability"]["matrix"])
    assert len(answer["isolability"]["names"]) == len(matrix) > 10
    assert (matrix.sum(axis=1) < 1 + 1e-9).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "size"),
    [
        ("backlash", {"clearance": 3e-6}),
        ("kinematic_error", {"amplitude_1": 6e-5, "phase_1": 1.0}),
    ],
)
def test_a_single_effect_is_named_with_its_size(name: str, size: dict[str, float]) -> None:
    found = diagnose_record(rig.measured({name: size}, seed=2), drive=rig.drive())
    assert (found.verdict, names(found)) == ("named", {name})
    assert found.effects[0].share > 0.8
    assert found.gap.after < 1.1 * found.gap.noise < found.gap.before
    for parameter, truth in size.items():
        value = found.effects[0].parameters[parameter]
        assert value.low <= value.value <= value.high
        assert value.value == pytest.approx(truth, rel=0.25, abs=0.3 if parameter.startswith("phase") else 0.0)


@pytest.mark.slow
def test_the_compliance_of_line_contacts_is_inside_the_interval_of_a_linear_spring() -> None:
    """Rollers deflect with the power 0.9 of their load: the linear spring that fits best has not the compliance at full
    torque."""
    record = rig.measured({}, seed=5)
    torque, compliance = record.output_torque, 1e-6
    full = float(np.abs(torque).max())
    twist = compliance * np.sign(torque) * np.abs(torque) ** 0.9 * full**0.1
    found = diagnose_record(replace(record, output_angle=record.output_angle - twist), drive=rig.drive())
    assert names(found) == {"structural_compliance"}
    shown = found.effects[0].parameters["compliance"]
    assert shown.value > 1.03 * compliance
    assert shown.low <= compliance <= shown.high


@pytest.mark.slow
def test_two_effects_are_named_and_the_files_written(tmp_path: Path) -> None:
    record = rig.measured({"backlash": {"clearance": 4e-6}, "hysteresis": {"torque": 4.0}}, seed=4)
    found = diagnose_record(record, drive=rig.drive(), out=tmp_path / "out")
    assert (found.verdict, names(found)) == ("named", {"backlash", "hysteresis"})
    assert sorted(p.name for p in (tmp_path / "out").iterdir()) == ["diagnosis.json", "model.toml", "report.html"]
    answer = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert answer["schema"] == PROBABILITY_SCHEMA
    assert answer["verdict"] in VERDICTS
    assert set(answer["gap"]) >= {"unit", "before", "after", "noise", "held_out_before", "held_out_after"}
    page = (tmp_path / "out" / "report.html").read_text()
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "https://" not in page
    assert "src=" not in page
    assert "fetch(" not in page
    model = load_model(tmp_path / "out" / "model.toml")
    assert {e.name for e in model.effects} == {"backlash", "hysteresis"}


def test_indistinguishable_effects_are_reported_with_the_test_that_separates_them() -> None:
    found = diagnose_record(rig.measured({"coulomb_friction": {"torque": 5.0}}, full=False), drive=rig.drive())
    assert found.verdict == "ambiguous"
    assert {"coulomb_friction"} in [names(found), *(set(a) for a in found.alternatives)]
    assert any("rotate" in line for line in found.next_experiment)


@pytest.mark.slow
def test_a_ripple_that_no_effect_explains_is_unknown() -> None:
    record = rig.measured({}, noise=0.3)
    twist = record.twist(rig.drive().ratio)
    bump = 9.0 * np.sin(14 * np.pi * twist / rig.drive().max_twist)
    found = diagnose_record(
        make_record(
            {
                "time": record.time,
                "run": record.run.astype(float),
                "crank_angle": record.crank_angle,
                "output_angle": record.output_angle,
                "temperature": record.temperature,
                "output_torque": record.output_torque + bump,
            }
        ),
        drive=rig.drive(),
    )
    assert found.verdict == "unknown"
    period = rig.drive().max_twist / 7 * 180 * 60 / np.pi
    assert found.remainder_where[0].coordinate == f"twist, period {period:.3g} arcmin"
    assert found.remainder > 2.0


def _one_loop(torque: float) -> Record:
    t = np.arange(200) * 0.1
    return make_record({"time": t, "twist": 1e-3 * np.sin(t), "output_torque": torque * np.sin(t)})


def test_a_record_without_torque_or_with_a_wrong_sign_is_insufficient() -> None:
    nothing = diagnose_record(_one_loop(0.0), drive=rig.drive())
    assert (nothing.verdict, nothing.hypotheses, nothing.to_dict()["schema"]) == ("insufficient", (), SCHEMA)
    wrong_sign = diagnose_record(_one_loop(-50.0), drive=rig.drive())
    assert wrong_sign.verdict == "insufficient"
    assert "wrong sign" in wrong_sign.sentence


def test_invalid_calls_write_nothing(tmp_path: Path) -> None:
    with pytest.raises(InputError):
        diagnose_record(tmp_path / "missing.csv", drive="drive_1", out=tmp_path / "out")
    with pytest.raises(InputError):
        diagnose_record(_one_loop(1.0), drive="drive_1", curve="curve.csv", out=tmp_path / "out")
    assert not (tmp_path / "out").exists()
