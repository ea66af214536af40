"""Friction at the crank from a record with both torques, in the FMU of the corrected model: the stated efficiencies."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from reefmu.cli import main
from reefmu.diagnosis import diagnose_record
from reefmu.fmu.codegen.compile import has_compiler
from reefmu.fmu.importer.replay import replay_record
from reefmu.model_file import load_model
from reefmu.record import Record, make_record
from reefmu.simulate import simulate_record
from tests.both_torques import both_torques
from tests.friction_record import GEAR

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not has_compiler(), reason="no C compiler on the PATH")]

SAMPLES = 60


def steady(twist: float, speed: float) -> Record:
    """A twist, rad, that stays, while the crank turns by half a radian at a speed, rad/s."""
    time = np.linspace(0, 0.5 / abs(speed), SAMPLES)
    crank = speed * time
    columns = {
        "time": time,
        "crank_angle": crank,
        "output_angle": crank / GEAR.ratio - twist,
        "output_torque": 0 * time,
    }
    return make_record(columns, "steady motion")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("both")
    assert diagnose_record(both_torques(seed=1), GEAR, out=folder).losses is not None
    assert main(["export", str(folder / "model.toml"), "-o", str(folder / "model.fmu"), "--backend", "native"]) == 0
    return folder


@pytest.mark.parametrize(("direction", "sense"), [("driving", 1), ("driven_back", -1)])
def test_the_fmu_has_the_efficiency_of_the_diagnosis_and_of_the_model(folder: Path, direction: str, sense: int) -> None:
    model = load_model(folder / "model.toml")
    stated = json.loads((folder / "diagnosis.json").read_text("utf-8"))["crank_friction"]["efficiency"]
    assert len(stated) == 2
    for at in stated:
        twists = np.linspace(0, model.lookup.twist.stop, 2000)
        twist = float(np.interp(at["load [N.m]"], model.lookup.torque(twists), twists))
        motion = steady(twist, sense * at["crank_speed [rad/s]"])
        found = []
        fmu = replay_record(folder / "model.fmu", motion, ("output.tau", "crank.tau"))
        for outputs in (fmu, simulate_record(model, motion)):
            at_output, at_crank = outputs["output.tau"][-1] / GEAR.ratio, -outputs["crank.tau"][-1]
            found.append(at_output / at_crank if sense > 0 else at_crank / at_output)
        assert found[0] == pytest.approx(found[1], rel=1e-9), "FMU and model"
        assert found[0] == pytest.approx(at[direction]["value"], abs=1e-4), "FMU and diagnosis"
        assert found[0] < 0.9
