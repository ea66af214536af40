"""A drive, and a joint with its controller, as SSP files: in hosts, and against the Python model."""

from __future__ import annotations

import importlib
import math
import re
import zipfile
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from reefmu.cli import main
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import Component
from reefmu.fmu.model.joint_component import joint_component
from reefmu.fmu.model.presets import presets
from reefmu.fmu.ssp.controller_stub import choose_gains
from reefmu.fmu.ssp.export_ssp import export_ssp
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import TYPICAL_MASSES, Masses
from stiffness_model.errors import InputError
from stiffness_model.lookup.table import Lookup

STEPS = 200


@pytest.fixture(scope="module")
def joint(drive: object, lookup: Lookup, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, DriveModel, float]:
    """The system of a joint, its model, and the step to run it with."""
    model = build_model(drive, {"hysteresis": {"torque": 4.0}, "damping": {}}, lookup=lookup)  # type: ignore[arg-type]
    path = tmp_path_factory.mktemp("ssp") / "joint.ssp"
    return path, model, export_ssp(model, path, masses=TYPICAL_MASSES)


def controlled(component: Component, values: dict[str, float], step: float, torque: float | None = 0.0) -> list[float]:
    """Angle of the output after each of `STEPS`: the joint and the law of its controller, both stepped in parallel.

    torque: of the motor in the first step, which FMPy leaves at zero; None for the controller's first output.
    """
    ratio = component.parameters[0].value
    gains = choose_gains(TYPICAL_MASSES, ratio, step, component.full_torque)
    p = np.array([values.get(q.name, q.value) for q in component.parameters])
    x = component.initial(np.zeros(2), p)
    angle, speed, rows = 0.0, 0.0, []
    torque = min(max(gains.stiffness * ratio * 0.1, -gains.limit), gains.limit) if torque is None else torque
    for _ in range(STEPS):
        inputs = np.array([torque, 0.0])
        wanted = gains.stiffness * (ratio * 0.1 - angle) - gains.damping * speed
        torque = min(max(wanted, -gains.limit), gains.limit)
        x = component.step(x, inputs, step, p)
        y = np.asarray(component.output(x, inputs, p)).ravel()
        angle, speed = float(y[0]), float(y[1])
        rows.append(float(y[2]))
    return rows


@pytest.mark.slow
def test_fmpy_runs_the_joint_as_the_python_model_with_every_parameter_set(
    joint: tuple[Path, DriveModel, float],
) -> None:
    """FMPy validates description and parameter sets against the schemas of SSP 1.0."""
    from fmpy.ssp.simulation import simulate_ssp
    from fmpy.ssp.ssd import read_ssv

    path, model, step = joint
    component = joint_component(model, TYPICAL_MASSES)
    ends = {}
    for preset in presets(component):
        values = read_ssv(str(path), f"resources/{preset.name}.ssv")
        assert {p.name: float(p.value) for p in values.parameters} == {
            f"joint.{name}": value for name, value in preset.values.items()
        }
        result = simulate_ssp(str(path), stop_time=(STEPS - 0.5) * step, step_size=step, parameter_set=values)
        expected = controlled(component, dict(preset.values), step)
        np.testing.assert_allclose(result["joint.output.phi"], expected, rtol=0, atol=1e-12 * max(expected))
        ends[preset.name] = expected[-1]
    assert set(ends) >= {"mean", "p10", "p90", "hysteresis_small", "hysteresis_large", "damping_small"}
    assert len(set(ends.values())) == len(ends)
    assert ends["mean"] > 0


@pytest.mark.slow
def test_the_controller_brings_the_output_to_its_reference(joint: tuple[Path, DriveModel, float]) -> None:
    path, _, step = joint
    end = ecos_run(path, round(1.0 / step))
    assert end["joint::output.phi"] == pytest.approx(0.1, rel=0.02)
    assert abs(end["joint::output.w"]) < 0.05


@pytest.mark.slow
def test_ecospy_runs_the_joint_as_the_python_model(joint: tuple[Path, DriveModel, float]) -> None:
    path, model, step = joint
    expected = controlled(joint_component(model, TYPICAL_MASSES), {}, step, None)
    assert ecos_run(path, STEPS)["joint::output.phi"] == pytest.approx(expected[-1], rel=1e-9)


def ecos_run(path: Path, steps: int) -> dict[str, float]:
    ecospy = foreign_ecospy()
    with ecospy.EcosSimulation(ssp_path=str(path), step_size=_step(path)) as simulation:
        simulation.init()
        simulation.step(steps)
        return {name: simulation.get_real(name) for name in ("joint::output.phi", "joint::output.w")}


def _step(path: Path) -> float:
    """The step that the controller's FMU proposes."""
    with (
        zipfile.ZipFile(path) as system,
        system.open("resources/controller.fmu") as file,
        zipfile.ZipFile(file) as fmu,
    ):
        text = fmu.read("modelDescription.xml").decode()
    found = re.search(r'stepSize="([^"]+)"', text)
    assert found
    return float(found[1])


def foreign_ecospy() -> ModuleType:
    try:
        return importlib.import_module("ecospy")
    except (ImportError, OSError) as error:  # on Debian its library needs the package libtbb12
        pytest.skip(f"foreign host ecospy: {error}")


@pytest.mark.slow
def test_the_drive_alone_has_its_variables_as_connectors_of_the_system(
    drive: object, lookup: Lookup, tmp_path: Path
) -> None:
    from fmpy.ssp.simulation import simulate_ssp

    model = build_model(drive, lookup=lookup)  # type: ignore[arg-type]
    step = export_ssp(model, path := tmp_path / "drive.ssp")
    result = simulate_ssp(str(path), stop_time=2.5 * step, step_size=step, input={"output.phi": lambda t: -1e-3})
    outputs = model.output([], [0, 0, -1e-3, 0, 20.0], [p.value for p in model.parameters])
    assert result["output.tau"][-1] == pytest.approx(float(np.asarray(outputs).ravel()[0]), rel=1e-12)
    assert "temperature" not in (result.dtype.names or ())


def test_temperature_is_a_connector_where_an_effect_reads_it(drive: object, lookup: Lookup, tmp_path: Path) -> None:
    from fmpy.ssp.ssd import read_ssd

    model = build_model(drive, {"thermal_clearance": {}}, lookup=lookup)  # type: ignore[arg-type]
    export_ssp(model, path := tmp_path / "warm.ssp", platform="none", backend="native")
    assert "temperature" in [c.name for c in read_ssd(str(path)).system.connectors]


@pytest.mark.slow
def test_the_controller_is_a_valid_fmu(joint: tuple[Path, DriveModel, float], tmp_path: Path) -> None:
    """Its law with and without the bound, its directional derivatives, and a saved state."""
    from fmpy.validation import validate_fmu

    with zipfile.ZipFile(joint[0]) as archive:
        path = Path(archive.extract("resources/controller.fmu", tmp_path))
    assert validate_fmu(str(path)) == []
    start = {"reference": 0.5, "ratio": -2.0, "stiffness": 3.0, "damping": 0.5, "limit": 100.0}
    with FmuDrive(path) as controller:
        controller.set_parameters(start)
        controller.initialize({"crank.phi": 0.25, "crank.w": 4.0})
        outputs = controller.step(1e-3, {"crank.phi": 0.25, "crank.w": 4.0})
        assert outputs["motor.tau"] == 3.0 * (-1.0 - 0.25) - 0.5 * 4.0
        assert controller.derivative(["motor.tau"], {"crank.phi": 1.0}) == {"motor.tau": -3.0}
        assert controller.derivative(["motor.tau"], {"crank.w": 1.0}) == {"motor.tau": -0.5}
        saved = controller.save()
        assert controller.step(1e-3, {"crank.phi": 1e6})["motor.tau"] == -100.0
        assert controller.derivative(["motor.tau"], {"crank.phi": 1.0}) == {"motor.tau": 0.0}
        controller.restore(saved)
        assert controller.read(["motor.tau"]) == {"motor.tau": outputs["motor.tau"]}


def test_gains_are_critically_damped() -> None:
    gains = choose_gains(Masses(1e-4, 2.0), -20.0, 1e-4, 300.0)
    inertia = 1e-4 + 2.0 / 400
    assert gains.damping == pytest.approx(2 * math.sqrt(gains.stiffness * inertia))
    assert gains.limit == 15.0


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--ssp", "-o", "x.fmu"], "ends in .ssp"),
        (["-o", "x.ssp"], "ends in .fmu"),
        (["--ssp", "--fmi", "3", "-o", "x.ssp"], "SSP 1.0"),
    ],
)
def test_a_wrong_call_is_refused_in_one_line(
    words: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "drive_1", *words]) == 2
    assert message in capsys.readouterr().err


@pytest.mark.slow
def test_a_joint_without_a_compiler_is_refused(drive: object, lookup: Lookup, tmp_path: Path) -> None:
    model = build_model(drive, lookup=lookup)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="a C compiler for the controller"):
        export_ssp(model, tmp_path / "x.ssp", backend="python", masses=TYPICAL_MASSES)
