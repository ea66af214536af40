"""The native FMU of an individual: generated C of its contacts in place of the lookup's tables."""

from __future__ import annotations

import shutil
import zipfile
from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.cli import main
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import drive_component, load_component
from reefmu.fmu.model.joint_component import joint_component
from reefmu.fmu.model.joint_equations import maximum_stiffness
from reefmu.fmu.model.table_encoding import TABLES, decode_tables, embedded_lookup, encode_tables, lookup_metadata
from reefmu.fmu.validation.fmu_check import check_fmu, embedded_component
from reefmu.fmu.validation.reference_run import make_excitation, run_fmu, run_model
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.contacts.individual import individual_function
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import Masses
from reefmu.model.model_file import save_model
from reefmu.model.signals import OUTPUTS
from stiffness_model.errors import InputError
from stiffness_model.lookup.build_lookup import Lookup

pytestmark = pytest.mark.slow

needs_compiler = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler on the PATH"
)
NAMES = tuple(signal.name for signal in OUTPUTS)
MASSES = Masses(1e-4, 1.0)


@pytest.fixture(scope="module")
def one(drive: sm.Drive, lookup: Lookup) -> DriveModel:
    return build_model(drive, lookup=lookup, individual=3)


@needs_compiler
def test_native_python_and_model_agree(
    full_individual: DriveModel, full_model: DriveModel, full_native_individual: Path, tmp_path: Path
) -> None:
    """With all effects, to 1e-12 of full torque, over reversals and uneven steps, and not equal to the mean drive."""
    component = drive_component(full_individual)
    excitation = make_excitation(component)
    expected = run_model(component, excitation, component.parameter_vector())
    for path in (full_native_individual, export_fmu(full_individual, tmp_path / "python.fmu", backend="python")):
        with FmuDrive(path) as drive:
            deviation = np.abs(run_fmu(drive, excitation, NAMES) - expected)
        assert deviation[:, NAMES.index("output.tau")].max() < 1e-12 * full_individual.full_torque
        assert (deviation.max(axis=0) <= 1e-11 * np.maximum(np.abs(expected).max(axis=0), 1)).all()
    population = drive_component(full_model.with_parameters(band=0.0))
    mean = run_model(population, excitation, population.parameter_vector())
    assert np.abs(mean[:, 0] - expected[:, 0]).max() > 1e-3 * full_individual.full_torque


@needs_compiler
@pytest.mark.parametrize(("fmi", "masses"), [("2.0", MASSES), ("3.0", None), ("3.0", MASSES)])
def test_check_passes(one: DriveModel, fmi: str, masses: Masses | None, tmp_path: Path) -> None:
    path = export_fmu(one, tmp_path / "one.fmu", backend="native", fmi=fmi, masses=masses)
    report = check_fmu(path)
    assert report.passed, str(report)
    assert report["agreement"].value < 1e-12


@needs_compiler
def test_check_passes_with_effects(drive: sm.Drive, lookup: Lookup, tmp_path: Path) -> None:
    """With every table that an individual uses: modulus and a missing element."""
    effects = {
        "modulus_error": {"error": -0.1},
        "missing_ball": {"size": 0.7},
        "backlash": {"clearance": 3e-6},
        "structural_compliance": {"compliance": 2e-6},
    }
    model = build_model(drive, effects, lookup=lookup, individual=3)
    report = check_fmu(export_fmu(model, tmp_path / "one.fmu", backend="native"))
    assert report.passed, str(report)


@needs_compiler
def test_the_torque_follows_the_output_by_its_derivative(one: DriveModel, tmp_path: Path) -> None:
    """Turning crank and output together at constant twist changes the torque by the directional derivative, which would
    be zero for the mean drive."""
    path = export_fmu(one, tmp_path / "one.fmu", backend="native")
    ratio, twist, turned = one.drive.ratio, 0.6 * one.drive.max_twist, 1e-5
    with FmuDrive(path) as drive:
        drive.initialize({"crank.phi": ratio * twist})
        torque, slope = [], 0.0
        for angle in (0.2 - turned, 0.2, 0.2 + turned):
            at = {"crank.phi": ratio * (angle + twist), "output.phi": angle}
            torque.append(drive.step(1e-3, at)["output.tau"])
            if angle == 0.2:
                slope = drive.derivative(["output.tau"], {"crank.phi": ratio, "output.phi": 1.0})["output.tau"]
    assert abs(slope) > 1
    assert slope == pytest.approx((torque[2] - torque[0]) / (2 * turned), rel=1e-5)


def test_it_contains_no_tables_of_the_mean(one: DriveModel, full_individual: DriveModel, tmp_path: Path) -> None:
    for model in (one, full_individual):
        path = export_fmu(model, tmp_path / "one.fmu", backend="native", platform="none")
        with zipfile.ZipFile(path) as archive:
            header = archive.read(f"sources/{TABLES}").decode()
        assert "LOOKUP" not in header
        assert ("ELEMENT_WORDS" in header) is (model is full_individual)


def test_the_encoded_lookup_of_an_individual_is_decoded(full_individual: DriveModel) -> None:
    lookup, embedded = full_individual.lookup, embedded_lookup(full_individual)
    again = decode_tables(encode_tables(embedded), lookup_metadata(embedded), "here")
    assert again.coefficients.shape == (5, 0, 0)
    assert (again.axes, again.full_torque, again.drawing, again.modulus) == (
        lookup.axes,
        lookup.full_torque,
        {**lookup.drawing},
        lookup.modulus,
    )
    assert again.element is not None
    assert lookup.element is not None
    assert np.abs(again.element.coefficients - lookup.element.coefficients).max() < 1e-13 * lookup.full_torque


def test_a_mean_drive_without_tables_is_refused(
    one: DriveModel, lookup: Lookup, drive: sm.Drive, tmp_path: Path
) -> None:
    embedded = embedded_lookup(one)
    (tmp_path / TABLES).write_text(encode_tables(embedded))
    (tmp_path / "lookup.json").write_text(lookup_metadata(embedded))
    save_model(one, tmp_path / "model.toml")
    assert load_component(tmp_path).name == "drive_1 individual 3"
    save_model(build_model(drive, lookup=lookup), tmp_path / "model.toml")
    with pytest.raises(InputError, match=r"model\.toml: expected an individual or a curve where there are no tables"):
        load_component(tmp_path)


def test_the_longest_substep_of_a_joint_follows_from_the_individuals_stiffness(one: DriveModel) -> None:
    """No stiffness in the range exceeds the one behind `max_step` by more than what lies between its angles."""
    assert one.individual is not None
    rng = np.random.default_rng(5)
    twist, clearance = (rng.uniform(axis.start, axis.stop, 3000) for axis in one.lookup.axes)
    slope = np.asarray(
        individual_function(one.individual, one.lookup).map(3000)(twist, clearance, rng.uniform(0, 2 * np.pi, 3000))[1]
    )
    assert 0.8 * maximum_stiffness(one) < slope.max() < 1.01 * maximum_stiffness(one)
    component = joint_component(one, MASSES)
    softness = 1 / (MASSES.motor_inertia * one.drive.ratio**2) + 1 / MASSES.load_inertia
    assert component.max_step is not None
    assert float(component.max_step(component.parameter_vector())) == pytest.approx(
        0.1 / np.sqrt(maximum_stiffness(one) * softness)
    )


@needs_compiler
def test_command_line(
    lookup: Lookup, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("reefmu.model.drive_model.cached_lookup", lambda *_: lookup)
    target = tmp_path / "seven.fmu"
    words = ["export", "drive_1", "-o", str(target), "--backend", "native", "--individual", "7"]
    assert main([*words, "--fmi", "3", "--kind", "joint"]) == 0
    assert "drive_1 individual 7: " in capsys.readouterr().out
    file = read_archive(target)
    assert (file.kind, embedded_component(file).name) == ("joint", "drive_1 individual 7")
