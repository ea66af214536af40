"""`reefmu diagnose --compare`: states from files, what it prints and writes, and its errors in one line."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from reefmu.cli import main
from reefmu.commands.records.compare_states import state_files
from reefmu.record import Record
from tests.torque_ramps import Gear, measured


def write(record: Record, path: Path) -> Path:
    columns = {
        "time [s]": record.time,
        "run": record.run,
        "twist [rad]": record.twist(1.0),
        "output_torque [N.m]": record.output_torque,
    }
    table = np.stack([np.asarray(v, float) for v in columns.values()], axis=1)
    np.savetxt(path, table, delimiter=",", header=",".join(columns), comments="", fmt="%.9g")
    return path


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Two states of two positions each."""
    monkeypatch.chdir(tmp_path)
    for name, gear in (("loose", Gear()), ("tight", Gear(play=0.004, friction=4.0))):
        for position in (1, 2):
            write(measured(gear, position, large=2, small=1, n=500), tmp_path / f"{name}_pos{position}.csv")
    return tmp_path


def test_two_states_at_two_positions(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["loose=loose_pos*.csv", "tight=tight_pos1.csv,tight_pos2.csv"]
    assert main(["diagnose", *words, "--compare", "--locked", "output", "--out", "out"]) == 0
    said = capsys.readouterr()
    assert "loose: 2 positions, 4 cycles" in said.out
    assert "loose -> tight" in said.out
    assert "4 cycles of up to 3 N.m left out" in said.out or "mostly stick" in said.out
    changes = {c["quantity"]: c for c in json.loads((folder / "out/compare.json").read_text())["changes"]}
    assert changes["play"]["difference"]["value"] == pytest.approx(-0.016, rel=0.1)
    assert changes["friction"]["difference"]["value"] == pytest.approx(2.0, rel=0.1)
    assert changes["play"]["probability_up"] < 0.025 < 0.975 < changes["friction"]["probability_up"]
    assert {"compare.json", "compare.html"} == {path.name for path in (folder / "out").iterdir()}


@pytest.mark.parametrize("base", [["--drive", "drive_1"], ["--power-law"], []], ids=str)
def test_each_record_is_a_state_by_its_name(folder: Path, capsys: pytest.CaptureFixture[str], base: list[str]) -> None:
    assert main(["diagnose", "--compare", "loose_pos1.csv", "tight_pos1.csv", *base, "--out", "out"]) == 0
    said = capsys.readouterr().out
    assert "loose_pos1 -> tight_pos1" in said
    assert "cannot count what positions of one state differ by" in said
    changes = json.loads((folder / "out/compare.json").read_text())["changes"]
    assert {(c["from"], c["to"]) for c in changes} == {("loose_pos1", "tight_pos1")}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["loose_pos1.csv"], "expected at least two states to compare, got 'loose_pos1'"),
        (["loose_pos1.csv", "loose_pos1.csv"], "expected states with different names, got 'loose_pos1' twice"),
        (["a=loose_pos1.csv", "b=loose_pos1.csv"], "expected every file once, got loose_pos1.csv twice"),
        (["a=loose_*.csv", "b=none_*.csv"], "none_*.csv: expected files that match the pattern, got 'none'"),
        (["a=", "b=loose_pos1.csv"], "expected NAME=FILE,FILE"),
        (["loose_pos1.csv", "none.csv"], "none.csv: expected a readable CSV file"),
        (["loose_pos1.csv", "no_unit.csv"], "no_unit.csv: "),
        (["loose_pos1.csv", "angle.csv"], "angle.csv: "),
        (["loose_pos1.csv", "tight_pos1.csv", "--exponent", "1.5"], "expected no --exponent with --compare"),
        (["loose_pos1.csv", "tight_pos1.csv", "--curve", "none.csv"], "none.csv"),
        (["loose_pos1.csv", "tight_pos1.csv", "--spread-from", "none.json"], "none.json: expected a compare.json"),
        (["a=loose_*.csv", "tight_pos1.csv", "--matched"], "expected matched positions: as many in every state"),
    ],
)
def test_wrong_input_gives_one_line_and_no_files(
    folder: Path, capsys: pytest.CaptureFixture[str], words: list[str], message: str
) -> None:
    good = (folder / "loose_pos1.csv").read_text()
    (folder / "no_unit.csv").write_text(good.replace("output_torque [N.m]", "output_torque [kg]"))
    (folder / "angle.csv").write_text(good.replace("twist [rad]", "twist [N.m]"))
    assert main(["diagnose", *words, "--compare", "--out", "out"]) == 2
    said = capsys.readouterr().err.strip().splitlines()
    assert len(said) == 1
    assert message in said[0]
    assert not (folder / "out").exists()


@pytest.mark.parametrize("option", [["--matched"], ["--spread-from", "compare.json"]], ids=str)
def test_options_of_a_comparison_need_compare(
    folder: Path, capsys: pytest.CaptureFixture[str], option: list[str]
) -> None:
    assert main(["diagnose", "loose_pos1.csv", "--power-law", *option, "--out", "out"]) == 2
    assert f"expected {option[0]} with --compare only" in capsys.readouterr().err


def test_a_file_with_an_equals_sign_in_its_name_is_a_file(folder: Path) -> None:
    (folder / "torque=5.csv").write_text("")
    files = state_files(["torque=5.csv", "tight_pos1.csv"])
    assert files == {"torque=5": [Path("torque=5.csv")], "tight_pos1": [Path("tight_pos1.csv")]}


def write_turning(record: Record, path: Path, ratio: float) -> None:
    """The record with angles that turn through 300 rad at the output."""
    output = np.linspace(0.0, 300.0, len(record.time))
    columns = {
        "time [s]": record.time,
        "run": record.run,
        "crank_angle [rad]": ratio * (output + record.twist(1.0)),
        "output_angle [rad]": output,
        "output_torque [N.m]": record.output_torque,
    }
    np.savetxt(path, np.stack([*columns.values()], axis=1), delimiter=",", header=",".join(columns), comments="")


def test_records_with_and_without_a_ratio_are_compared_but_not_of_two_ratios(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A locked crank shows no ratio; the twist does not depend on it."""
    record = measured(Gear(), 1, large=2, small=1, n=500)
    for ratio in (30.0, 40.0):
        write_turning(record, folder / f"turning_{ratio:g}.csv", ratio)
    assert main(["diagnose", "--compare", "turning_30.csv", "tight_pos1.csv", "--out", "out"]) == 0
    assert "turning_30 -> tight_pos1" in capsys.readouterr().out
    assert main(["diagnose", "--compare", "turning_30.csv", "turning_40.csv", "--out", "none"]) == 2
    assert "expected records of one ratio, got [30.0, 40.0]" in capsys.readouterr().err
