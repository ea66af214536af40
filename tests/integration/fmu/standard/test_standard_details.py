"""Requirements of the standard that hosts seldom exercise: stop time, logging off, single states set, a discrete
output, and the content of description and archive."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave, fmi2Error
from fmpy.fmi3 import FMU3Model, FMU3Slave

from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.ctypes_buffers import make_callbacks
from reefmu.model.drive_model import DriveModel
from reefmu.model.masses import Masses
from tests.integration.fmu.model_exchange import Exchange

pytestmark = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler on the PATH"
)
FMI = ["2.0", "3.0"]


@pytest.fixture(scope="module")
def exported(model: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """The unpacked FMUs by version of FMI."""
    folder = tmp_path_factory.mktemp("letter")
    made = {}
    for fmi in FMI:
        path = export_fmu(model, folder / f"{fmi[0]}.fmu", backend="native", fmi=fmi)
        made[fmi] = Path(fmpy.extract(str(path), str(folder / fmi[0])))
    return made


def described(folder: Path) -> ElementTree.Element:
    return ElementTree.fromstring((folder / "modelDescription.xml").read_text("utf-8"))


def slave(folder: Path, fmi: str, said: list[str], stop: float | None, log: bool = True) -> FMU2Slave | FMU3Slave:
    """An initialised slave whose experiment has the stop time `stop`, s."""
    description = fmpy.read_model_description(str(folder), validate=False)
    names = {
        "guid": description.guid,
        "unzipDirectory": str(folder),
        "instanceName": "x",
        "modelIdentifier": description.coSimulation.modelIdentifier,
    }
    if fmi == "2.0":
        fmu = FMU2Slave(**names)
        fmu.instantiate(callbacks=make_callbacks(said), loggingOn=log)
        fmu.setupExperiment(startTime=0.0, stopTime=stop)
        fmu.enterInitializationMode()
    else:
        fmu = FMU3Slave(**names)
        fmu.instantiate(loggingOn=log, logMessage=lambda _e, _s, _c, text: said.append(text.decode()))
        fmu.enterInitializationMode(startTime=0.0, stopTime=stop)
    fmu.exitInitializationMode()
    return fmu


@pytest.mark.parametrize("fmi", FMI)
def test_a_step_beyond_the_stop_time_is_refused(exported: dict[str, Path], fmi: str) -> None:
    """Except for the rounding of a host's sum of steps; without a stop time every step is allowed."""
    said: list[str] = []
    fmu = slave(exported[fmi], fmi, said, 0.01)
    for k in range(10):
        fmu.doStep(sum([1e-3] * k), 1e-3)
    with pytest.raises(FMICallException) as refused:
        fmu.doStep(0.01, 1e-3)
    assert refused.value.status == fmi2Error
    assert said[-1] == f"fmi{fmi[0]}DoStep: expected a time up to the stop time of 0.01 s, got 0.010999999999999999 s"
    fmu.terminate()
    fmu.freeInstance()
    fmu = slave(exported[fmi], fmi, said, None)
    fmu.doStep(1e6, 1.0)
    fmu.terminate()
    fmu.freeInstance()


def test_a_time_beyond_the_stop_time_is_refused_in_model_exchange(exported: dict[str, Path]) -> None:
    """An integrator may look a fiftieth of the run ahead, as CVode does in FMPy, but no step may end there."""
    with Exchange(exported["2.0"], {}, stop=0.5) as exchange:
        exchange.fmu.setTime(0.5)
        exchange.completed()
        exchange.fmu.setTime(0.51)
        for call in (exchange.completed, lambda: exchange.fmu.setTime(0.52)):
            with pytest.raises(FMICallException) as refused:
                call()
            assert refused.value.status == fmi2Error
    result = fmpy.simulate_fmu(
        str(exported["2.0"]),
        fmi_type="ModelExchange",
        stop_time=0.5,
        solver="CVode",
        relative_tolerance=1e-9,
        output=["output.tau"],
    )
    assert result["time"][-1] == pytest.approx(0.5)


@pytest.mark.parametrize("fmi", FMI)
def test_with_logging_off_fmi_3_sends_no_message(exported: dict[str, Path], fmi: str) -> None:
    """FMI 3.0.2, section 2.3.1. In FMI 2.0 the flag concerns debugging, and refused calls are still reported."""
    said: list[str] = []
    fmu = slave(exported[fmi], fmi, said, 0.01, log=False)
    with pytest.raises(FMICallException):
        fmu.doStep(0.01, 1e-3)
    assert bool(said) == (fmi == "2.0")


@pytest.mark.parametrize("fmi", FMI)
def test_one_state_is_set_by_its_reference(exported: dict[str, Path], fmi: str) -> None:
    """In model exchange, section 3.1 (FMI 3.0.2: 3.2.1); the outputs follow the new value."""
    if fmi == "2.0":
        with Exchange(exported[fmi], {}) as exchange:
            before = exchange.get(["output.tau"])[0]
            exchange.set({"hysteresis.deflection": 1.0})
            assert exchange.get(["output.tau"])[0] - before == pytest.approx(4.0, rel=0.1)  # the hysteresis' torque
            with pytest.raises(FMICallException):
                exchange.set({"der(hysteresis.deflection)": 1.0})
        return
    description = fmpy.read_model_description(str(exported[fmi]), validate=False)
    references = {v.name: v.valueReference for v in description.modelVariables}
    fmu = FMU3Model(
        guid=description.guid,
        unzipDirectory=str(exported[fmi]),
        instanceName="x",
        modelIdentifier=description.modelExchange.modelIdentifier,
    )
    fmu.instantiate()
    fmu.enterInitializationMode()
    with pytest.raises(FMICallException):
        fmu.setFloat64([references["hysteresis.deflection"]], [1.0])
    fmu.exitInitializationMode()
    fmu.updateDiscreteStates()
    fmu.enterContinuousTimeMode()
    fmu.setFloat64([references["hysteresis.deflection"]], [1.0])
    assert fmu.getFloat64([references["output.tau"]])[0] == pytest.approx(4.0, rel=0.1)
    fmu.terminate()
    fmu.freeInstance()


def test_in_range_changes_at_events_only(exported: dict[str, Path], model: DriveModel) -> None:
    far = {"output.phi": -10 * model.lookup.twist.stop}
    with Exchange(exported["2.0"], {}) as exchange:
        assert exchange.get(["in_range"])[0] == 1
        exchange.set(far)
        assert exchange.get(["output.tau", "in_range"])[1] == 1
        assert exchange.completed() == (True, False)
        exchange.fmu.enterEventMode()
        assert exchange.get(["in_range"])[0] == 0
        exchange.fmu.newDiscreteStates()
        exchange.fmu.enterContinuousTimeMode()
        assert exchange.completed() == (False, False)
        assert exchange.get(["in_range"])[0] == 0


@pytest.mark.parametrize("fmi", FMI)
def test_the_description_names_author_copyright_and_licence(exported: dict[str, Path], fmi: str) -> None:
    root = described(exported[fmi])
    assert root.get("author") == "the reefmu authors"
    assert root.get("copyright") == "Copyright (c) 2026, the reefmu authors"
    assert root.get("copyright", "") in (exported[fmi] / "documentation/licenses/license.txt").read_text("utf-8")
    (in_range,) = (v for v in root.iterfind("ModelVariables/*") if v.get("name") == "in_range")
    assert in_range.get("variability") == "discrete"
    if fmi == "2.0":
        assert root.find("ModelExchange").get("completedIntegratorStepNotNeeded") == "false"  # type: ignore[union-attr]
    else:
        assert root.find("ModelExchange").get("needsCompletedIntegratorStep") == "true"  # type: ignore[union-attr]


@pytest.mark.slow
@pytest.mark.parametrize("masses", [None, Masses(1e-4, 1.0)])
def test_an_fmu_for_fmi_3_names_fmi_3_everywhere(model: DriveModel, masses: Masses | None, tmp_path: Path) -> None:
    """In its description, its documentation and the messages in its binary."""
    path = export_fmu(model, tmp_path / "d.fmu", backend="native", fmi="3.0", masses=masses)
    with zipfile.ZipFile(path) as archive:
        for name in archive.namelist():
            if not name.startswith(("sources/", "resources/")):
                assert b"fmi2" not in archive.read(name), name
