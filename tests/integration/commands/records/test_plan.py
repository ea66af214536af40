"""`reefmu plan` as a user calls it: files, text, and one line for a wrong call."""

from __future__ import annotations

import json
import re
import shlex
from pathlib import Path

import pytest

from reefmu.cli import main
from stiffness_model.lookup.table import Lookup
from tests.subprocesses import messages

TUTORIAL = Path(__file__).parents[4] / "docs/tutorials/diagnosing_a_record.md"
RIG = """
minutes = 6
[motion]
crank = "locked"
[temperature]
measured = false
"""


@pytest.mark.slow
def test_a_plan_is_written_and_says_what_is_missing(
    lookup: Lookup, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "rig.toml").write_text(RIG, "utf-8")
    words = ["plan", "drive_1", "--rig", str(tmp_path / "rig.toml"), "--effects", "creep,hysteresis"]
    assert main([*words, "--minutes", "4", "--out", str(tmp_path / "out")]) == 0
    assert sorted(file.name for file in (tmp_path / "out").iterdir()) == ["plan.html", "plan.json", "protocol.csv"]
    said = capsys.readouterr()
    assert "effects of typical size" in said.out
    assert "hysteresis cannot be reliably distinguished from coulomb_friction; a crank that turns under load could" in (
        said.out
    )
    assert "Less probable: hysteresis (" in said.out
    assert "No further run on this rig would bring the others to 90 %." in said.out
    assert "missing_ball is no candidate: the record has no crank angle" in said.out
    assert all("do not fit" in message for message in messages(said.err))


@pytest.mark.slow
def test_the_plan_of_the_tutorial_names_what_the_tutorial_promises(
    lookup: Lookup, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Effects and probability of the page, within the minutes of its command."""
    page = TUTORIAL.read_text("utf-8")
    words = shlex.split(next(line for line in page.splitlines() if line.startswith("reefmu plan")))[1:]
    promised = re.search(r"names? all (\w+) effects with a\s+probability of (\d+) %", page)
    assert promised is not None
    assert main([*words[:-1], str(tmp_path / "plan")]) == 0
    result = json.loads((tmp_path / "plan/plan.json").read_text("utf-8"))
    wanted, minutes = words[words.index("--effects") + 1].split(","), float(words[words.index("--minutes") + 1])
    assert promised[1] == {3: "three"}[len(wanted)]
    named = {limit["effect"]: limit["named_at_typical"] for limit in result["limits"]}
    assert sorted(named) == sorted(wanted)
    assert min(named.values()) >= float(promised[2]) / 100
    assert result["ended"] == "reached"
    assert "less than three minutes" in page
    assert result["seconds"] < 180
    assert minutes >= 1
    assert "name 3 of 3 effects of typical size" in capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("effect", ["missing_ball", "backlash"])
def test_a_longer_protocol_is_advised_where_time_is_short_and_names_what_the_short_one_does_not(
    effect: str, lookup: Lookup, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    words = ["plan", "drive_1", "--effects", effect, "--out", str(tmp_path / "plan"), "--minutes"]
    assert main([*words, "0.1"]) == 0
    short = capsys.readouterr().out
    assert re.search(r"in \d s names? 0 of 1 effect ", short)
    assert "No further run that would help fits into the 6 s allowed." in short
    assert f"{effect} cannot be reliably distinguished from no effect; a longer protocol on the same rig could" in short
    assert main([*words, "5"]) == 0
    assert "name 1 of 1 effect of typical size with a probability of 90 % or more. No further run is needed." in (
        capsys.readouterr().out
    )


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
