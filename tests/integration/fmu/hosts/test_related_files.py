"""Reference results and parameter sets inside an FMU: as the layered standard FMI-LS-REF expects them, and true."""

from __future__ import annotations

import zipfile
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import fmpy
import numpy as np
import pytest

from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import drive_component
from reefmu.fmu.model.presets import LARGE, SMALL, loaded_presets, presets
from reefmu.fmu.related_files import EXPERIMENTS, FOLDER, MANIFEST, REFERENCES, STIMULI, TOLERANCE
from reefmu.fmu.validation.fmu_check import check_fmu
from reefmu.fmu.validation.run_checks import check_references
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.drive_model import DriveModel
from reefmu.model.masses import TYPICAL_MASSES
from stiffness_model.errors import InputError


def extracted(path: Path, folder: Path) -> Path:
    with zipfile.ZipFile(path) as archive:
        archive.extractall(folder)
    return folder / FOLDER


@pytest.mark.slow
@pytest.mark.parametrize(("kind", "fmi"), [("drive", "2.0"), ("joint", "2.0"), ("drive", "3.0")])
def test_fmpy_replays_the_reference_results(kind: str, fmi: str, model: DriveModel, tmp_path: Path) -> None:
    masses = TYPICAL_MASSES if kind == "joint" else None
    path = export_fmu(model, tmp_path / "x.fmu", backend="native", masses=masses, fmi=fmi)
    folder = extracted(path, tmp_path / "out")
    experiment = ElementTree.parse(folder / EXPERIMENTS).getroot()[0]
    stimuli = np.genfromtxt(folder / STIMULI, delimiter=",", names=True, deletechars="")
    expected = np.genfromtxt(folder / REFERENCES, delimiter=",", names=True, deletechars="")
    step, stop = (float(experiment.get(name, "nan")) for name in ("stepSize", "stopTime"))
    result = fmpy.simulate_fmu(
        str(path),
        fmi_type="CoSimulation",
        stop_time=stop,
        step_size=step,
        output_interval=step,
        input=stimuli,
        output=list(expected.dtype.names[1:]),
    )
    assert len(result) == len(expected)
    for name in expected.dtype.names[1:]:
        scale = np.abs(expected[name]).max() or 1.0
        np.testing.assert_allclose(result[name], expected[name], rtol=0, atol=TOLERANCE * scale, err_msg=name)


def test_the_manifest_lists_files_that_exist(native: Path, tmp_path: Path) -> None:
    folder = extracted(native, tmp_path)
    root = ElementTree.parse(folder / MANIFEST).getroot()
    space = "{http://fmi-standard.org/fmi-ls-manifest}"
    assert root.get(f"{space}fmi-ls-name") == "org.fmi-standard.fmi-ls-ref"
    sources = [related.get("source", "") for related in root]
    assert all((folder / source).is_file() for source in sources)
    assert {file.name for file in folder.iterdir()} == {
        MANIFEST,
        STIMULI,
        REFERENCES,
        *(source for source in sources if "/" not in source),
    }


def test_a_parameter_set_can_be_applied_to_the_fmu(native: Path, model: DriveModel, tmp_path: Path) -> None:
    folder = extracted(native, tmp_path)
    start = {p.name: p.value for p in model.parameters}
    sets = {preset.name: preset for preset in presets(drive_component(model))}
    assert sets["hysteresis_small"].values["hysteresis.torque"] == pytest.approx(SMALL * start["hysteresis.torque"])
    assert sets["backlash_large"].values["backlash.clearance"] == pytest.approx(LARGE * start["backlash.clearance"])
    assert (sets["p10"].values["band"], sets["p90"].values["band"]) == (-1.0, 1.0)
    torques = {}
    for name in sets:
        with FmuDrive(native, parameters=values_of(folder / f"{name}.ssv")) as drive:
            drive.initialize({})
            torques[name] = drive.step(1e-3, {"output.phi": -1e-3})["output.tau"]
    assert set(torques) | {"loaded"} == {file.stem for file in folder.glob("*.ssv")}
    assert torques["p10"] < torques["mean"] < torques["p90"]
    assert torques["hysteresis_small"] < torques["mean"] < torques["hysteresis_large"]


def values_of(file: Path) -> dict[str, float]:
    return {p.get("name", ""): float(p[0].get("value", "nan")) for p in ElementTree.parse(file).getroot()[0]}


@pytest.mark.slow
def test_a_joint_that_starts_loaded_stays_at_rest(model: DriveModel, tmp_path: Path) -> None:
    """With the torques of the parameter set: half the full torque on the output, and no motion."""
    path = export_fmu(model, tmp_path / "x.fmu", backend="native", masses=TYPICAL_MASSES)
    values = values_of(extracted(path, tmp_path / "out") / "loaded.ssv")
    held = {name: values.pop(name) for name in ("motor.tau", "load.tau")}
    with FmuDrive(path, parameters=values) as joint:
        outputs = [joint.initialize(held), *(joint.step(1e-3, held) for _ in range(50))]
    torques = np.array([row["output.tau"] for row in outputs])
    np.testing.assert_allclose(torques, 0.5 * model.full_torque, rtol=1e-9)
    assert max(abs(row["output.w"]) for row in outputs) < 1e-9


def test_a_drive_starts_loaded(native: Path, model: DriveModel, tmp_path: Path) -> None:
    values = values_of(extracted(native, tmp_path) / "loaded.ssv")
    with FmuDrive(native, parameters=values) as drive:
        outputs = drive.initialize({})
    assert outputs["output.tau"] == pytest.approx(0.5 * model.full_torque, rel=1e-12)


@pytest.mark.parametrize("load", [60.0, -25.0])
def test_a_drive_starts_under_the_load_that_the_export_states(model: DriveModel, tmp_path: Path, load: float) -> None:
    path = export_fmu(model, tmp_path / "x.fmu", backend="python", load=load)
    values = values_of(extracted(path, tmp_path / "out") / "loaded.ssv")
    with FmuDrive(path, parameters=values) as drive:
        assert drive.initialize({})["output.tau"] == pytest.approx(load, rel=1e-9)


def test_a_load_out_of_reach_is_refused_and_leaves_no_file(model: DriveModel, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"load: expected a torque from -\d+"):
        export_fmu(model, tmp_path / "x.fmu", backend="python", load=1e9)
    assert list(tmp_path.iterdir()) == []


def test_a_drive_that_does_not_reach_the_load_has_no_such_set(model: DriveModel) -> None:
    component = drive_component(model)
    (mean, *_) = presets(component)
    assert [preset.name for preset in loaded_presets(component, mean)] == ["loaded"]
    assert loaded_presets(replace(component, full_torque=1e9), mean) == ()


@pytest.mark.slow
def test_check_replays_the_results_and_finds_one_that_was_changed(native: Path, tmp_path: Path) -> None:
    assert check_fmu(native)["replay"].passed
    changed = tmp_path / "changed.fmu"
    with zipfile.ZipFile(native) as source, zipfile.ZipFile(changed, "w") as copy:
        for name in source.namelist():
            content = source.read(name)
            if name.endswith(REFERENCES):
                head, *rows = content.decode().splitlines()
                cells = rows[30].split(",")
                cells[1] = repr(float(cells[1]) + 1e-6)
                content = "\n".join([head, *rows[:30], ",".join(cells), *rows[31:], ""]).encode()
            copy.writestr(name, content)
    result = check_references(read_archive(changed))
    assert not result.passed
    assert "output.tau" in result.detail
