"""The native back end: its FMU against the standard, the model and the Python back end."""

from __future__ import annotations

import shutil
import struct
import subprocess
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest

from reefmu.cli import main
from reefmu.fmu.codegen import compile as platforms
from reefmu.fmu.codegen import compiler_run
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import drive_component
from reefmu.fmu.validation.fmu_check import check_fmu
from reefmu.fmu.validation.reference_run import make_excitation, run_fmu, run_model
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.drive_model import DriveModel
from reefmu.model.signals import OUTPUTS
from stiffness_model.errors import InputError, UnknownNameError

pytestmark = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler on the PATH"
)
NAMES = tuple(signal.name for signal in OUTPUTS)


@pytest.fixture
def slave(native: Path) -> Iterator[FmuDrive]:
    with FmuDrive(native) as opened:
        yield opened


def test_check_passes(native: Path, full_native: Path) -> None:
    for path in (native, full_native):
        report = check_fmu(path)
        assert report.passed, str(report)


def test_native_python_and_model_agree_with_all_effects(
    full_model: DriveModel, full_native: Path, tmp_path: Path
) -> None:
    """To 1e-12 of full torque, over reversals and uneven steps, after a reset and a restore during a loop."""
    component = drive_component(full_model)
    excitation = make_excitation(component)
    half = len(excitation.dt) // 2
    expected = run_model(component, excitation, component.parameter_vector())
    python = export_fmu(full_model, tmp_path / "python.fmu", backend="python")
    for path in (full_native, python):
        with FmuDrive(path) as drive:
            run_fmu(drive, excitation.part(0, 7), NAMES)
            drive.reset()
            came = [run_fmu(drive, excitation.part(0, half), NAMES)]
            saved = drive.save()
            drive.step(0.1, excitation.at(3))
            drive.restore(saved)
            for row in range(half, len(excitation.dt)):
                came.append(np.array([list(drive.step(float(excitation.dt[row]), excitation.at(row + 1)).values())]))
        deviation = np.abs(np.vstack(came) - expected)
        assert deviation[:, NAMES.index("output.tau")].max() < 1e-12 * full_model.full_torque
        assert (deviation.max(axis=0) <= 1e-12 * np.maximum(np.abs(expected).max(axis=0), 1)).all()


def test_the_same_model_gives_the_same_bytes(
    model: DriveModel, native: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REEFMU_CACHE", str(tmp_path / "empty"))
    again = export_fmu(model, tmp_path / "again.fmu", backend="native")
    assert again.read_bytes() == native.read_bytes()


def test_a_binary_is_compiled_once(
    model: DriveModel, native: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    right = subprocess.run

    def no_compiling(command: list[str], *args: object, **kwargs: object) -> object:
        assert "-o" not in command
        return right(command, *args, **kwargs)  # type: ignore[call-overload]

    monkeypatch.setattr(compiler_run.subprocess, "run", no_compiling)
    export_fmu(model, tmp_path / "again.fmu", backend="native")


@pytest.mark.skipif(shutil.which("readelf") is None, reason="no readelf")
@pytest.mark.skipif(platforms.host_platform() not in ("linux64", "linux-arm64"), reason="not on Linux")
def test_the_linux_binary_has_few_dependencies(full_native: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(full_native) as archive:
        member = next(name for name in archive.namelist() if name.startswith("binaries/"))
        binary = Path(archive.extract(member, tmp_path))
    dynamic = subprocess.run(["readelf", "-dW", str(binary)], capture_output=True, text=True, check=True).stdout
    needed = {line.split("[")[1].rstrip("]") for line in dynamic.splitlines() if "NEEDED" in line}
    assert needed <= {"libc.so.6", "libm.so.6"}
    symbols = subprocess.run(
        ["readelf", "--dyn-syms", "-W", str(binary)], capture_output=True, text=True, check=True
    ).stdout
    versions = {tuple(map(int, part.split()[0].rstrip(")").split("."))) for part in symbols.split("GLIBC_")[1:]}
    assert max(versions) <= (2, 17)
    defined = {line.split()[7] for line in symbols.splitlines() if line.split()[6:7] not in ([], ["UND"], ["Ndx"])}
    assert defined
    assert all(name.startswith("fmi2") for name in defined)


@pytest.mark.slow
def test_sources_compile_with_fmpy(native: Path, model: DriveModel, tmp_path: Path) -> None:
    if shutil.which("cmake") is None:
        pytest.skip("no cmake")
    copy = tmp_path / "sources.fmu"
    with zipfile.ZipFile(native) as source, zipfile.ZipFile(copy, "w") as target:
        for name in source.namelist():
            if not name.startswith("binaries/"):
                target.writestr(name, source.read(name))
    from fmpy.build import build_platform_binary

    folder = fmpy.extract(str(copy), str(tmp_path / "out"))
    (tmp_path / "build").mkdir()
    build_platform_binary(folder, tmp_path / "build")
    result = fmpy.simulate_fmu(
        folder, stop_time=0.01, output_interval=1e-3, start_values={"output.phi": -1e-3}, output=["output.tau"]
    )
    expected = np.asarray(
        model.output(
            model.initial([0, 0, -1e-3, 0, 20], model.parameter_vector()),
            [0, 0, -1e-3, 0, 20],
            model.parameter_vector(),
        )
    ).ravel()[0]
    assert result["output.tau"][0] == pytest.approx(expected, rel=1e-12)


def test_the_description_offers_both_interface_types(native: Path, model: DriveModel) -> None:
    with zipfile.ZipFile(native) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    for tag in ("ModelExchange", "CoSimulation"):
        element = root.find(tag)
        assert element is not None
        assert element.get("providesDirectionalDerivative") == "true"
        assert [f.get("name") for f in element.findall("SourceFiles/File")] == ["all.c"]
    assert len(root.findall("ModelStructure/Derivatives/Unknown")) == len(drive_component(model).states)
    assert int(root.get("numberOfEventIndicators", "")) == 1


def test_an_inadmissible_value_is_discarded_and_changes_nothing(slave: FmuDrive) -> None:
    before = slave.initialize()
    for name, value in (("crank.phi", float("nan")), ("output.w", float("inf")), ("temperature", -300.0)):
        with pytest.raises(InputError, match=rf"\(discard\).*{name}: expected a finite number from"):
            slave.step(1e-3, {"crank.w": 0.0, name: value})
        slave._input_block.write(name, 20.0 if name == "temperature" else 0.0)
    assert slave.step(1e-3) == before
    with pytest.raises(InputError, match="band: expected a finite number from -1 to 1"):
        slave.set_parameters({"band": 2.0})
    with pytest.raises(InputError, match="a step above 0 s"):
        slave.step(-1.0)
    with pytest.raises(InputError, match=r"\(error\).*ratio cannot be set in this mode"):
        slave.set_parameters({"ratio": -28.0})


def test_a_wrong_guid_is_refused(native: Path, tmp_path: Path) -> None:
    other = tmp_path / "other.fmu"
    guid = read_archive(native).guid
    with zipfile.ZipFile(native) as source, zipfile.ZipFile(other, "w") as target:
        for name in source.namelist():
            content = source.read(name)
            changed = content.replace(guid[:9].encode(), b"{00000000") if name.endswith(".xml") else content
            target.writestr(name, changed)
    with pytest.raises(InputError, match=r"got no instance: fmi2Instantiate: expected GUID"):
        FmuDrive(other)


@pytest.mark.parametrize(
    "change",
    [
        lambda s: s[:-1],
        lambda s: s + b"x",
        lambda s: s[:8] + bytes(len(s) - 8),
        lambda s: s[:60] + b"\xff" * (len(s) - 60),
    ],
)
def test_a_damaged_state_is_refused(slave: FmuDrive, change: Callable[[bytes], bytes]) -> None:
    slave.initialize()
    saved = slave.save()
    with pytest.raises(InputError, match="expected a state of this FMU"):
        slave.restore(change(saved))
    slave.restore(saved)


def test_unknown_names(model: DriveModel, tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'native'"):
        export_fmu(model, tmp_path / "x.fmu", backend="nativ")
    with pytest.raises(UnknownNameError, match="did you mean 'win64'"):
        export_fmu(model, tmp_path / "x.fmu", backend="native", platform="win46")
    assert not list(tmp_path.iterdir())


def test_no_compiler(model: DriveModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    monkeypatch.delenv("CC", raising=False)
    monkeypatch.setattr(compiler_run.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install '\.\[native\]' in a clone"):
        export_fmu(model, tmp_path / "x.fmu", backend="native")
    export_fmu(model, tmp_path / "sources.fmu", backend="native", platform="none")
    assert [p.name for p in tmp_path.iterdir()] == ["sources.fmu"]


def test_a_compiler_that_fails(model: DriveModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("REEFMU_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("CC", "false")
    with pytest.raises(InputError, match="expected false to compile the model, got status 1") as refused:
        export_fmu(model, tmp_path / "x.fmu", backend="native")
    assert "\n" not in str(refused.value)
    assert not (tmp_path / "x.fmu").exists()


def test_command_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    target = tmp_path / "d.fmu"
    assert main(["export", "drive_1", "-o", str(target), "--backend", "native"]) == 0
    assert "co-simulation and model exchange" in capsys.readouterr().out
    assert main(["check", str(target)]) == 0
    assert main(["export", "drive_1", "-o", str(target), "--backend", "python", "--platform", "linux64"]) == 2
    assert main(["export", "drive_1", "-o", str(target), "--backend", "native", "--platform", "amiga"]) == 2
    assert "unknown platform 'amiga'" in capsys.readouterr().err


def test_a_library_for_two_processors() -> None:
    """The table of a fat Mach-O file: big-endian, slices aligned to 16 kB."""
    slices = [
        struct.pack("<III", 0xFEEDFACF, processor, 3) + bytes(size)
        for processor, size in ((0x01000007, 100), (0x0100000C, 20000))
    ]
    whole = platforms.universal_library(slices)
    assert struct.unpack_from(">II", whole) == (0xCAFEBABE, 2)
    for k, content in enumerate(slices):
        processor, _, at, size, page = struct.unpack_from(">IIIII", whole, 8 + 20 * k)
        assert whole[at : at + size] == content
        assert processor == struct.unpack_from("<I", content, 4)[0]
        assert at % (1 << page) == 0
