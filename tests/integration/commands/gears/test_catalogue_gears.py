"""Commands on a catalogue gear: from its name to a curve, an FMU and a diagnosis; and one line where none applies."""

from __future__ import annotations

import csv
import json
import re
import shutil
from pathlib import Path

import numpy as np
import pytest

from reefmu.cli import main
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.model import build_model
from reefmu.simulate import simulate_signal
from stiffness_model import ARCMIN

needs_compiler = pytest.mark.skipif(
    not any(shutil.which(n) for n in ("cc", "gcc", "clang")), reason="no C compiler on the PATH"
)
GEAR = "CHA-40A-50"


def test_gears_are_listed_with_their_sources(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["gears"]) == 0
    listed = capsys.readouterr().out
    for words in (
        GEAR,
        "k1 100 kN.m/rad",
        "t2 196 N.m",
        "CHA manual 12/2015",
        "stiffness 113 N.m/arcmin",
        "second hand",
    ):
        assert words in listed.replace("\n     ", " ")
    assert listed.index("RV-42N") < listed.index("rows without a curve") < listed.index("CSF-17-50")


def test_the_curve_file_holds_the_sheet_s_lines(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["curve", GEAR, "--out", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr()
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["curve.csv", "curve.png"]
    assert "hysteresis loss        below 1 arcmin" in shown.out
    # The branches of the loop are the curve plus and minus this torque.
    assert "models contain the effect hysteresis of 14.544 N.m, half the width of the sheet's loop" in shown.out
    # No band, and no play, of which the sheet states nothing.
    assert [line.split() for line in shown.out.splitlines()[2:4]] == [
        ["twist", "torque", "stiffness"],
        ["[arcmin]", "[N.m]", "[N.m/arcmin]"],
    ]
    assert not re.search(r"backlash|P10|^play", shown.out, re.MULTILINE)
    assert "without contact forces" in shown.err
    with (tmp_path / "out" / "curve.csv").open(newline="") as file:
        head, *rows = list(csv.reader(file))
    assert head[:5] == [
        "twist [arcmin]",
        "torque_mean [N.m]",
        "torque_p10 [N.m]",
        "torque_p90 [N.m]",
        "stiffness [N.m/arcmin]",
    ]
    twist, torque = np.array(rows, float)[:, :2].T
    corner = np.abs(twist - 54 / 100e3 / ARCMIN).argmin()
    assert torque[corner] == pytest.approx(54.0, rel=1e-8)
    assert float(np.interp(1e-3 / ARCMIN, twist, torque)) == pytest.approx(118.4, rel=1e-7)


def test_results_as_json_leave_out_what_the_sheet_does_not_state(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["curve", GEAR, "--json", "--out", str(tmp_path / "out")]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [found[name] for name in ("full_torque_p10 [N.m]", "full_torque_p90 [N.m]", "play [arcmin]")] == [None] * 3
    assert found["lost_motion [arcmin]"] > 0


@pytest.mark.parametrize(
    ("kind", "backend"),
    [
        pytest.param("drive", "native", marks=needs_compiler),
        ("joint", "python"),
        pytest.param("joint", "native", marks=[needs_compiler, pytest.mark.slow]),
        pytest.param("drive", "python", marks=pytest.mark.slow),
    ],
)
def test_an_fmu_in_one_command_has_no_contact_outputs(kind: str, backend: str, tmp_path: Path) -> None:
    path = tmp_path / "gear.fmu"
    assert main(["export", GEAR, "-o", str(path), "--kind", kind, "--backend", backend]) == 0
    assert main(["check", str(path)]) == 0
    with FmuDrive(path) as drive:
        assert {"max_contact_force", "load_share"}.isdisjoint(drive.outputs)
        assert "measured.tau" in drive.outputs
        outputs = drive.initialize({"output.phi": -1e-3} if kind == "drive" else {})
        read = drive.read(("ratio", "hysteresis.torque"))
    if kind == "drive":
        assert outputs["output.tau"] == pytest.approx(118.4, rel=1e-12)
    assert read["ratio"] == 50.0
    assert read["hysteresis.torque"] == pytest.approx(100e3 * ARCMIN / 2)


@needs_compiler
def test_a_native_fmu_with_clearance_creep_and_compliance_agrees_with_python(tmp_path: Path) -> None:
    path = tmp_path / "gear.fmu"
    effects = [
        "backlash.clearance=0.5 um",
        "creep.compliance=1e-6 rad/(N.m)",
        "structural_compliance.compliance=2e-6 rad/(N.m)",
    ]
    words = [word for effect in effects for word in ("--effect", effect)]
    assert main(["export", GEAR, "-o", str(path), "--set", "ratio=-50", "--backend", "native", *words]) == 0
    assert main(["check", str(path)]) == 0


@pytest.mark.parametrize(
    "words",
    [
        ["draw", GEAR],
        ["plan", GEAR, "--out", "plan"],
        ["curve", GEAR, "--individual", "2"],
        ["export", GEAR, "-o", "a.fmu", "--individual", "2"],
        ["export", GEAR, "-o", "a.fmu", "--effect", "missing_ball"],
        ["export", "RV-42N", "-o", "a.fmu"],
        ["curve", "CSF-17-50"],
        ["curve", GEAR, "--set", "k4=2 N.m/rad"],
        ["explore", "study.toml", "--out", "designs"],
    ],
    ids=lambda words: " ".join(words[:2]),
)
def test_what_does_not_apply_is_one_line_and_status_2(
    words: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    study = f'name = "a"\nbase = "{GEAR}"\n[parameters]\nlobes = [28, 30]\n[objectives]\nlost_motion = "min"\n'
    (tmp_path / "study.toml").write_text(study, "utf-8")
    assert main(words) == 2
    errors = capsys.readouterr().err.splitlines()
    assert len(errors) == 1
    assert "Traceback" not in errors[0]
    assert [path.name for path in tmp_path.iterdir()] == ["study.toml"]


def test_compare_takes_a_catalogue_gear(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """It is its own row to the printed digit."""
    assert main(["compare", GEAR, "--out", str(tmp_path / "out")]) == 0
    shown = capsys.readouterr().out
    assert "virtual drives" not in shown
    rows = [line.split() for line in shown.splitlines() if line[:8].strip().isdecimal()]
    assert len(rows) > 4
    assert all(row[1] == row[2] for row in rows)


@pytest.mark.slow
def test_the_diagnosis_takes_a_catalogue_gear(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A record with less hysteresis than the sheet's limit: found, the lines left as they are, the rest is noise."""
    model = build_model(GEAR, {"hysteresis": {"torque": 4.0}})
    corners = [0.0, *(sign * reach for reach in (6e-4, 1.4e-3, 2.2e-3) for sign in (1, -1))]
    twist = np.interp(np.linspace(0, len(corners) - 1, 4001), np.arange(len(corners)), corners)
    time = 0.01 * np.arange(len(twist))
    crank = 0.5 * time
    output = crank / 50 - twist
    inputs = np.stack([crank, np.gradient(crank, time), output, np.gradient(output, time), 0 * time + 20], axis=1)
    torque = simulate_signal(model, time, inputs)["output.tau"]
    torque = torque + np.random.default_rng(1).normal(0, 0.5, len(time))
    columns = ["time [s]", "crank_angle [rad]", "output_angle [rad]", "output_torque [N.m]", "temperature [degC]"]
    values = np.stack([time, crank, output, torque, inputs[:, 4]], axis=1)
    np.savetxt(tmp_path / "record.csv", values, delimiter=",", header=",".join(columns), comments="")
    assert main(["diagnose", str(tmp_path / "record.csv"), "--drive", GEAR, "--out", str(tmp_path / "found")]) == 0
    assert "without its sheet's hysteresis" in capsys.readouterr().err
    found = json.loads((tmp_path / "found" / "diagnosis.json").read_text("utf-8"))
    assert found["verdict"] == "named"
    assert [effect["name"] for effect in found["effects"]] == ["hysteresis"]
    fitted = found["effects"][0]["parameters"]["torque"]
    assert fitted["low"] <= 4.0 <= fitted["high"]
    assert found["gap"]["after"] == pytest.approx(found["gap"]["noise"], rel=0.05)
    assert (
        main(["export", str(tmp_path / "found" / "model.toml"), "-o", str(tmp_path / "g.fmu"), "--backend", "python"])
        == 0
    )


@pytest.mark.slow
def test_a_locked_crank_leaves_the_ratio_open(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """model.toml of a curve then has no ratio: exporting it needs one from the caller."""
    twist = 2e-3 * np.sin(np.linspace(0, 12, 3001))
    torque = build_model(GEAR, inherent=False).lookup.torque(twist) + np.random.default_rng(2).normal(
        0, 0.5, len(twist)
    )
    rows = np.stack([0.01 * np.arange(len(twist)), twist, torque], axis=1)
    np.savetxt(tmp_path / "r.csv", rows, delimiter=",", header="time [s],twist [rad],output_torque [N.m]", comments="")
    points = np.array([[0, 0], [5.4e-4, 54], [54 / 100e3 + 142 / 140e3, 196], [3e-3, 456.228571]])
    np.savetxt(tmp_path / "c.csv", points, delimiter=",", header="twist [rad],torque [N.m]", comments="")
    out = tmp_path / "found"
    assert main(["diagnose", str(tmp_path / "r.csv"), "--curve", str(tmp_path / "c.csv"), "--out", str(out)]) == 0
    capsys.readouterr()
    export = ["export", str(out / "model.toml"), "-o", str(tmp_path / "g.fmu"), "--backend", "python"]
    assert main(export) == 2
    assert "expected the field 'ratio'" in capsys.readouterr().err
    assert main([*export, "--set", "ratio=-100"]) == 0
    with FmuDrive(tmp_path / "g.fmu") as drive:
        drive.initialize()
        assert drive.read(("ratio",))["ratio"] == -100.0
