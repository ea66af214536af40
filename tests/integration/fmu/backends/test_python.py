"""The Python back end: its content, its dependencies and messages, and when it is chosen."""

from __future__ import annotations

import itertools
import json
import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import reefmu
import stiffness_model
from reefmu.cli import main
from reefmu.fmu.codegen import compile as platforms
from reefmu.fmu.codegen import compiler_run
from reefmu.fmu.export import export_fmu
from reefmu.fmu.model.component import Component, drive_component
from reefmu.fmu.model.declaration import declare
from reefmu.fmu.model.joint_component import joint_component
from reefmu.fmu.model.kernel import StepKernel
from reefmu.fmu.python_backend import equations_file, real_time
from reefmu.fmu.python_backend.equations_file import EQUATIONS_FILE, read_equations, write_equations
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.drive_model import DriveModel
from reefmu.model.masses import Masses
from stiffness_model.errors import InputError
from tests.subprocesses import TIMEOUT

Rewrite = Callable[[Callable[[str, bytes], bytes | None]], Path]
COMPILER = pytest.mark.skipif(not platforms.has_compiler(), reason="no C compiler")
RUN = """
import os, sys
from fmpy import extract, read_model_description
from fmpy.fmi2 import FMU2Slave
folder = extract(sys.argv[1], sys.argv[2])
told = read_model_description(folder, validate=False)
fmu = FMU2Slave(guid=told.guid, unzipDirectory=folder, modelIdentifier=told.coSimulation.modelIdentifier,
                instanceName="x")
fmu.instantiate()
fmu.setupExperiment(startTime=0.0)
fmu.enterInitializationMode()
fmu.exitInitializationMode()
fmu.doStep(0.0, 1e-4)
print(*sorted({name.split(".")[0] for name in sys.modules}))
fmu.terminate()
fmu.freeInstance()
sys.stdout.flush()
os._exit(0)
"""
"""The host ends without exit handlers: that of pythonfmu's library reads what another one has freed (valgrind), and
whether that ends the process with a signal depends on how long its paths are."""


def run(fmu: Path, folder: Path, code: str = RUN, **environment: str) -> subprocess.CompletedProcess[str]:
    """Run an FMU in a minimal host in a process of its own, which prints the packages it has loaded."""
    return subprocess.run(
        [sys.executable, "-c", code, str(fmu), str(folder)],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        env=os.environ | environment,
        cwd=folder.parent,
        check=False,
    )


def joint_of(model: DriveModel) -> Component:
    return joint_component(model, Masses(1e-4, 2.0))


def test_a_running_fmu_loads_no_scipy(fmu: Path, tmp_path: Path) -> None:
    """SciPy takes a second to load, and its `_uarray` crashes hosts in C when they finalise Python."""
    loaded = run(fmu, tmp_path).stdout.split()
    assert "casadi" in loaded
    assert not {"scipy", "matplotlib", "control", "pint"} & set(loaded)


@pytest.mark.parametrize("make", [drive_component, joint_of])
def test_the_equations_in_the_file_are_those_of_the_model(
    make: Callable[[DriveModel], Component], full_model: DriveModel
) -> None:
    """To the last bit, over steps of one substep and of several."""
    component = make(full_model)
    content = write_equations(component, declare(component))
    equations, interface = read_equations(content, "here")
    assert interface == declare(component)
    assert content == write_equations(component, declare(component))
    one, other = StepKernel(component, interface), StepKernel(equations, interface)
    for kernel in (one, other):
        kernel.initialise()
        for dt in (1e-5, 1e-4):
            assert kernel.step(dt)
    assert one.values == other.values
    assert np.isfinite(one.values).all()


def test_a_package_with_another_equation_is_refused(fmu: Path, tmp_path: Path) -> None:
    """One sign differs in a copy of the package: the interface is the same, the numbers would not be."""
    for package in (reefmu, stiffness_model):
        source = Path(str(package.__file__)).parent
        shutil.copytree(source, tmp_path / source.name, ignore=shutil.ignore_patterns("__pycache__"))
    same = run(fmu, tmp_path / "same", PYTHONPATH=str(tmp_path))
    assert same.returncode == 0, same.stderr
    changed = tmp_path / "reefmu" / "model" / "stages" / "order.py"
    text = changed.read_text("utf-8")
    changed.write_text(text.replace("(Place.OUTPUT, -1)", "(Place.OUTPUT, 1)"), "utf-8")
    assert changed.read_text("utf-8") != text
    assert run(fmu, tmp_path / "bare", PYTHONPATH=str(tmp_path)).returncode != 0
    other = run(
        fmu,
        tmp_path / "other",
        "import sys\nfrom reefmu.fmu.importer.instance import FmuDrive\nFmuDrive(sys.argv[1])",
        PYTHONPATH=str(tmp_path),
    )
    assert "expected a package with the equations that the FMU was exported with" in other.stderr
    assert "export the FMU again" in other.stderr


@pytest.mark.slow
def test_the_digest_covers_every_module_that_an_export_loads() -> None:
    """The imports found in the source contain all modules loaded while a joint is built and stepped."""
    code = (
        "import sys, warnings\nwarnings.simplefilter('ignore')\nimport reefmu.fmu.model.joint_component\n"
        "import reefmu.model, reefmu.fmu.model.kernel\n"
        "print(*(n for n in sys.modules if n.split('.')[0] in ('reefmu', 'stiffness_model')))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, timeout=TIMEOUT, check=True)
    modules = set(equations_file.model_modules())
    packages = {name for name in done.stdout.split() if (equations_file._source(name) or Path()).name == "__init__.py"}
    assert set(done.stdout.split()) - packages <= modules
    assert modules >= {
        "reefmu.model.stages.order",
        "reefmu.effects.twist.creep",
        "stiffness_model.rotation.individual_contacts",
    }


@pytest.mark.parametrize(
    "spoil",
    [
        lambda table: [],
        lambda table: table | {"functions": "nonsense"},
        lambda table: table | {"functions": 7},
        lambda table: table | {"interface": {"kind": "drive"}},
        lambda table: table | {"modules": 3},
        lambda table: {k: v for k, v in table.items() if k != "code"},
    ],
)
def test_a_damaged_equations_file_gives_one_line(
    spoil: Callable[[dict[str, object]], object], model: DriveModel
) -> None:
    component = drive_component(model)
    table = json.loads(write_equations(component, declare(component)))
    for content in (json.dumps(spoil(table)).encode(), b"[" * 100000, b"\xff"):
        with pytest.raises(InputError) as refused:
            read_equations(content, "equations.json")
        assert "\n" not in str(refused.value)


def test_it_declares_its_dependencies(fmu: Path, tmp_path: Path) -> None:
    with zipfile.ZipFile(fmu) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
        text = archive.read("documentation/externalDependencies.txt").decode()
        page = archive.read("documentation/externalDependencies.html").decode()
        assert f"resources/{EQUATIONS_FILE}" in archive.namelist()
    simulation = root.find("CoSimulation")
    assert simulation is not None
    assert simulation.get("needsExecutionTool") == "true"
    assert "libpython" in root.get("description", "")
    for words in ("libpython", f"reefmu {reefmu.__version__}", "CasADi", "--backend native"):
        assert words in text
        assert words in page


@COMPILER
def test_a_native_fmu_needs_no_tool(native: Path) -> None:
    with zipfile.ZipFile(native) as archive:
        assert b'needsExecutionTool="true"' not in archive.read("modelDescription.xml")
        assert not [name for name in archive.namelist() if "externalDependencies" in name]


@COMPILER
def test_the_default_is_native_where_there_is_a_compiler(
    model: DriveModel, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert read_archive(export_fmu(model, tmp_path / "d.fmu")).backend == "native"
    assert main(["export", "drive_1", "-o", str(tmp_path / "e.fmu")]) == 0
    assert read_archive(tmp_path / "e.fmu").backend == "native"
    assert "needs Python" not in "".join(capsys.readouterr())


@pytest.mark.slow
def test_without_a_compiler_the_python_back_end_is_announced(
    model: DriveModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(platforms, "_program", lambda p: ())
    with pytest.warns(UserWarning, match="no C compiler here: the FMU runs in Python"):
        assert read_archive(export_fmu(model, tmp_path / "d.fmu")).backend == "python"
    words = ["export", "drive_1", "-o", str(tmp_path / "e.fmu"), "--step", "1"]
    assert main(words) == 0
    told = [line for line in capsys.readouterr().err.splitlines() if "compiler" in line]
    assert len(told) == 1
    assert told[0].startswith("note: no C compiler here")
    assert main([*words, "--backend", "python"]) == 0  # chosen explicitly: no message
    assert "compiler" not in capsys.readouterr().err
    for only_native in (["--backend", "native"], ["--platform", "linux64"], ["--fmi", "3"]):
        assert main([*words, *only_native]) == 2
        assert "pip install '.[native]' in a clone" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("compiler", "words"),
    [
        ("true", "expected true to compile the model, got status 0 without a library"),
        ("no-such-compiler", r"neither ziglang nor the program that CC names \(no-such-compiler\)"),
    ],
)
def test_an_unusable_compiler_is_named(
    compiler: str, words: str, model: DriveModel, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("REEFMU_CACHE", str(tmp_path / "cache"))
    monkeypatch.setenv("CC", compiler)
    monkeypatch.setattr(compiler_run.importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=words):
        export_fmu(model, tmp_path / "x.fmu", backend="native")
    assert not (tmp_path / "x.fmu").exists()


@COMPILER
def test_a_blank_cc_counts_as_not_set(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("CC", "  ")
    assert platforms.has_compiler()


def test_an_unknown_machine_has_no_compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(platforms, "host_platform", lambda: "")
    assert not platforms.has_compiler()


def test_a_step_slower_than_real_time_is_announced(
    full_model: DriveModel, model: DriveModel, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a clock on which every step takes 1 ms; a joint's substeps are counted, not run."""
    clock = itertools.count(0.0, 1e-3)
    monkeypatch.setattr(real_time, "clock", lambda: next(clock))
    drive, joint = drive_component(model), joint_of(full_model)
    assert real_time.step_cost(drive, 1e-3) == pytest.approx(1e-3)
    parts = joint.substeps(1e-2, joint.parameter_vector())
    assert parts > 100
    assert real_time.step_cost(joint, 1e-2) == pytest.approx(parts * 1e-3)
    assert real_time.real_time_note(drive, 0.01) == []
    (line,) = real_time.real_time_note(joint, 1e-2)
    assert "slower than real time" in line
    assert "--backend native" in line


@pytest.mark.slow
@pytest.mark.skipif(shutil.which("gcc") is None or not sys.platform.startswith("linux"), reason="needs gcc on Linux")
def test_a_host_in_c_with_libpython_ends_without_a_crash(fmu: Path, tmp_path: Path) -> None:
    """It finalises Python after CasADi's library has cleared its tables; no function may be freed then."""
    folder, name = sysconfig.get_config_var("LIBDIR"), sysconfig.get_config_var("LDLIBRARY")
    library = Path(str(folder), str(name))
    if library.suffix != ".so" or not library.exists():
        pytest.skip("this Python has no libpython to load")
    here, wrapper = (
        Path(__file__).parents[1] / "host" / "once.c",
        Path(str(reefmu.__file__)).parent / "fmu" / "native" / "fmi2",
    )
    host = tmp_path / "once"
    subprocess.run(["gcc", "-w", "-I", str(wrapper), "-o", str(host), str(here), "-ldl"], check=True)
    with zipfile.ZipFile(fmu) as archive:
        archive.extractall(tmp_path / "out")
    binary = next((tmp_path / "out").rglob("binaries/linux64/*.so"))
    words = [str(host), str(binary), read_archive(fmu).guid, (tmp_path / "out" / "resources").as_uri()]
    path = os.pathsep.join(place for place in sys.path if place)
    alone = subprocess.run(words, capture_output=True, text=True, timeout=TIMEOUT, check=False)
    assert alone.returncode == 3  # as documentation/externalDependencies.txt states
    assert "Py_" in alone.stderr
    for _ in range(4):
        for more in ([], ["free"]):
            done = subprocess.run(
                [*words, *more],
                capture_output=True,
                text=True,
                timeout=TIMEOUT,
                check=False,
                env=os.environ | {"LD_PRELOAD": str(library), "PYTHONPATH": path},
            )
            assert done.returncode == 0, done.stderr
