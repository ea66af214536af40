"""The page in an FMU's documentation: what it states, and that it runs the drive as the native binary does."""

from __future__ import annotations

import json
import re
import subprocess
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from reefmu.cli import main
from reefmu.fmu.documentation import web_assembly
from reefmu.fmu.documentation.drive_page import drive_page
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import drive_component
from reefmu.fmu.model.declaration import declare_with_derivatives
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import TYPICAL_MASSES
from stiffness_model.lookup.table import Lookup
from tests.integration.diagnosis.browser import CHROMIUM
from tests.subprocesses import TIMEOUT

MAX_GROWTH = 150 * 1024
"""Bytes by which the module may enlarge an FMU."""


def page_of(path: Path) -> str:
    with zipfile.ZipFile(path) as archive:
        return archive.read("documentation/index.html").decode()


def sources_only(model: DriveModel, path: Path, **options: object) -> Path:
    return export_fmu(model, path, backend="native", platform="none", **options)  # type: ignore[arg-type]


@pytest.fixture
def compiler(monkeypatch: pytest.MonkeyPatch) -> None:
    """ziglang, which other tests do without."""
    pytest.importorskip("ziglang", reason="foreign host Chromium: no ziglang to compile the page's module")
    monkeypatch.setattr(web_assembly, "has_zig", lambda: True)


def test_the_page_states_variables_equations_signs_step_and_licence(model: DriveModel, tmp_path: Path) -> None:
    page = page_of(sources_only(model, tmp_path / "x.fmu"))
    for effect in model.effects:
        for clause in effect.equation.split(",  "):
            assert clause.replace("<", "&lt;").replace(">", "&gt;") in page
    assert "<code>stiffness</code> are those at constant states" in page
    assert "`" not in page
    assert "<code>start.torque</code> the drive starts in equilibrium" in page
    assert "start at <code>start.hysteresis.deflection</code>" in page
    for name in ("crank.phi", "output.tau", "band", *(p.name for p in model.parameters)):
        assert f"<code>{name}</code></td>" in page
    assert "for a positive twist" in page
    assert re.search(r"proposed step h = [\d.e-]+ s", page)
    assert "licence BSD-3-Clause" in page
    assert web_assembly.NO_COMPILER in page
    assert not re.search(r"""(src|href)=["']?(https?:)?//""", page)


def test_fields_are_in_the_unit_of_their_typical_value(full_model: DriveModel) -> None:
    component = drive_component(full_model, start=False)
    page = drive_page(component, declare_with_derivatives(component), "", b"module")
    found = {name: unit for unit, name in re.findall(r'value="[^"]*"> (\S*) <code>([\w.]+)</code>', page)}
    assert found["hysteresis.presliding"] == "arcmin"
    assert found["kinematic_error.phase_1"] == "deg"
    assert found["backlash.clearance"] == "um"


def test_the_picture_shows_the_curve_and_its_band(model: DriveModel, tmp_path: Path) -> None:
    page = page_of(sources_only(model, tmp_path / "x.fmu"))
    svg = ElementTree.fromstring(re.search(r"<svg.*?</svg>", page, re.DOTALL)[0])  # type: ignore[index]
    (curve,) = (e for e in svg if e.get("class") == "curve")
    points = np.array([p.split(",") for p in curve.get("points", "").split()], dtype=float)
    assert (np.diff(points[:, 0]) > 0).all()
    assert (np.diff(points[:, 1]) <= 0).all()
    assert [e.tag for e in svg].count("polygon") == 1


def test_the_page_of_a_joint_states_its_motion(model: DriveModel, tmp_path: Path) -> None:
    page = page_of(sources_only(model, tmp_path / "x.fmu", masses=TYPICAL_MASSES))
    assert "load.inertia  d(output.w)/dt = load.tau - load.damping output.w + output.tau" in page
    assert "divides a communication step into as many substeps" in page


@pytest.mark.parametrize(("fmi", "icon"), [("2.0", "model.png"), ("3.0", "terminalsAndIcons/icon.png")])
def test_an_fmu_has_an_icon_where_its_standard_expects_it(
    model: DriveModel, fmi: str, icon: str, tmp_path: Path
) -> None:
    with zipfile.ZipFile(sources_only(model, tmp_path / "x.fmu", fmi=fmi)) as archive:
        assert archive.read(icon).startswith(b"\x89PNG")
        assert sum(name.endswith(".png") for name in archive.namelist()) == 1


def self_test(page: Path, work: Path, values: dict[str, float]) -> list[dict[str, object]]:
    """The rows of the page's own run in headless Chromium, from the file system, with these parameters."""
    assert CHROMIUM is not None
    words = "&".join(f"{name}={value!r}" for name, value in values.items())
    command = [
        CHROMIUM,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--no-first-run",
        "--disable-background-networking",
        f"--user-data-dir={work / 'profile'}",
        "--virtual-time-budget=5000",
        "--dump-dom",
        f"{page.as_uri()}#selftest&{words}",
    ]
    dom = subprocess.run(command, check=True, capture_output=True, text=True, timeout=TIMEOUT).stdout
    found = re.search(r'<pre id="selftest">(.*?)</pre>', dom, re.DOTALL)
    assert found, re.findall(r'id="drive-error">([^<]*)', dom)
    return json.loads(found[1])


def deviation(rows: list[dict[str, object]], path: Path, model: DriveModel, values: dict[str, float]) -> float:
    """Greatest difference of the page's outputs from those of the native binary, relative to full scale."""
    came, expected = [], []
    with FmuDrive(path, parameters=values) as drive:
        first = dict.fromkeys(drive.inputs, 0.0) | {"temperature": 20.0, "crank.phi": 0.2}
        ratio = next(p.value for p in model.parameters if p.name == "ratio")
        drive.initialize(first | {"output.phi": 0.2 / ratio})
        for row in rows:
            outputs = drive.step(row["dt"], dict(zip(drive.inputs, row["u"], strict=True)))  # type: ignore[arg-type]
            expected.append([outputs[name] for name in drive.outputs])
            came.append(row["y"])
    scale = np.maximum(np.abs(expected).max(axis=0), 1.0)
    assert np.abs(expected).max(axis=0)[0] > 0.5 * model.full_torque
    return float((np.abs(np.array(came) - expected) / scale).max())


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="foreign host Chromium")
@pytest.mark.usefixtures("compiler")
@pytest.mark.parametrize("which", ["full_model", "full_individual"])
def test_the_page_runs_the_drive_as_the_native_binary(
    which: str, request: pytest.FixtureRequest, tmp_path: Path
) -> None:
    """All effects, a changed parameter, a turning crank and loops: 1e-12 of full scale, in at most 150 kB more."""
    model = request.getfixturevalue(which)
    path = export_fmu(model, tmp_path / "x.fmu", backend="native")
    (tmp_path / "index.html").write_text(page_of(path), "utf-8")
    values = {"hysteresis.torque": 3.25, "creep.compliance": 2e-6}
    rows = self_test(tmp_path / "index.html", tmp_path, values)
    assert len(rows) > 100
    assert deviation(rows, path, model, values) < 1e-12
    without = export_fmu(model, tmp_path / "static.fmu", backend="native", interactive=False)
    assert path.stat().st_size - without.stat().st_size < MAX_GROWTH


@pytest.mark.slow
@pytest.mark.usefixtures("compiler")
def test_the_page_of_a_joint_and_of_fmi_3_runs_the_drive_inside(drive: object, lookup: Lookup, tmp_path: Path) -> None:
    """The module is that of the drive in every case, and imports nothing."""
    model = build_model(drive, lookup=lookup)  # type: ignore[arg-type]
    pages = [
        page_of(sources_only(model, tmp_path / "x.fmu", fmi=fmi, masses=masses))
        for fmi, masses in (("2.0", None), ("2.0", TYPICAL_MASSES), ("3.0", None))
    ]
    modules = [re.search(r'id="drive-module">(.*?)</script>', page)[1] for page in pages]  # type: ignore[index]
    assert modules[0] == modules[1]
    assert abs(len(modules[2]) - len(modules[0])) < 100
    assert "<code>motor.tau</code>" in pages[1]


@pytest.mark.slow
@pytest.mark.usefixtures("compiler")
@pytest.mark.skipif(CHROMIUM is None, reason="foreign host Chromium")
def test_curve_writes_the_same_page(tmp_path: Path) -> None:
    assert main(["curve", "CHA-40A-50", "--interactive", "--out", str(tmp_path / "out")]) == 0
    rows = self_test(tmp_path / "out" / "interactive.html", tmp_path, {})
    assert max(row["y"][0] for row in rows) > 100  # type: ignore[index]


def test_curve_says_that_its_page_does_not_run_without_a_compiler(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["curve", "CHA-40A-50", "--interactive", "--out", str(tmp_path / "out")]) == 0
    page = (tmp_path / "out" / "interactive.html").read_text("utf-8")
    assert web_assembly.NO_COMPILER in page
    assert "<svg" in page
    assert "interactive.html does not run the drive" in capsys.readouterr().err
