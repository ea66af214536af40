"""What a report states of its origin, and the commands that it proposes."""

from __future__ import annotations

import hashlib
import shlex
from dataclasses import replace
from pathlib import Path

import pytest

from reefmu.cli.parser import build_parser
from reefmu.diagnosis import Diagnosis, Gap, Hypothesis, NamedEffect, Value
from reefmu.diagnosis.report.html.next_commands import next_commands
from reefmu.diagnosis.report.html.origin import Origin, command_text, origin_rows
from reefmu.diagnosis.report.html.page import report_html
from reefmu.diagnosis.schema import VERDICTS

EFFECT = NamedEffect("backlash", {"clearance": Value(3e-6, 2e-6, 4e-6, "m")}, 0.6)
FURTHER = NamedEffect("hysteresis", {"torque": Value(3.0, 2.0, 4.0, "N.m")}, 0.3)


def diagnosis(verdict: str) -> Diagnosis:
    effects = (EFFECT, FURTHER) if verdict in ("named", "partly", "ambiguous") else ()
    others = (("preload",),) if verdict == "ambiguous" else ()
    rivals = (Hypothesis(("backlash", "hysteresis"), False, 0.9), Hypothesis(("wear",), False, 0.1))
    return Diagnosis(
        verdict,
        "A sentence.",
        effects,
        others,
        (),
        Gap(2.0, 1.0, 0.9),
        (),
        hypotheses=rivals,
        not_candidates={},
        shown_alternatives=others,
    )


@pytest.fixture
def _dated(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")


@pytest.mark.usefixtures("_dated")
def test_origin_names_date_version_command_record_and_drawing_with_their_hashes(tmp_path: Path) -> None:
    record, drawing = tmp_path / "a.csv", tmp_path / "mine.toml"
    for path in (record, drawing):
        path.write_text(path.name)
    origin = Origin(f"reefmu diagnose {record} --drive {drawing} --out x", str(drawing))
    rows = dict(origin_rows(origin, [str(record)]))
    assert rows["date"] == "2023-11-14 22:13 UTC"
    assert rows["version"].startswith("reefmu ")
    assert rows["command"] == "reefmu diagnose a.csv --drive mine.toml --out x"
    for name, path in (("record", record), ("drawing", drawing)):
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
        assert rows[name].startswith(path.name)
        assert digest.startswith(rows[name].rpartition(" ")[2])
    assert str(tmp_path) not in report_html(diagnosis("named"), origin, str(record))


@pytest.mark.usefixtures("_dated")
def test_what_is_not_a_file_has_no_hash() -> None:
    rows = dict(origin_rows(Origin("", "drive_1"), ["joined from an array"]))
    assert rows["record"] == "joined from an array"
    assert rows["drawing"] == "preset drive_1 of this version"
    assert "command" not in rows


def test_commands_show_no_folder() -> None:
    command = shlex.join(["reefmu", "diagnose", "a=/x/1.csv,/y/2.csv", "C:\\z\\b c.csv", "--columns=/h/m.toml"])
    assert command_text(command) == "reefmu diagnose a=1.csv,2.csv 'b c.csv' --columns=m.toml"


@pytest.mark.parametrize("verdict", VERDICTS)
@pytest.mark.parametrize("base", ["drive_1", "curve.csv", ""])
def test_every_proposed_command_is_one_of_the_command_line(verdict: str, base: str) -> None:
    reading = ("--columns", "map.toml", "--column", "TIME=time [s]", "--locked", "output")
    steps = next_commands(diagnosis(verdict), Origin("", base, reading, ("--priors", "p.toml")), "a record.csv")
    assert steps
    for step in steps:
        program, *words = shlex.split(step.command)
        assert program == "reefmu"
        args = build_parser().parse_args(words)
        if words[0] in ("record", "diagnose"):
            # What the rig is like holds for its next record, and so does what is known of the drive.
            assert (args.columns, args.column, args.locked) == ("map.toml", [("TIME", "time [s]")], "output")
            assert words[0] == "record" or args.priors == "p.toml"


def test_a_model_without_a_ratio_is_exported_with_one() -> None:
    commands = [step.command for step in next_commands(diagnosis("named"), Origin(), ratio_known=False)]
    assert commands[0] == "reefmu export model.toml -o model.fmu --set ratio=RATIO"


def test_the_corrected_model_is_exported_and_rivals_are_separated() -> None:
    commands = [step.command for step in next_commands(diagnosis("ambiguous"), Origin("", "drive_1"))]
    assert commands[0] == "reefmu export model.toml -o model.fmu"
    assert "reefmu plan drive_1 --effects backlash,hysteresis,preload,wear --out plan" in commands
    assert commands[-1] == "reefmu diagnose NEXT.csv --drive drive_1 --out next"


@pytest.mark.parametrize("verdict", ["none", "unknown"])
def test_a_plan_is_proposed_for_effects_that_some_record_shows(verdict: str) -> None:
    """What no record shows is left out, and what the plan takes for granted of the rig is said beside it."""
    excluded = dict.fromkeys(("crank_friction", "missing_ball", "elastoplastic_friction", "wear"), "a reason")
    made = replace(diagnosis(verdict), hypotheses=(), not_candidates=excluded)
    (plan,) = [step for step in next_commands(made, Origin("", "drive_1")) if step.command.startswith("reefmu plan")]
    assert plan.command == "reefmu plan drive_1 --effects missing_ball,wear --out plan"
    assert "assumes a rig that turns the crank" in plan.purpose
    assert "--rig RIG.toml" in plan.purpose
    none = replace(made, not_candidates={"crank_friction": "a reason"})
    assert not [s for s in next_commands(none, Origin("", "drive_1")) if s.command.startswith("reefmu plan")]


def test_shares_are_explained_where_they_stand() -> None:
    page = report_html(diagnosis("named"))
    assert "removes 60 % of the systematic gap" in page
    assert "together remove 90 % of it" in page
