"""The native FMU in other hosts: a C host of these tests, also with sanitizers, FMPy, libcosimpy and ecospy, and its
binaries for Windows and 64-bit ARM with wine and qemu."""

from __future__ import annotations

import importlib
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path
from types import ModuleType

import fmpy
import numpy as np
import pytest

import stiffness_model as sm
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import drive_component
from reefmu.fmu.validation.reference_run import make_excitation, run_model
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import Masses
from stiffness_model.lookup.build_lookup import Lookup
from tests.integration.fmu.conftest import EFFECTS
from tests.integration.fmu.replay import build_replay, replay
from tests.subprocesses import TIMEOUT

pytestmark = pytest.mark.skipif(
    shutil.which("gcc") is None or not sys.platform.startswith("linux"), reason="needs gcc on Linux"
)
WRAPPER = Path(__import__("reefmu").__file__).parent / "fmu" / "native"
SANITIZERS = ("-g", "-fsanitize=address,undefined,float-cast-overflow", "-fno-sanitize-recover=all")


def build(target: Path, *words: str) -> Path:
    subprocess.run(["gcc", "-w", "-o", str(target), *words], check=True)
    return target


@pytest.fixture(scope="module")
def host(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(
        tmp_path_factory.mktemp("host") / "host",
        "-O1",
        f"-I{WRAPPER / 'fmi2'}",
        str(Path(__file__).parents[1] / "host" / "host.c"),
        "-ldl",
        "-lm",
        "-lpthread",
    )


@pytest.fixture(scope="module")
def sanitized(unpacked: tuple[Path, Path, str], tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """Host and library with the sanitizers for addresses, leaks and undefined behaviour."""
    return instrumented(SANITIZERS, unpacked[1], tmp_path_factory.mktemp("sanitized"))


def instrumented(flags: tuple[str, ...], fmu: Path, folder: Path, host: str = "host.c") -> tuple[Path, Path]:
    """Host and the library of an unpacked FMU, both compiled with these sanitizers."""
    try:
        library = build(
            folder / "fmu.so",
            *flags,
            "-fPIC",
            "-shared",
            "-DFMI2_OVERRIDE_FUNCTION_PREFIX",
            "-DFMI3_OVERRIDE_FUNCTION_PREFIX",
            str(fmu / "sources" / "all.c"),
            "-lm",
        )
        return build(
            folder / "host",
            *flags,
            f"-I{WRAPPER / 'fmi2'}",
            f"-I{WRAPPER / 'fmi3'}",
            str(Path(__file__).parents[1] / "host" / host),
            "-ldl",
            "-lm",
            "-lpthread",
        ), library
    except subprocess.CalledProcessError:
        pytest.skip("gcc without sanitizers")


def call(host: Path, library: Path, guid: str, *words: str) -> str:
    done = subprocess.run(
        [str(host), str(library), guid, *words], capture_output=True, text=True, timeout=TIMEOUT, check=False
    )
    assert done.returncode == 0, f"status {done.returncode}: {done.stderr[-1500:]}"
    return done.stdout


def binary(folder: Path) -> Path:
    return next(p for p in folder.rglob("binaries/linux*/*.so"))


def test_2000_times_loaded_and_unloaded_without_growth(host: Path, unpacked: tuple[Path, Path, str]) -> None:
    call(host, binary(unpacked[1]), unpacked[2], "loop", "2000", "32")  # kB; Linux counts pages in groups of up to 16


def test_two_threads_with_ten_instances(host: Path, unpacked: tuple[Path, Path, str]) -> None:
    call(host, binary(unpacked[1]), unpacked[2], "threads", "2000")


@pytest.mark.parametrize("seed", [1, 2, 3])
def test_any_call_in_any_order(sanitized: tuple[Path, Path], unpacked: tuple[Path, Path, str], seed: int) -> None:
    call(*sanitized, unpacked[2], "fuzz", "60000", str(seed))


def test_threads_under_sanitizers(sanitized: tuple[Path, Path], unpacked: tuple[Path, Path, str]) -> None:
    call(*sanitized, unpacked[2], "threads", "200")


def test_no_leak_in_loading_and_unloading(sanitized: tuple[Path, Path], unpacked: tuple[Path, Path, str]) -> None:
    """With the leak sanitizer alone: the address sanitizer keeps memory for every library that was loaded."""
    call(*sanitized, unpacked[2], "loop", "300", "1000000")


@pytest.mark.slow
def test_no_races_between_threads(unpacked: tuple[Path, Path, str], tmp_path: Path) -> None:
    call(*instrumented(("-g", "-O1", "-fsanitize=thread"), unpacked[1], tmp_path), unpacked[2], "threads", "200")


@pytest.mark.slow
@pytest.mark.parametrize(("fmi", "kind"), [("3.0", "drive"), ("3.0", "joint"), ("2.0", "joint"), ("2.0", "individual")])
def test_any_call_to_other_fmus(fmi: str, kind: str, model: DriveModel, drive: sm.Drive, tmp_path: Path) -> None:
    """In any order, with any values, with sanitizers: FMI 3.0, the joint, an individual."""
    one = build_model(drive, EFFECTS, lookup=model.lookup, individual=3) if kind == "individual" else model
    path = export_fmu(
        one,
        tmp_path / "other.fmu",
        backend="native",
        platform="none",
        fmi=fmi,
        masses=Masses(1e-4, 1.0) if kind == "joint" else None,
    )
    with zipfile.ZipFile(path) as archive:
        archive.extractall(tmp_path / "out")
    header = tmp_path / "out" / "sources" / "model.h"
    # A joint accepts ten million substeps in one step; here a thousand are enough.
    short, changes = re.subn(r"(?m)^(#define MAX_SUBSTEPS) .*$", r"\1 1000.0", header.read_text("utf-8"))
    assert changes == 1
    header.write_text(short, "utf-8")
    three = fmi == "3.0"
    made = instrumented(SANITIZERS, tmp_path / "out", tmp_path, "fuzz3.c" if three else "host.c")
    call(*made, read_archive(path).guid, *(() if three else ("fuzz",)), "3000" if kind == "joint" else "30000", "5")


def test_model_exchange_in_fmpy(tmp_path: Path, drive: object, lookup: Lookup) -> None:
    """A joint integrated by FMPy's CVode against its own integrator."""
    model = build_model(drive, {"creep": {"compliance": 1e-7, "time": 0.05}}, lookup=lookup)  # type: ignore[arg-type]
    path = export_fmu(model, tmp_path / "joint.fmu", backend="native", masses=Masses(1e-4, 1.0, 1e-3, 2.0))
    results = [
        fmpy.simulate_fmu(
            str(path),
            fmi_type=kind,
            stop_time=0.05,
            output_interval=1e-3,
            solver="CVode",
            relative_tolerance=1e-9,
            start_values={"start.output.phi": -1e-3, "load.tau": 2.0},
            output=["output.phi", "output.tau"],
        )
        for kind in ("CoSimulation", "ModelExchange")
    ]
    for name, tolerance in (("output.phi", 1e-7), ("output.tau", 0.3)):
        np.testing.assert_allclose(results[0][name][1:51], results[1][name][1:51], atol=tolerance)


def system_structure(
    path: Path, fmus: dict[str, tuple[Path, dict[str, str]]], outside: dict[str, str], wires: list[tuple[str, str]]
) -> Path:
    """An SSP. fmus: by component, with its connectors and their kinds. A connection joins two texts
    "component/connector"; "/connector" is a connector of the system."""

    def connectors(kinds: dict[str, str]) -> str:
        return (
            "<ssd:Connectors>"
            + "".join(
                f'<ssd:Connector name="{name}" kind="{kind}"><ssc:Real/></ssd:Connector>'
                for name, kind in kinds.items()
            )
            + "</ssd:Connectors>"
        )

    def end(which: str, place: str) -> str:
        element, _, connector = place.partition("/")
        return (f'{which}Element="{element}" ' if element else "") + f'{which}Connector="{connector}"'

    components = "".join(
        f'<ssd:Component name="{name}" type="application/x-fmu-sharedlibrary" '
        f'source="resources/{fmu.name}">{connectors(kinds)}</ssd:Component>'
        for name, (fmu, kinds) in fmus.items()
    )
    connections = "".join(f"<ssd:Connection {end('start', a)} {end('end', b)}/>" for a, b in wires)
    text = (
        '<?xml version="1.0" encoding="UTF-8"?><ssd:SystemStructureDescription name="two" version="1.0" '
        'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
        'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"><ssd:System name="two">'
        f"{connectors(outside) if outside else ''}<ssd:Elements>{components}</ssd:Elements><ssd:Connections>"
        f"{connections}</ssd:Connections></ssd:System></ssd:SystemStructureDescription>"
    )
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", text)
        for fmu in {fmu for fmu, _ in fmus.values()}:
            archive.write(fmu, f"resources/{fmu.name}")
    return path


def test_an_ssp_with_two_drives_in_fmpy(unpacked: tuple[Path, Path, str], tmp_path: Path) -> None:
    """Both receive the same input."""
    from fmpy.ssp.simulation import simulate_ssp

    drive = (unpacked[0], {"output.phi": "input", "output.tau": "output"})
    path = system_structure(
        tmp_path / "two.ssp",
        {"left": drive, "right": drive},
        {"phi": "input", "left": "output", "right": "output"},
        [
            ("/phi", "left/output.phi"),
            ("/phi", "right/output.phi"),
            ("left/output.tau", "/left"),
            ("right/output.tau", "/right"),
        ],
    )
    result = simulate_ssp(str(path), stop_time=0.02, step_size=1e-3, input={"phi": lambda t: -1e-3})
    assert result["left"][-1] > 0
    np.testing.assert_array_equal(result["left"], result["right"])


LOAD = {"output.phi": -1e-3}


def stepped(path: Path, start: dict[str, float]) -> dict[str, float]:
    """The outputs after ten steps of 1 ms with the inputs `LOAD`, by `FmuDrive`."""
    with FmuDrive(path) as drive:
        drive.initialize(start)
        for _ in range(10):
            outputs = drive.step(1e-3, LOAD)
    return outputs


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
    override.slave_real_values(slave_index=index, variable_references=[2], values=[LOAD["output.phi"]])
    run.step(10)
    # libcosimpy initialises without the load and sets it before the first step.
    assert (
        last.last_real_values(slave_index=index, variable_references=[5])[0]
        == stepped(unpacked[0], {})["output.tau"]
        > 0
    )


def test_ecospy_runs_it(unpacked: tuple[Path, Path, str]) -> None:
    ecospy = foreign_ecospy()
    with ecospy.EcosSimulationStructure() as structure:
        structure.add_model("drive", str(unpacked[0]))
        structure.add_parameter_set("load", {f"drive::{name}": value for name, value in LOAD.items()})
        with ecospy.EcosSimulation(structure=structure, step_size=1e-3) as simulation:
            simulation.init(parameter_set="load")
            simulation.step(10)
            assert simulation.get_real("drive::output.tau") == stepped(unpacked[0], LOAD)["output.tau"] > 0


def test_ecospy_runs_an_ssp_with_a_joint_and_a_drive_connected_to_it(
    drive: object, lookup: Lookup, tmp_path: Path
) -> None:
    """Ecos steps both in parallel, so the drive has the torque that the joint had one step before."""
    ecospy = foreign_ecospy()
    model = build_model(drive, lookup=lookup)  # type: ignore[arg-type]
    joint = export_fmu(model, tmp_path / "joint.fmu", backend="native", masses=Masses(1e-4, 1.0, 1e-3, 10.0))
    watching = export_fmu(model, tmp_path / "drive.fmu", backend="native")
    angles = ("crank.phi", "crank.w", "output.phi", "output.w")
    path = system_structure(
        tmp_path / "watched.ssp",
        {
            "joint": (joint, {"load.tau": "input", **dict.fromkeys((*angles, "output.tau"), "output")}),
            "drive": (watching, {**dict.fromkeys(angles, "input"), "output.tau": "output"}),
        },
        {},
        [(f"joint/{name}", f"drive/{name}") for name in angles],
    )
    torques = []
    with ecospy.EcosSimulation(ssp_path=str(path), step_size=1e-3) as simulation:
        simulation.init()
        simulation.set_real("joint::load.tau", -50.0)
        for _ in range(20):
            simulation.step(1)
            torques.append([simulation.get_real(f"{name}::output.tau") for name in ("joint", "drive")])
    joint_torque, watched = np.array(torques).T
    assert np.ptp(joint_torque) > 5
    np.testing.assert_array_equal(joint_torque[:-1], watched[1:])


def foreign_ecospy() -> ModuleType:
    try:
        return importlib.import_module("ecospy")
    except (ImportError, OSError) as error:  # on Debian its library needs the package libtbb12
        pytest.skip(f"foreign host ecospy: {error}")


def zig(*words: str) -> tuple[str, ...]:
    return (sys.executable, "-m", "ziglang", "cc", *words)


@pytest.mark.skipif(shutil.which("wine") is None, reason="foreign host wine")
def test_the_windows_binary_runs_under_wine(
    full_model: DriveModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Loops, a turning crank and uneven steps agree with the Python model to 1e-12 of full torque."""
    pytest.importorskip("ziglang", reason="foreign host wine: no ziglang to build for it")
    monkeypatch.setenv("WINEPREFIX", str(tmp_path / "wine"))
    monkeypatch.setenv("WINEDEBUG", "-all")
    host = build_replay(tmp_path / "replay.exe", zig("-target", "x86_64-windows-gnu"), ())
    assert_agrees_with_the_model(["wine", host.name], full_model, "win64", tmp_path)


QEMU_ROOT = Path("/usr/aarch64-linux-gnu")


@pytest.mark.skipif(shutil.which("qemu-aarch64") is None or not QEMU_ROOT.is_dir(), reason="foreign host qemu-aarch64")
def test_the_arm64_binary_runs_under_qemu(full_model: DriveModel, tmp_path: Path) -> None:
    """The same for 64-bit ARM, with Debian's libc6-arm64-cross."""
    pytest.importorskip("ziglang", reason="foreign host qemu-aarch64: no ziglang to build for it")
    host = build_replay(tmp_path / "replay", zig("-target", "aarch64-linux-gnu.2.36"))
    assert_agrees_with_the_model(["qemu-aarch64", "-L", str(QEMU_ROOT), str(host)], full_model, "linux-arm64", tmp_path)


def assert_agrees_with_the_model(command: list[str], model: DriveModel, platform: str, folder: Path) -> None:
    path = export_fmu(model, folder / f"{platform}.fmu", backend="native", platform=platform)
    with zipfile.ZipFile(path) as archive:
        (member,) = (name for name in archive.namelist() if name.startswith("binaries/"))
        archive.extract(member, folder)
    component = drive_component(model)
    excitation = make_excitation(component)
    came = replay(command, member, read_archive(path).guid, component, excitation, folder)[:, : len(component.outputs)]
    expected = run_model(component, excitation, component.parameter_vector())
    scale = np.maximum(np.abs(expected).max(axis=0), 1.0)
    scale[0] = model.full_torque
    assert np.abs(expected[:, 0]).max() > 0.5 * model.full_torque
    assert (np.abs(came - expected) / scale).max() < 1e-12
