"""`reefmu export --effect NAME.PARAMETER=VALUE --set FIELD=VALUE`: values from the command line reach the FMU."""

from __future__ import annotations

from pathlib import Path

import pytest

from reefmu.cli import main
from reefmu.fmu.importer.instance import FmuDrive
from stiffness_model import load_drive
from stiffness_model.errors import InputError
from stiffness_model.kinds import KINDS


@pytest.mark.slow
def test_values_and_fields_are_those_of_the_fmu(tmp_path: Path) -> None:
    path = tmp_path / "d.fmu"
    words = ["--effect", "backlash.clearance=5 um", "--effect", "hysteresis.torque=2 N.m", "--effect", "creep"]
    fields = ["--set", "lobes=28", "--set", "gear_tolerance=IT7", "--set", "cage_offset=5 um"]
    assert main(["export", "drive_1", "-o", str(path), "--backend", "python", "--drives", "8", *words, *fields]) == 0
    with FmuDrive(path) as drive:
        read = drive.read(("backlash.clearance", "hysteresis.torque", "creep.compliance", "ratio"))
    assert read["backlash.clearance"] == pytest.approx(5e-6, rel=1e-12)
    assert read["hysteresis.torque"] == 2.0
    assert read["creep.compliance"] == 0.0
    assert read["ratio"] == load_drive("drive_1", lobes=28).ratio == 29


def test_the_command_states_the_start_under_a_load(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A catalogue gear of 10^5 N.m/rad up to its first knee, with a ratio of 50; torques hold a joint."""
    path = str(tmp_path / "g.fmu")
    words = ["export", "CHA-40A-50", "--backend", "python", "--load", "30", "-o", path]
    assert main(words) == 0
    line = "starts under 30 N.m on the output with loaded.ssv: "
    assert f"{line}start.torque = 30 N.m\n" in capsys.readouterr().out
    assert main([*words, "--kind", "joint"]) == 0
    found = capsys.readouterr().out
    assert f"{line}start.torque = 30 N.m, motor.tau = 0.6 N.m, load.tau = -30 N.m\n" in found


def test_a_system_starts_unloaded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "CHA-40A-50", "--ssp", "--load", "30", "-o", str(tmp_path / "g.ssp")]) == 2
    assert capsys.readouterr().err.count("\n") == 1
    assert not list(tmp_path.iterdir())


def test_masses_and_loads_are_taken_with_their_units(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "g.fmu"
    words = ["export", "CHA-40A-50", "--backend", "python", "--kind", "joint", "-o", str(path)]
    assert main([*words, "--motor-inertia", "1.5 kg.cm2", "--load-damping", "2 Nm.s/rad", "--load", "0.03 kNm"]) == 0
    assert "starts under 30 N.m" in capsys.readouterr().out
    with FmuDrive(path) as joint:
        found = joint.read(("motor.inertia", "load.damping"))
    assert found == {"motor.inertia": pytest.approx(1.5e-4, rel=1e-12), "load.damping": 2.0}


@pytest.mark.parametrize(
    ("option", "value", "expected"),
    [
        ("--motor-inertia", "1 kg", "expected a number in kg.m2, or one with its unit (kg.m2, kg.cm2), got '1 kg'"),
        ("--load", "much", "expected a number in N.m, or one with its unit (N.m, Nm, kN.m, kNm), got 'much'"),
        ("--step", "1 mm", "expected a number in s, or one with its unit (s, ms, min, h), got '1 mm'"),
    ],
)
def test_a_wrong_unit_is_answered_with_those_expected(
    option: str, value: str, expected: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["export", "CHA-40A-50", "-o", str(tmp_path / "d.fmu"), option, value])
    assert stop.value.code == 2
    assert f"argument {option}: {expected}" in capsys.readouterr().err


FIELDS = {
    "rolling element eccentric": ("gear_tolerance", "IT6"),
    "cycloidal": ("disc_thickness", "30 mm"),
    "catalogue": ("k3", "200 N.m/arcmin"),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("form", ["drive", "joint"])
def test_fields_and_values_reach_the_model_of_every_kind(
    kind: str, form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without solving its lookup."""
    asked: list[tuple[object, object]] = []

    def build(drive: object, effects: object, **_: object) -> None:
        asked.append((drive, effects))
        raise InputError("asked for")

    monkeypatch.setattr("reefmu.commands.fmus.export.build_model", build)
    name, value = FIELDS[kind]
    words = ["--set", f"{name}={value}", "--effect", "hysteresis.torque=2 N.m", "--effect", "creep"]
    example = KINDS[kind].example
    assert main(["export", example, "-o", str(tmp_path / "d.fmu"), "--kind", form, "--backend", "python", *words]) == 2
    assert asked == [(load_drive(example, **{name: value}), {"hysteresis": {"torque": 2.0}, "creep": {}})]
    assert asked[0][0] != load_drive(example)


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--effect", "backlsh.clearance=5 um"], "unknown effect 'backlsh'"),
        (["--effect", "backlash.clearence=5 um"], "did you mean 'clearance'?"),
        (["--effect", "backlash.clearance=5"], "--effect backlash.clearance: expected"),
        (
            ["--effect", "viscous_friction.coefficient=5"],
            "expected a rotational damping with its unit, such as '1 N.m.s",
        ),
        (["--effect", "backlash.clearance"], "NAME or NAME.PARAMETER=VALUE, such as backlash.clearance='5 um'"),
        (["--effect", "backlash=5 um"], "NAME or NAME.PARAMETER=VALUE"),
        (["--effect", "backlash.clearance=5 um", "--effect", "backlash.clearance=6 um"], "once"),
        (["--effect", "backlash.clearance=2 m"], "backlash.clearance: expected a value within"),
        (["--set", "lobs=28"], "did you mean 'lobes'"),
    ],
)
def test_a_wrong_value_is_one_line_and_leaves_nothing(
    words: list[str],
    message: str,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("reefmu.model.drive_model.cached_lookup", lambda *_: pytest.fail("tables before the check"))
    assert main(["export", "drive_1", "-o", str(tmp_path / "d.fmu"), "--drives", "8", *words]) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if not line.startswith(("note: ", "warning: "))]
    assert len(lines) == 1
    assert message in lines[0]
    assert not list(tmp_path.iterdir())
