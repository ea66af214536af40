"""`reefmu record`: what it prints, the call of `diagnose` that it suggests, and its errors."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import numpy as np
import pytest

from reefmu.cli import build_parser, main
from reefmu.record import read_column_map, read_record
from stiffness_model.units import ARCMIN
from tests.integration.commands.program import run_program
from tests.torque_ramps import Gear, measured

ROOT = Path(__file__).parents[4]
RECORDS = ROOT.parent / "shared/data/cycloidal"
MAP = ROOT / "examples/cycloidal_columns.toml"


def write(folder: Path) -> Path:
    """Three cycles of a rig that drives the torque, in its own columns."""
    time = np.linspace(0, 30, 3000)
    torque = 20 * np.sin(2 * np.pi * (time / 10 + 0.02 * np.sin(time)))
    path = folder / "my rig.csv"
    lines = ["ZEIT;Position;Drehmoment", "s;°;Nm"]
    lines += [f"{t:.3f};{y / 1000:.6f};{y:.3f}".replace(".", ",") for t, y in zip(time, torque, strict=True)]
    path.write_text("\n".join(lines), "utf-8")
    return path


OPTIONS = ["--column", "ZEIT=time", "--column", "Position=twist", "--column", "Drehmoment=output_torque"]


def test_it_prints_what_was_understood(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path)
    assert main(["record", str(path), *OPTIONS, "--locked", "output"]) == 0
    said = capsys.readouterr()
    assert said.err == ""
    assert "3000 samples, 1 run, 30 s" in said.out
    assert "UTF-8, columns separated by semicolon, decimal comma, a row of units" in said.out
    assert "Position -> twist [rad], [°] by the units row (x 0.01745329)" in said.out
    assert "twist -1.2 ... 1.2 arcmin" in said.out
    assert "output_torque -20 ... 20 N.m" in said.out
    assert "the output is taken as locked while the crank turns" in said.out


def test_the_suggested_call_is_one_of_the_program(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path)
    assert main(["record", str(path), *OPTIONS, "--locked", "output", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    words = shlex.split(found["next"])
    assert words[:2] == ["reefmu", "diagnose"]
    args = build_parser().parse_args(words[1:])
    assert args.records == [str(path)]
    assert args.power_law
    assert args.locked == "output"
    record = read_record(args.records[0], read_column_map(args.columns, dict(args.column)))
    assert len(record) == found["samples"] == 3000
    assert found["ratio"] is None, "a locked shaft shows no ratio"
    assert found["ranges"]["twist"] == pytest.approx([-1.2 * ARCMIN, 1.2 * ARCMIN], rel=1e-3)
    assert found["torque_side"] == "output"
    assert set(found["candidates"]["power law"]) < set(found["candidates"]["drawing"])


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (
            ["my rig.csv"],
            "unknown column 'ZEIT'; did you mean 'time'? map the columns to use with --column 'ZEIT=time [s]'",
        ),
        (["none.csv"], "none.csv: expected a readable CSV file"),
        (["my rig.csv", "--columns", "none.toml"], "none.toml: expected a column map"),
        (["my rig.csv", "--column", "Zeit=time"], "which the file does not have; did you mean"),
        (["my rig.csv", *OPTIONS, "--drive", "drive_9"], "unknown drive 'drive_9'"),
    ],
)
def test_wrong_input_gives_one_line(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    write(tmp_path)
    assert main(["record", *arguments]) == 2
    said = capsys.readouterr()
    assert said.out == ""
    assert len(said.err.splitlines()) == 1
    assert message in said.err


def test_the_drawing_gives_the_ratio(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    time = np.linspace(0, 10, 500)
    twist = 1e-3 * np.sin(time)
    table = np.stack([time, 50 * twist, 50 * twist / -29 - twist, 9e3 * twist], axis=1)
    path = tmp_path / "record.csv"
    head = "time [s],crank_angle [rad],output_angle [rad],output_torque [N.m]"
    np.savetxt(path, table, fmt="%.12g", delimiter=",", header=head, comments="")
    assert main(["record", str(path), "--drive", "drive_1", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["ratio"] == -29
    assert found["ranges"]["twist"] == pytest.approx([-1e-3, 1e-3], rel=1e-3)
    assert "--drive drive_1" in found["next"]


def test_the_drive_turns_a_torque_of_the_motor_into_one_at_the_output(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In every command that reads records: the column map states no ratio."""
    monkeypatch.chdir(tmp_path)
    for seed, name in enumerate(("cold", "warm")):
        found = measured(Gear(noise=0.0), seed, large=2, n=500)
        table = np.stack([found.time, found.run, found.twist(1.0), found.output_torque / 50], axis=1)
        head = "time [s],run,twist [rad],motor_torque [N.m]"
        np.savetxt(f"{name}.csv", table, fmt="%.12g", delimiter=",", header=head, comments="")
    assert main(["record", "cold.csv"]) == 2
    assert "ratio = -29, or name the drive with --drive" in capsys.readouterr().err
    drive = ["--drive", "CHA-40A-50"]
    assert main(["record", "cold.csv", *drive]) == 0
    said = capsys.readouterr().out
    assert "motor_torque x ratio 50" in said
    for out, words in {"by_drive": drive, "by_map": ["--column", "ratio=50"]}.items():
        assert main(["diagnose", "--compare", "cold.csv", "warm.csv", *words, "--out", out]) == 0
    by_drive, by_map = (json.loads(Path(out, "compare.json").read_text("utf-8")) for out in ("by_drive", "by_map"))
    assert by_drive["common_load"] == by_map["common_load"]
    short = Path("cold.csv").read_text("utf-8").splitlines(keepends=True)[:40]
    Path("short.csv").write_text("".join(short), "utf-8")
    assert main(["diagnose", "short.csv", *drive, "--out", "found"]) == 0
    assert "only 39 samples" in capsys.readouterr().out


@pytest.mark.slow
def test_measured_records_of_others_are_read_with_a_small_map(tmp_path: Path) -> None:
    """All 39 records of three prototypes: five small and three large cycles each, which repeat in torque only."""
    paths = sorted(RECORDS.glob("*/*.csv.gz"))
    if not paths:
        pytest.skip(f"measured records, which are not part of this repository: none in {RECORDS}")
    assert len(paths) == 39
    columns = read_column_map(MAP)
    for path in paths:
        record = read_record(path, columns)
        assert record.torque_side == "motor"
        assert list(record.run[record.starts]) == [0, 1, 2, 3, 4, 100, 101, 102]
    done = run_program("record", str(paths[0]), "--columns", str(MAP), "--locked", "output", "--json", folder=tmp_path)
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["quantisation"]["twist"] == pytest.approx(2 * np.pi / 2**16, rel=1e-3)  # an encoder of 16 bits
    assert found["sampling"]["coarse_clock"]
    assert 400 < found["sampling"]["rate"] < 460
    assert found["repeats"]["pairs_in_time"] == 0
    assert 0.5 < found["repeats"]["torque_spread"] < 1.5
    assert found["ignored"] == ["CONTROL_TORQUE", "Q_CURRENT", "FAULT"]
