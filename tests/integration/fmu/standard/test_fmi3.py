"""The native FMU for FMI 3.0: valid, with the same numbers as that for FMI 2.0 in both interface types."""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest
from fmpy.validation import validate_fmu
from lxml import etree

from reefmu.cli import main
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import drive_component
from reefmu.fmu.validation.fmi3_rules import rule_violations
from reefmu.fmu.validation.fmu_check import check_fmu
from reefmu.fmu.validation.static_checks import check_fmi3_rules
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.drive_model import DriveModel
from reefmu.model.masses import Masses
from stiffness_model.errors import InputError, UnknownNameError

pytestmark = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler on the PATH"
)
SCHEMA = Path(fmpy.__file__).parent / "schema" / "fmi3"
OUTPUTS = ["output.tau", "crank.tau", "twist", "stiffness", "max_contact_force", "load_share", "measured.tau"]


@pytest.fixture(scope="module")
def three(full_model: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(full_model, tmp_path_factory.mktemp("fmi3") / "full.fmu", backend="native", fmi="3.0")


@pytest.fixture(scope="module")
def joint(model: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> Path:
    return export_fmu(
        model,
        tmp_path_factory.mktemp("fmi3") / "joint.fmu",
        backend="native",
        fmi="3.0",
        masses=Masses(1e-4, 1.0, 1e-3, 2.0),
    )


def member(path: Path, name: str) -> bytes:
    with zipfile.ZipFile(path) as archive:
        return archive.read(name)


@pytest.mark.slow
def test_it_is_valid_and_agrees_with_the_model(three: Path, joint: Path) -> None:
    for path in (three, joint):
        assert validate_fmu(str(path)) == []
        report = check_fmu(path)
        assert report.passed, str(report)
        assert report["agreement"].value <= 1e-12
        assert read_archive(path).fmi_version == "3.0"


@pytest.mark.parametrize("kind", ["CoSimulation", "ModelExchange"])
def test_the_same_numbers_as_for_fmi_2(kind: str, three: Path, unpacked: tuple[Path, Path, str]) -> None:
    """A turning crank and a load of changing sign, in FMPy with CVode."""
    t = np.linspace(0, 0.1, 101)
    crank = 5 * np.sin(20 * t)
    output = crank / -29 - 1e-3 * np.sin(70 * t)
    signals = np.rec.fromarrays(
        [t, crank, np.gradient(crank, t), output, np.gradient(output, t), 20 + 100 * t],
        names=["time", "crank.phi", "crank.w", "output.phi", "output.w", "temperature"],
    )
    two, came = (
        fmpy.simulate_fmu(str(path), fmi_type=kind, stop_time=0.1, output_interval=1e-3, input=signals, output=OUTPUTS)
        for path in (unpacked[0], three)
    )
    assert np.ptp(two["output.tau"]) > 50
    for name in ("time", *OUTPUTS):
        np.testing.assert_allclose(came[name], two[name], rtol=0, atol=1e-12 * np.abs(two[name]).max())


def test_ecospy_runs_it(three: Path) -> None:
    try:
        from ecospy import EcosSimulation, EcosSimulationStructure
    except (ImportError, OSError) as error:
        pytest.skip(f"foreign host ecospy: {error}")
    load = {"output.phi": -1e-3}
    with EcosSimulationStructure() as structure, FmuDrive(three) as drive:
        structure.add_model("drive", str(three))
        structure.add_parameter_set("load", {"drive::output.phi": -1e-3})
        drive.initialize(load)
        with EcosSimulation(structure=structure, step_size=1e-3) as simulation:
            simulation.init(parameter_set="load")
            for _ in range(5):
                simulation.step(1)
                assert simulation.get_real("drive::output.tau") == drive.step(1e-3, load)["output.tau"] > 0


def test_the_description_declares_units_states_and_indicators(three: Path, full_model: DriveModel) -> None:
    root = ElementTree.fromstring(member(three, "modelDescription.xml"))
    variables = {v.get("name"): v for v in root.findall("ModelVariables/Float64")}
    assert variables["stiffness"].get("unit") == "N.m/rad"
    assert root.find("UnitDefinitions/Unit[@name='N.m/rad']/BaseUnit").get("kg") == "1"  # type: ignore[union-attr]
    (time,) = (v for v in variables.values() if v.get("causality") == "independent")
    by_reference = {v.get("valueReference"): name for name, v in variables.items()}
    assert len(by_reference) == len(variables)
    rates = [by_reference[e.get("valueReference")] for e in root.findall("ModelStructure/ContinuousStateDerivative")]
    assert rates == [f"der({s.name})" for s in drive_component(full_model).states]
    states = [by_reference[variables[name].get("derivative")] for name in rates]
    assert states == [s.name for s in drive_component(full_model).states]
    indicators = [by_reference[e.get("valueReference")] for e in root.findall("ModelStructure/EventIndicator")]
    assert indicators == ["indicator.twist", "indicator.crank", "indicator.output"]
    assert time.get("name") == "time"
    # OMSimulator takes value references for positions in the list, counted from one.
    assert [v.get("valueReference") for v in variables.values()] == [str(k + 1) for k in range(len(variables))]


def test_an_indicator_has_the_value_of_its_rate(three: Path) -> None:
    names = [
        f"{kind}.{path}{end}"
        for kind, end in (("indicator", ""), ("der(last", ")"))
        for path in ("twist", "crank", "output")
    ]
    with FmuDrive(three) as drive:
        drive.initialize()
        drive.step(1e-3, {"crank.w": 3.0, "output.w": -0.2})
        values = list(drive.read(names).values())
        assert values[:3] == values[3:]
        assert values[1:3] == [3.0, -0.2]
        slopes = drive.derivative(names, {"output.w": 1.0})
        assert [slopes[name] for name in names] == [-1.0, 0.0, 1.0] * 2


def with_changed_description(path: Path, target: Path, pattern: str, by: str) -> Path:
    """The FMU with one change in its description."""
    with zipfile.ZipFile(path) as source, zipfile.ZipFile(target, "w") as copy:
        for name in source.namelist():
            content = source.read(name)
            if name == "modelDescription.xml":
                text, changes = re.subn(pattern, by, content.decode())
                assert changes >= 1
                content = text.encode()
            copy.writestr(name, content)
    return target


@pytest.mark.parametrize(
    ("rule", "pattern", "by", "said"),
    [
        # The last derivative is declared as an event indicator.
        (
            "unknowns",
            r'(?s)(name="der\(torque_sensor_drift\.grown\)" valueReference=("\d+").*<EventIndicator \w+=)"\d+"',
            r"\1\2",
            "der(torque_sensor_drift.grown) is also an event indicator",
        ),
        ("unknowns", r'<InitialUnknown valueReference="6" .*/>', "", "output.tau is missing"),
        (
            "unknowns",
            r"</ModelStructure>",
            '<InitialUnknown valueReference="1" dependencies=""/></ModelStructure>',
            "crank.phi is not an initial unknown",
        ),
        (
            "references",
            r'valueReference="(\d+)"',
            lambda match: f'valueReference="{int(match[1]) - 1}"',
            "crank.phi has 0, not 1",
        ),
    ],
)
def test_check_finds_violations_of_other_importers_rules(
    three: Path, tmp_path: Path, rule: str, pattern: str, by: str, said: str
) -> None:
    assert set(rule_violations(read_archive(three))) == {"references", "unknowns"}
    path = with_changed_description(three, tmp_path / "changed.fmu", pattern, by)
    assert said in "; ".join(rule_violations(read_archive(path))[rule])
    assert rule in [result.name for result in check_fmi3_rules(read_archive(path)) if not result.passed]


def test_the_terminals_are_flanges(three: Path, joint: Path) -> None:
    for path in (three, joint):
        text = member(path, "terminalsAndIcons/terminalsAndIcons.xml")
        etree.XMLSchema(file=str(SCHEMA / "fmi3TerminalsAndIcons.xsd")).assertValid(etree.fromstring(text))
        description = ElementTree.fromstring(member(path, "modelDescription.xml"))
        units = {
            v.get("name"): (v.get("unit"), v.get("causality")) for v in description.findall("ModelVariables/Float64")
        }
        terminals = ElementTree.fromstring(text).findall("Terminals/Terminal")
        assert [t.get("name") for t in terminals] == ["crank", "output"]
        assert {t.get("terminalKind") for t in terminals} == {"reefmu.RotationalFlange"}
        for terminal in terminals:
            members = {
                m.get("memberName"): (*units[m.get("variableName")], m.get("variableKind"))
                for m in terminal.findall("TerminalMemberVariable")
            }
            angle, torque, flow = ("input", "output", "outflow") if path == three else ("output", "input", "inflow")
            assert members == {
                "phi": ("rad", angle, "signal"),
                "w": ("rad/s", angle, "signal"),
                "tau": ("N.m", torque, flow),
            }


def test_a_saved_state_can_be_restored_in_another_instance(three: Path) -> None:
    with FmuDrive(three) as first, FmuDrive(three) as second:
        first.initialize()
        first.step(1e-3, {"output.phi": -1e-3})
        second.initialize({"output.phi": 5e-4})
        second.restore(first.save())
        load = {"output.phi": -8e-4}
        assert first.step(1e-3, load) == second.step(1e-3, load)
        with pytest.raises(InputError, match="fmi3DeserializeFMUState: expected a state of this FMU"):
            second.restore(first.save()[:-1])
        assert second.read(["time"])["time"] == pytest.approx(2e-3)


def test_errors_name_functions_of_fmi_3(three: Path) -> None:
    with FmuDrive(three) as drive:
        drive.initialize()
        with pytest.raises(InputError, match="fmi3SetFloat64: ratio cannot be set in this mode"):
            drive.set_parameters({"ratio": -28.0})
        with pytest.raises(InputError, match=r"\(discard\).*temperature: expected a finite number"):
            drive.step(1e-3, {"temperature": float("nan")})
        drive._input_block.write("temperature", 20.0)
        slave = drive._loaded.fmu
        number, value, reference = (ctypes.c_uint32 * 1)(0), (ctypes.c_int32 * 1)(), slave._fmu
        with pytest.raises(Exception, match="fmi3GetInt32"):
            reference.fmi3GetInt32(slave.component, number, 1, value, 1)
        with pytest.raises(Exception, match="fmi3EnterStepMode"):
            reference.fmi3EnterStepMode(slave.component)
        for log, said in ((True, "fmi3InstantiateCoSimulation: expected eventModeUsed = false"), (False, "nothing")):
            drive._messages[:] = ["nothing"]
            assert not reference.fmi3InstantiateCoSimulation(
                b"x", drive.guid.encode(), b"", False, log, True, False, None, 0, None, slave._log, slave._update
            )
            assert drive._messages[-1].startswith(said)
        assert not slave.instantiate("x", "{wrong}", "")
        assert drive._messages[-1].startswith("fmi3Instantiate: expected GUID")
        assert np.isfinite(drive.step(1e-3)["output.tau"])


@pytest.mark.slow
def test_sources_compile_with_fmpy(joint: Path, tmp_path: Path) -> None:
    if shutil.which("cmake") is None:
        pytest.skip("no cmake")
    from fmpy.build import build_platform_binary

    folder = Path(fmpy.extract(str(joint), str(tmp_path / "out")))
    shutil.rmtree(folder / "binaries")
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build")
    results = [
        fmpy.simulate_fmu(
            str(path),
            stop_time=0.01,
            output_interval=1e-3,
            output=["output.tau"],
            start_values={"start.output.phi": -1e-3},
        )
        for path in (folder, joint)
    ]
    np.testing.assert_allclose(results[0]["output.tau"], results[1]["output.tau"], rtol=1e-9)


@pytest.mark.skipif(shutil.which("nm") is None or not sys.platform.startswith("linux"), reason="no nm on Linux")
def test_the_library_exports_only_functions_of_fmi_3(three: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(three) as archive:
        name = next(name for name in archive.namelist() if name.startswith("binaries/"))
        library = archive.extract(name, tmp_path)
    assert name.split("/")[1] in ("x86_64-linux", "aarch64-linux")
    listed = subprocess.run(["nm", "-D", "--defined-only", library], capture_output=True, text=True, check=True).stdout
    exported = {line.split()[-1] for line in listed.splitlines()}
    assert all(name.startswith("fmi3") for name in exported)
    assert {"fmi3GetVersion", "fmi3DoStep", "fmi3GetAdjointDerivative", "fmi3ActivateModelPartition"} <= exported


@pytest.mark.slow
def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str], model: DriveModel) -> None:
    target = tmp_path / "d.fmu"
    words = ["export", "drive_3", "-o", str(target), "--drives", "8"]
    assert main([*words, "--fmi", "3", "--backend", "python"]) == 2
    assert "expected --fmi 3 without --backend python" in capsys.readouterr().err
    assert main([*words, "--fmi", "3"]) == 0
    assert "FMI 3.0 co-simulation and model exchange" in capsys.readouterr().out
    with pytest.raises(UnknownNameError, match=r"unknown version of FMI '3\.1'"):
        export_fmu(model, target, backend="native", fmi="3.1")
    assert read_archive(target).fmi_version == "3.0"
