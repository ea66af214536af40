"""The reported gap is that of the model that is written, in Python and as an FMU."""

from __future__ import annotations

import importlib.util
import shutil
from pathlib import Path

import numpy as np
import pytest

from reefmu.cli import main
from reefmu.diagnosis.analysis import Analysis
from reefmu.diagnosis.pipeline import analyse
from reefmu.diagnosis.preparation import BaseCurveSource
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.report.corrected_model import corrected_model, denoised_record, simulated_torque
from reefmu.diagnosis.report.files import write_results
from reefmu.fmu.importer.replay import replay_record
from reefmu.model.drive_model import build_model
from reefmu.model.model_file import load_model
from reefmu.record import make_record
from stiffness_model.lookup.build_lookup import Lookup
from tests import diagnosis_rig as rig
from tests.diagnosis_rig import Array
from tests.validation.blind.records import Case, make
from tests.validation.blind.sensors import Sensors

pytestmark = pytest.mark.slow

COMPILED = pytest.mark.skipif(not any(map(shutil.which, ("cc", "gcc", "clang"))), reason="no C compiler on the PATH")


def rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


@pytest.fixture(scope="module")
def found() -> Analysis:
    effects = {"hysteresis": {"torque": 4.0}, "backlash": {"clearance": 3e-6}}
    found = analyse(rig.measured(effects, seed=5), BaseCurveSource(rig.drive()))
    assert isinstance(found, Analysis)
    return found


@pytest.fixture(scope="module")
def free() -> Analysis:
    """An analysis without a drawing, against a power law."""
    found = analyse(rig.measured({"hysteresis": {"torque": 4.0}}, noise=1.0, seed=5))
    assert isinstance(found, Analysis)
    return found


@pytest.mark.parametrize("which", ["found", "free"])
def test_the_model_file_has_the_reported_gap(which: str, tmp_path: Path, request: pytest.FixtureRequest) -> None:
    found = request.getfixturevalue(which)
    write_results(found, tmp_path / "out")
    model, trace = load_model(tmp_path / "out" / "model.toml"), found.evidence.problem.trace
    torque = simulated_torque(model, trace, found.diagnosis.base["zero [rad]"])
    assert rms(trace.torque - torque) == pytest.approx(found.diagnosis.gap.after, rel=1e-9)


@pytest.mark.parametrize("which", ["found", "free"])
def test_the_predictor_agrees_with_the_simulated_model(which: str, request: pytest.FixtureRequest) -> None:
    """Two implementations of the same equations: their torques differ by far less than the gap."""
    found = request.getfixturevalue(which)
    chosen, problem = found.conclusion.chosen, found.evidence.problem
    predictor = problem.predictor(chosen.names)
    predictor.blocks = None
    slow = simulated_torque(corrected_model(problem, chosen), problem.trace, float(chosen.parameters[0]))
    assert rms(predictor(chosen.parameters).torque - slow) < 0.1 * found.diagnosis.gap.after


@pytest.mark.parametrize(
    ("which", "backend"),
    [
        ("found", "python"),
        pytest.param("found", "native", marks=COMPILED),
        pytest.param("free", "native", marks=COMPILED),
    ],
)
def test_the_fmu_has_the_reported_gap(
    which: str, backend: str, tmp_path: Path, request: pytest.FixtureRequest, capsys: pytest.CaptureFixture[str]
) -> None:
    found = request.getfixturevalue(which)
    write_results(found, tmp_path / "out")
    fmu = tmp_path / "found.fmu"
    assert main(["export", str(tmp_path / "out" / "model.toml"), "-o", str(fmu), "--backend", backend]) == 0
    capsys.readouterr()
    record, jitter = denoised_record(found.evidence.problem.trace, found.diagnosis.base["zero [rad]"])
    outputs = replay_record(fmu, record)
    torque = outputs["measured.tau"] + outputs["stiffness"] * jitter
    assert rms(record.output_torque - torque) == pytest.approx(found.diagnosis.gap.after, rel=1e-6)


def test_encoder_noise_does_not_act_on_damping(lookup: Lookup) -> None:
    """Divided by a sampling step of 1 ms, the noise of the angles is a high rate, which must not reach the damping."""
    drive, coefficient, noise = rig.drive(), 5e3, 1e-6
    time = 1e-3 * np.arange(3000)
    output, twist = 1.4 * time, 1e-3 + 2e-4 * np.sin(time)
    seen = output + noise * np.random.default_rng(1).standard_normal(len(time))
    measured = make_record(
        {
            "time": time,
            "crank_angle": drive.ratio * (output + twist),
            "output_angle": seen,
            "output_torque": np.zeros(len(time)),
        }
    )
    damped, bare = (
        simulated_torque(build_model(drive, effects, lookup=lookup), make_trace(measured, drive.ratio), 0.0)
        for effects in ({"damping": {"coefficient": coefficient}}, {})
    )
    assert rms(damped - bare - coefficient * 2e-4 * np.cos(time)) < 0.1 * coefficient * noise / 1e-3


def test_the_example_on_a_blind_record(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A record made by other equations is diagnosed, exported and replayed, all through files."""
    example = Path(__file__).parents[3] / "examples" / "diagnosis_round_trip.py"
    spec = importlib.util.spec_from_file_location("diagnosis_round_trip", example)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sealed = make(
        Case(31, "pair", (("hysteresis", 8.0), ("backlash", 12.0)), protocol="one_speed", sensors=Sensors(0.003, 0.5))
    )
    record, _ = sealed.write(tmp_path)  # its drawing is drive_1 by another name
    gaps = module.main([str(tmp_path / "out"), "--record", str(record), "--drive", "drive_1"])
    capsys.readouterr()
    after = gaps["diagnosis.json, after"]
    assert after < 0.3 * gaps["diagnosis.json, before"]
    assert [gap for name, gap in gaps.items() if "model.toml" in name or "FMU" in name] == pytest.approx(
        [after] * (3 if any(map(shutil.which, ("cc", "gcc", "clang"))) else 2), rel=1e-5
    )
    assert gaps["model as drawn, reefmu.simulate"] > 3 * after
