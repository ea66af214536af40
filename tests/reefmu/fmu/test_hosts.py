"""The native FMU in other hosts: a C host of the tests' own, also under sanitizers, FMPy, libcosimpy, ecospy."""

from __future__ import annotations

import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from reefmu.fmu.build import export_fmu
from reefmu.fmu.host import FmuDrive
from reefmu.masses import Masses
from reefmu.model import DriveModel, build_model
from stiffness_model.lookup import Lookup

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None or not sys.platform.startswith("linux"),
                                reason="needs gcc on Linux")
WRAPPER = Path(__import__("reefmu").__file__).parent / "fmu" / "native"
SANITIZERS = ("-g", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all")


def build(target: Path, *words: str) -> Path:
    subprocess.run(["gcc", "-w", "-o", str(target), *words], check=True)
    return target


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("host") / "host", "-O1", "-I", str(WRAPPER),
                 str(Path(__file__).parent / "host" / "host.c"), "-ldl", "-lm", "-lpthread")


@pytest.fixture(scope="module")
def sanitized(unpacked: tuple[Path, Path, str], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Host and library with address and undefined-behaviour checks."""
    folder = tmp_path_factory.mktemp("sanitized")
    try:
        library = build(folder / "fmu.so", *SANITIZERS, "-fPIC", "-shared", str(unpacked[1] / "sources" / "all.c"),
                        "-lm")
        return build(folder / "host", *SANITIZERS, "-I", str(WRAPPER), str(Path(__file__).parent / "host" / "host.c"),
                     "-ldl", "-lm", "-lpthread"), library
    except subprocess.CalledProcessError:
        pytest.skip("gcc without sanitizers")


def call(host: Path, library: Path, guid: str, *words: str) -> str:
    done = subprocess.run([str(host), str(library), guid, *words], capture_output=True, text=True, timeout=120,
                          check=False)
    assert done.returncode == 0, f"status {done.returncode}: {done.stderr[-1500:]}"
    return done.stdout


def binary(folder: Path) -> Path:
    return next(p for p in folder.rglob("binaries/linux*/*.so"))


def test_2000_times_loaded_and_unloaded_without_growth(host: Path, unpacked: tuple[Path, Path, str]) -> None:
    call(host, binary(unpacked[1]), unpacked[2], "loop", "2000")


def test_two_threads_with_ten_instances(host: Path, unpacked: tuple[Path, Path, str]) -> None:
    call(host, binary(unpacked[1]), unpacked[2], "threads", "2000")


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_any_call_in_any_order(sanitized: tuple[Path, Path], unpacked: tuple[Path, Path, str], seed: int) -> None:
    call(*sanitized, unpacked[2], "fuzz", "60000", str(seed))


def test_threads_under_sanitizers(sanitized: tuple[Path, Path], unpacked: tuple[Path, Path, str]) -> None:
    call(*sanitized, unpacked[2], "threads", "200")


def test_model_exchange_in_fmpy(tmp_path: Path, drive: object, lookup: Lookup) -> None:
    """A joint by fmpy's CVode against the joint's own steps."""
    model = build_model(drive, {"creep": {"compliance": 1e-7, "time": 0.05}}, lookup=lookup)  # type: ignore[arg-type]
    path = export_fmu(model, tmp_path / "joint.fmu", backend="native", masses=Masses(1e-4, 1.0, 1e-3, 2.0))
    results = [fmpy.simulate_fmu(str(path), fmi_type=kind, stop_time=0.05, output_interval=1e-3, solver="CVode",
                                 relative_tolerance=1e-9, start_values={"start.output.phi": -1e-3, "load.tau": 2.0},
                                 output=["output.phi", "output.tau"]) for kind in ("CoSimulation", "ModelExchange")]
    for name, tolerance in (("output.phi", 1e-7), ("output.tau", 0.3)):
        np.testing.assert_allclose(results[0][name][1:51], results[1][name][1:51], atol=tolerance)


def test_an_ssp_with_two_drives(unpacked: tuple[Path, Path, str], tmp_path: Path) -> None:
    """A system structure of two components, one input for both, run by fmpy."""
    ports = "".join(f'<ssd:Connector name="{name}" kind="{kind}"><ssc:Real/></ssd:Connector>'
                    for name, kind in (("output.phi", "input"), ("output.tau", "output")))
    components = "".join(f'<ssd:Component name="{name}" type="application/x-fmu-sharedlibrary" '
                         'source="resources/d.fmu">'
                         f"<ssd:Connectors>{ports}</ssd:Connectors></ssd:Component>" for name in ("left", "right"))
    outside = "".join(f'<ssd:Connector name="{name}" kind="{kind}"><ssc:Real/></ssd:Connector>'
                      for name, kind in (("phi", "input"), ("left", "output"), ("right", "output")))
    wires = "".join(f'<ssd:Connection startConnector="phi" endElement="{n}" endConnector="output.phi"/>'
                    f'<ssd:Connection startElement="{n}" startConnector="output.tau" endConnector="{n}"/>'
                    for n in ("left", "right"))
    text = ('<?xml version="1.0" encoding="UTF-8"?><ssd:SystemStructureDescription name="two" version="1.0" '
            'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
            'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"><ssd:System name="two"><ssd:Connectors>'
            f"{outside}</ssd:Connectors><ssd:Elements>{components}</ssd:Elements><ssd:Connections>{wires}"
            "</ssd:Connections></ssd:System></ssd:SystemStructureDescription>")
    path = tmp_path / "two.ssp"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", text)
        archive.write(unpacked[0], "resources/d.fmu")
    from fmpy.ssp.simulation import simulate_ssp

    result = simulate_ssp(str(path), stop_time=0.02, step_size=1e-3, input={"phi": lambda t: -1e-3})
    assert result["left"][-1] > 0
    np.testing.assert_array_equal(result["left"], result["right"])


def test_libcosimpy_runs_it(unpacked: tuple[Path, Path, str], full_model: DriveModel) -> None:
    execution = pytest.importorskip("libcosimpy.CosimExecution", reason="foreign host libcosimpy")
    slave = pytest.importorskip("libcosimpy.CosimSlave", reason="foreign host libcosimpy")
    manipulator = pytest.importorskip("libcosimpy.CosimManipulator", reason="foreign host libcosimpy")
    observer = pytest.importorskip("libcosimpy.CosimObserver", reason="foreign host libcosimpy")
    run = execution.CosimExecution.from_step_size(step_size=1_000_000)
    index = run.add_local_slave(slave.CosimLocalSlave(fmu_path=str(unpacked[0]), instance_name="drive"))
    override = manipulator.CosimManipulator.create_override()
    run.add_manipulator(manipulator=override)
    last = observer.CosimObserver.create_last_value()
    run.add_observer(observer=last)
    override.slave_real_values(slave_index=index, variable_references=[2], values=[-1e-3])
    run.step(10)
    torque = last.last_real_values(slave_index=index, variable_references=[5])[0]
    with FmuDrive(unpacked[0]) as drive:
        drive.initialize()
        for _ in range(10):
            outputs = drive.step(1e-3, {"output.phi": -1e-3})
    assert torque == pytest.approx(outputs["output.tau"], rel=1e-2)
    assert torque > 0


def test_ecospy_runs_it(unpacked: tuple[Path, Path, str]) -> None:
    try:
        from ecospy import EcosSimulationStructure
    except (ImportError, OSError) as error:
        pytest.skip(f"foreign host ecospy: {error}")
    structure = EcosSimulationStructure()
    structure.add_model("drive", str(unpacked[0]))
    simulation = structure.create_simulation(1e-3)
    simulation.init()
    simulation.step(10)
    assert np.isfinite(simulation.get_real("drive::output.tau"))


@pytest.mark.skipif(shutil.which("wine") is None, reason="foreign host wine")
def test_the_windows_binary_loads_under_wine(full_model: DriveModel, tmp_path: Path) -> None:
    pytest.importorskip("ziglang")
    path = export_fmu(full_model, tmp_path / "win.fmu", backend="native", platform="win64")
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path / "out")
    source = tmp_path / "load.c"
    source.write_text('#include <windows.h>\n#include <stdio.h>\nint main(int n, char **w) {\n'
                      'HMODULE m = LoadLibraryA(w[1]); const char *(*v)(void);\nif (!m) return 1;\n'
                      'v = (const char *(*)(void))GetProcAddress(m, "fmi2GetVersion"); puts(v()); return 0; }\n')
    subprocess.run([sys.executable, "-m", "ziglang", "cc", "-target", "x86_64-windows-gnu", "-o", "load.exe", "load.c"],
                   cwd=tmp_path, check=True)
    library = next((tmp_path / "out").rglob("*.dll"))
    done = subprocess.run(["wine", "load.exe", str(library)], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "2.0"
