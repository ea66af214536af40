"""The sources of a native FMU: linked into one program with others, with the names that the standard requires."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import fmpy
import pytest

from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.variables import FMI_VERSIONS
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.drive_model import DriveModel
from reefmu.model.masses import Masses
from tests.subprocesses import TIMEOUT

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(
        shutil.which("gcc") is None or not sys.platform.startswith("linux"), reason="needs gcc on Linux"
    ),
]
HOST = Path(__file__).parents[1] / "host" / "linked.c"
WRAPPER = Path(__import__("reefmu").__file__).parent / "fmu" / "native"
COMPILERS = [
    "gcc",
    pytest.param(
        "musl-gcc",
        marks=pytest.mark.skipif(shutil.which("musl-gcc") is None, reason="foreign host musl-gcc (Debian: musl-tools)"),
    ),
]
TRIAL = {"drive": ("output.phi", -1e-3, "output.tau"), "joint": ("load.tau", -5.0, "output.w")}
"""An input, its value and an output, by kind."""


def unpacked_sources(path: Path, folder: Path) -> Path:
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    return folder / "sources"


def linked(fmus: list[Path], fmi: str, compiler: str, folder: Path) -> list[str]:
    """The output of a static program that contains all these FMUs."""
    rows, objects = [], []
    for k, path in enumerate(fmus):
        file = read_archive(path)
        sources = unpacked_sources(path, folder / str(k))
        objects.append(folder / f"{k}.o")
        subprocess.run([compiler, "-std=c99", "-O1", "-c", "-o", objects[-1], sources / "all.c"], check=True)
        references = {
            v.name: v.valueReference for v in fmpy.read_model_description(str(path), validate=False).modelVariables
        }
        source, value, result = TRIAL[file.kind]
        rows.append(f'X({file.model_identifier}_, "{file.guid}", {references[source]}, {value}, {references[result]})')
    (folder / "linked.h").write_text("\n".join(rows) + "\n", "utf-8")
    subprocess.run(
        [
            compiler,
            "-static",
            f"-DFMI={fmi[0]}",
            "-I",
            folder,
            f"-I{WRAPPER / 'fmi2'}",
            f"-I{WRAPPER / 'fmi3'}",
            "-o",
            folder / "host",
            HOST,
            *objects,
            "-lm",
        ],
        check=True,
    )
    done = subprocess.run([folder / "host"], capture_output=True, text=True, timeout=TIMEOUT, check=False)
    assert done.returncode == 0, f"status {done.returncode}: {done.stdout}"
    return done.stdout.splitlines()


@pytest.mark.parametrize("compiler", COMPILERS)
@pytest.mark.parametrize("fmi", list(FMI_VERSIONS))
def test_two_drives_and_a_joint_link_into_one_static_program(
    fmi: str, compiler: str, full_model: DriveModel, soft_model: DriveModel, tmp_path: Path
) -> None:
    """Without duplicate symbols, with the numbers of the library, and with messages that are no format strings."""
    masses = Masses(1e-4, 1.0)
    fmus = [
        export_fmu(model, tmp_path / f"{k}.fmu", backend="native", fmi=fmi, masses=given)
        for k, (model, given) in enumerate([(full_model, None), (soft_model, None), (soft_model, masses)])
    ]
    printed = linked(fmus, fmi, compiler, tmp_path)
    for path, number, message in zip(fmus, printed[::2], printed[1::2], strict=True):
        source, value, result = TRIAL[read_archive(path).kind]
        with FmuDrive(path) as drive:
            drive.initialize()
            expected = drive.step(1e-3, {source: value})[result]
        assert float(number) == pytest.approx(expected, rel=1e-12)
        # A category may hold any text. FMI 2.0.4, section 2.1.5: "##" stands for "#" in a message.
        hash_sign = "##" if fmi == "2.0" else "#"
        assert message == f"fmi{fmi[0]}SetDebugLogging: unknown category '%n%s{hash_sign}'"


@pytest.mark.parametrize("fmi", list(FMI_VERSIONS))
def test_every_external_name_begins_with_the_identifier(fmi: str, model: DriveModel, tmp_path: Path) -> None:
    path = export_fmu(model, tmp_path / "d.fmu", backend="native", platform="none", fmi=fmi)
    sources = unpacked_sources(path, tmp_path / "out")
    assert not [file.name for file in sources.iterdir() if ".symver" in file.read_text("utf-8")]
    for flags, prefix in (
        ((), f"drive_1_fmi{fmi[0]}"),
        ((f"-DFMI{fmi[0]}_OVERRIDE_FUNCTION_PREFIX",), f"fmi{fmi[0]}"),
        ((f"-DFMI{fmi[0]}_FUNCTION_PREFIX=mine_",), f"mine_fmi{fmi[0]}"),
    ):
        subprocess.run(["gcc", "-c", *flags, "-o", tmp_path / "d.o", sources / "all.c"], check=True)
        listed = subprocess.run(
            ["nm", "-g", "--defined-only", tmp_path / "d.o"], capture_output=True, text=True, check=True
        ).stdout
        names = [line.split()[-1] for line in listed.splitlines()]
        assert names
        assert all(name.startswith(prefix) for name in names), names


def test_the_identifier_is_that_of_the_model(model: DriveModel, tmp_path: Path) -> None:
    """For all values of the parameters, so that a host's project finds an FMU that was exported again."""
    changed = model.with_parameters({"hysteresis.torque": 4.5})
    for fmi in FMI_VERSIONS:
        files = [read_archive(export_fmu(m, tmp_path / "d.fmu", backend="native", fmi=fmi)) for m in (model, changed)]
        assert [file.model_identifier for file in files] == ["drive_1", "drive_1"]
        assert files[0].guid != files[1].guid
        assert any(re.fullmatch(r"binaries/[\w-]+/drive_1\.so", name) for name in files[0].members)
