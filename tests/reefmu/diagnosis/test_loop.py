"""The loop is closed: the gap that is reported is that of the model that is handed out, in Python and as an FMU."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from reefmu.cli import main
from reefmu.diagnosis.corrected import simulated_torque
from reefmu.diagnosis.workflow import Examined, examine
from reefmu.diagnosis.write import write_results
from reefmu.model_file import load_model
from reefmu.record import Record
from reefmu.simulate import record_inputs
from tests import diagnosis_rig as rig
from tests.diagnosis_rig import Array


COMPILED = pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler on the PATH")


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.fixture(scope="module")
def found() -> Examined:
    effects = {"hysteresis": {"torque": 4.0}, "backlash": {"clearance": 3e-6}}
    found = examine(rig.measured(effects, seed=5), rig.drive())
    assert isinstance(found, Examined)
    return found


@pytest.fixture(scope="module")
def free() -> Examined:
    """The same without a drawing."""
    found = examine(rig.measured({"hysteresis": {"torque": 4.0}}, noise=1.0, seed=5))
    assert isinstance(found, Examined)
    return found


@pytest.mark.parametrize("which", ["found", "free"])
def test_the_model_file_leaves_the_gap_that_is_reported(which: str, tmp_path: Path, request: pytest.FixtureRequest
                                                        ) -> None:
    found = request.getfixturevalue(which)
    write_results(found, tmp_path / "out")
    model, trace = load_model(tmp_path / "out" / "model.toml"), found.study.trace
    torque = simulated_torque(model, trace, found.diagnosis.base["zero [rad]"])
    assert rms(trace.torque - torque) == pytest.approx(found.diagnosis.gap.after, rel=1e-9)


@pytest.mark.parametrize("which", ["found", "free"])
def test_the_fast_engine_fits_what_the_model_simulates(which: str, request: pytest.FixtureRequest) -> None:
    """Two implementations of the same equations: their torques differ by far less than the gap they leave."""
    from reefmu.diagnosis.corrected import corrected_model

    found = request.getfixturevalue(which)
    chosen, study = found.finding.chosen, found.study
    predictor = study.predictor(chosen.names)
    predictor.blocks = None
    slow = simulated_torque(corrected_model(study, chosen), study.trace, float(chosen.parameters[0]))
    assert rms(predictor(chosen.parameters).torque - slow) < 0.1 * found.diagnosis.gap.after


@pytest.mark.parametrize(("which", "backend"), [
    ("found", "python"), pytest.param("found", "native", marks=COMPILED),
    pytest.param("free", "native", marks=COMPILED)])
def test_the_record_through_the_fmu(which: str, backend: str, tmp_path: Path, request: pytest.FixtureRequest,
                                    capsys: pytest.CaptureFixture[str]) -> None:
    from reefmu.fmu.host import FmuDrive

    found = request.getfixturevalue(which)
    write_results(found, tmp_path / "out")
    fmu = tmp_path / "found.fmu"
    assert main(["export", str(tmp_path / "out" / "model.toml"), "-o", str(fmu), "--backend", backend]) == 0
    capsys.readouterr()
    # One run: the FMU starts anew with each, as the record's runs do.
    record = found.record
    inside = slice(int(record.starts[1]), int(record.starts[2]))
    part = Record(*(getattr(record, name)[inside] for name in (
        "time", "run", "crank_angle", "output_angle", "output_torque", "temperature")))
    zero = found.diagnosis.base["zero [rad]"]
    inputs = record_inputs(replace(part, output_angle=part.output_angle + zero))
    names = ("crank.phi", "crank.w", "output.phi", "output.w", "temperature")
    torque = []
    with FmuDrive(fmu) as drive:
        torque.append(drive.initialize(dict(zip(names, inputs[0].tolist(), strict=True)))["measured.tau"])
        for row, step in zip(inputs[1:], np.diff(part.time), strict=True):
            torque.append(drive.step(float(step), dict(zip(names, row.tolist(), strict=True)))["measured.tau"])
    assert rms(part.output_torque - np.array(torque)) < 1.2 * found.diagnosis.gap.after
