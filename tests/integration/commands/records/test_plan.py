"""`reefmu plan` as a user calls it: files, text, and one line for a wrong call."""

from __future__ import annotations

from pathlib import Path

import pytest

from reefmu.cli import main
from stiffness_model.lookup.table import Lookup
from tests.subprocesses import messages

RIG = """
minutes = 6
[motion]
crank = "locked"
[temperature]
measured = false
"""


def test_a_plan_is_written_and_says_what_is_missing(
    lookup: Lookup, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rig.toml").write_text(RIG, "utf-8")
    words = ["plan", "drive_1", "--rig", str(tmp_path / "rig.toml"), "--effects", "creep,hysteresis"]
    assert main([*words, "--minutes", "4", "--out", str(tmp_path / "out")]) == 0
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == ["plan.html", "plan.json", "protocol.csv"]
    said = capsys.readouterr()
    assert "effects of typical size" in said.out
    assert "hysteresis is not told from coulomb_friction; a crank that turns under load would" in said.out
    assert "missing_ball is no candidate: the record has no crank angle" in said.out
    assert all("do not fit" in message for message in messages(said.err))


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--effects", "crep"], "--effects: unknown effect 'crep'; did you mean 'creep'?"),
        (["--minutes", "0"], "--minutes: expected a number of minutes from 0.02"),
        (["--minutes", "nan"], "--minutes: expected a number of minutes"),
        (["--rig", "none.toml"], "none.toml: expected a readable TOML rig"),
        (["--rig", "wrong.toml"], "wrong.toml [motion]: unknown key 'tork'"),
        (
            ["--rig", "cold.toml", "--effects", "thermal_clearance"],
            "got thermal_clearance: the record has no temperature that changes",
        ),
    ],
)
def test_a_wrong_call_is_one_line_and_writes_nothing(
    words: list[str],
    message: str,
    lookup: Lookup,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "wrong.toml").write_text('[motion]\ntork = "1 N.m"\n', "utf-8")
    (tmp_path / "cold.toml").write_text(RIG, "utf-8")
    assert main(["plan", "drive_1", *words, "--out", "out"]) == 2
    lines = messages(capsys.readouterr().err)
    assert len(lines) == 1
    assert message in lines[0]
    assert not (tmp_path / "out").exists()
