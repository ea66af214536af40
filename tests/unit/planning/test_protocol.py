"""The files of a plan: protocol.csv stays within the rig and can be simulated, plan.json and plan.html are complete."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from reefmu.model.drive_model import build_model
from reefmu.planning import Plan
from reefmu.planning.plan_report.plan_files import write_plan
from reefmu.planning.plan_report.plan_page import plan_html
from reefmu.planning.plan_report.protocol_table import COLUMNS
from reefmu.planning.plan_report.result import summary
from reefmu.planning.protocols.motion_pieces import motion_library
from reefmu.planning.protocols.rig import Rig
from reefmu.planning.protocols.schedule import make_schedule, motion_record
from reefmu.record import read_record
from reefmu.simulate import simulate_record
from stiffness_model.lookup.table import Lookup
from stiffness_model.units import ARCMIN

MAP = {
    "time [s]": "time [s]",
    "run": "run",
    "twist [arcmin]": "twist [arcmin]",
    "torque_set_point [N.m]": "output_torque [N.m]",
    "temperature [degC]": "temperature [degC]",
}


@pytest.fixture(scope="module")
def folder(plan: Plan, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("plan")
    write_plan(plan, out)
    return out


@pytest.mark.slow
def test_the_protocol_is_read_and_simulated_within_the_rig(folder: Path, plan: Plan, lookup: Lookup) -> None:
    assert (folder / "protocol.csv").read_text("utf-8").splitlines()[0] == ",".join(COLUMNS)
    record = read_record(folder / "protocol.csv", MAP)
    torque = simulate_record(build_model(plan.drive, lookup=lookup), record)["output.tau"]
    assert np.abs(torque - record.output_torque).max() < 1e-3 * lookup.full_torque
    assert plan.rig.torque is not None
    assert np.abs(torque).max() <= 1.001 * plan.rig.torque
    assert np.ptp(record.time) <= 60 * plan.rig.minutes
    step = np.concatenate([np.diff(record.time[record.run == run]) for run in np.unique(record.run)])
    assert step.min() >= 0.999 / plan.rig.sample_rate
    assert len(np.unique(record.run)) == len(plan.schedule)


def test_a_weak_rig_is_not_asked_for_more() -> None:
    """Torque, speed and sampling rate of every piece that a rig can perform stay within it."""
    rig = Rig(torque=100.0, speed=3.0, sample_rate=20.0, highest=20.0)
    library = motion_library(rig, 4 * ARCMIN, 8 * ARCMIN)
    possible = [piece for piece in library if not piece.needs]
    assert 0 < len(possible) < len(library)
    for piece in possible:
        assert np.abs(piece.twist).max() <= 4.001 * ARCMIN
        assert piece.step.min() >= 0.999 / rig.sample_rate
        # A smooth start and stop take a tenth of the time each, so that the mean speed is 0.9 of the greatest.
        assert np.abs(np.diff(piece.crank) / piece.step[1:]).max() <= 1.01 * rig.speed
        assert piece.temperature == 20.0


@pytest.mark.slow
def test_runs_follow_each_other(plan: Plan) -> None:
    """Time, crank and order: nothing overlaps, and what changes the drive comes late."""
    library = motion_library(Rig(), 8 * ARCMIN, 8 * ARCMIN)
    schedule = make_schedule(library, [*range(len(library)), 1, 1], Rig())
    ends = schedule.begin + [piece.seconds - piece.step[0] for piece in schedule.pieces]
    assert (schedule.begin[1:] > ends[:-1]).all()
    assert (np.diff(schedule.travelled) >= 0).all()
    assert schedule.pieces[-1].stage == "warm"
    assert schedule.chosen.index(1) < 5
    assert schedule.pieces[len(schedule) - 1 - schedule.chosen[::-1].index(1)].stage == "cold"
    assert len(schedule.chosen) - 1 - schedule.chosen[::-1].index(1) > 30
    record = motion_record(schedule, plan.drive.ratio)
    assert (np.diff(record.time) > 0).all()


@pytest.mark.slow
def test_the_result_holds_everything(folder: Path, plan: Plan) -> None:
    result = json.loads((folder / "plan.json").read_text("utf-8"))
    assert result["isolability"]["true"] == ["", *plan.isolability.true]
    assert result["isolability"]["named"][-1] == ""
    assert np.allclose(np.sum(result["isolability"]["matrix"], axis=1), 1.0, atol=1e-3)
    assert {limit["effect"] for limit in result["limits"]} == set(plan.interest)
    assert all(limit["detected_from"] > 0 for limit in result["limits"])
    assert result["cannot_tell"]
    assert len(result["runs"]) == len(plan.schedule)


@pytest.mark.slow
def test_the_page_says_what_could_show_an_excluded_effect(folder: Path, plan: Plan) -> None:
    """A missing column takes its sensor; an effect that no record of a diagnosis shows takes a test of its own."""
    text = (folder / "plan.html").read_text("utf-8")
    rows = dict(re.findall(r"<tr><td>(\w+)</td><td>is no candidate: [^<]*</td><td>([^<]*)</td></tr>", text))
    assert set(rows) == set(plan.excluded)
    assert rows["missing_ball"] == "an encoder at a crank whose angle can be set"
    assert rows["elastoplastic_friction"].startswith("no sensor; a test of it alone: loads held below and above")
    assert rows["crank_friction"].startswith("no sensor; a test of it alone: torques at crank and output")


@pytest.mark.slow
def test_a_duration_below_a_minute_is_in_seconds(plan: Plan) -> None:
    short = replace(plan, schedule=replace(plan.schedule, seconds=19.4))
    assert " in 19 s name" in summary(short)
    page = plan_html(short)
    assert "<p class=big>19 s</p>" in page
    assert "time [s]" in page
    assert "time [min]" in plan_html(replace(plan, schedule=replace(plan.schedule, seconds=90.0)))


@pytest.mark.slow
def test_the_page_needs_no_network(folder: Path, plan: Plan) -> None:
    text = (folder / "plan.html").read_text("utf-8")
    assert text.count("<svg ") == 3
    assert "src=" not in text
    assert "fetch(" not in text
    for name in plan.interest:
        assert name in text
