"""`reefmu diagnose`: one record and several, and what is wrong in one line."""

from __future__ import annotations

import contextlib
import json
from pathlib import Path

import numpy as np
import pytest

from reefmu.cli import main
from reefmu.record import Record
from tests import diagnosis_rig as rig


def write(record: Record, path: Path) -> Path:
    columns = {"time [s]": record.time, "run": record.run, "crank_angle [rad]": record.crank_angle,
               "output_angle [rad]": record.output_angle, "output_torque [N.m]": record.output_torque,
               "temperature [degC]": record.temperature}
    table = np.stack([np.asarray(v, float) for v in columns.values()], axis=1)
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.12g")
    return path


def test_two_states_of_a_drive_give_a_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    tight = write(rig.measured({"hysteresis": {"torque": 4.0}}, seed=6), tmp_path / "tight.csv")
    loose = write(rig.measured({"hysteresis": {"torque": 4.0}, "backlash": {"clearance": 4e-6}}, seed=7),
                  tmp_path / "loose.csv")
    assert main(["diagnose", str(tight), str(loose), "--drive", "drive_1", "--out", str(tmp_path / "out")]) == 0
    found = {name: json.loads((tmp_path / "out" / name / "diagnosis.json").read_text()) for name in ("tight", "loose")}
    assert [e["name"] for e in found["tight"]["effects"]] == ["hysteresis"]
    assert {e["name"] for e in found["loose"]["effects"]} == {"hysteresis", "backlash"}
    said = capsys.readouterr().out
    head = next(line for line in said.splitlines() if line.split()[:2] == ["record", "verdict"])
    assert head.split() == ["record", "verdict", "backlash", "hysteresis"]
    row = next(line for line in said.splitlines() if line.split()[:2] == ["tight", "named"])
    assert row.split()[2] == "-"


@pytest.mark.parametrize(("arguments", "message"), [
    (["none.csv", "--drive", "drive_1"], "none.csv: expected a readable CSV file"),
    (["bad.csv", "--drive", "drive_1"], "bad.csv: expected a column 'output_torque'"),
    (["bad.csv", "--drive", "drive_9"], "unknown drive 'drive_9'"),
    (["bad.csv"], "one of the arguments --drive --curve --power-law is required"),
    (["bad.csv", "--power-law", "--columns", "none.toml"], "none.toml: expected a column map"),
    (["bad.csv", "bad.csv.gz", "--power-law"], "expected records with different names"),
])
def test_wrong_input_is_one_line_and_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
                                                    capsys: pytest.CaptureFixture[str], arguments: list[str],
                                                    message: str) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "bad.csv").write_text("time [s],twist [rad]\n0,0\n1,1\n")
    with pytest.raises(SystemExit) if "required" in message else contextlib.nullcontext():
        assert main(["diagnose", *arguments, "--out", "out"]) == 2
    error = capsys.readouterr().err.splitlines()
    assert len(error) == 1
    assert message in error[0]
    assert not (tmp_path / "out").exists()


def test_a_curve_file_serves_where_there_is_no_drawing(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The ratio then comes from the turning of crank and output."""
    assert main(["curve", "drive_1", "--drives", "200", "--out", str(tmp_path / "curve")]) == 0
    record = write(rig.measured({"hysteresis": {"torque": 6.0}}, seed=8), tmp_path / "record.csv")
    curve = tmp_path / "curve" / "curve.csv"
    assert main(["diagnose", str(record), "--curve", str(curve), "--out", str(tmp_path / "out")]) == 0
    found = json.loads((tmp_path / "out" / "diagnosis.json").read_text())
    assert found["verdict"] in ("named", "partly")
    assert "hysteresis" in [e["name"] for e in found["effects"]]
    size = next(e for e in found["effects"] if e["name"] == "hysteresis")["parameters"]["torque"]["value"]
    assert size == pytest.approx(6.0, rel=0.1)
    capsys.readouterr()


def test_angles_without_a_ratio_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    rng = np.random.default_rng(0)
    table = np.stack([np.arange(400.0), rng.uniform(0, 6, 400), rng.uniform(0, 0.1, 400), rng.normal(size=400)], axis=1)
    np.savetxt(tmp_path / "record.csv", table, delimiter=",", comments="",
               header="time [s],crank_angle [rad],output_angle [rad],output_torque [N.m]")
    assert main(["diagnose", str(tmp_path / "record.csv"), "--power-law", "--out", str(tmp_path / "out")]) == 2
    assert "show no transmission ratio" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
