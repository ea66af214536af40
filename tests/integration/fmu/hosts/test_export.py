import os
import re
import zipfile
from dataclasses import replace
from xml.etree import ElementTree

import pytest
from fmpy.validation import validate_fmu

from reefmu.fmu.export import export_fmu
from reefmu.fmu.model.component import drive_component
from reefmu.fmu.xml.archive import read_archive
from reefmu.model import build_model
from reefmu.model.drive_model import build_curve_model
from reefmu.model.masses import Masses
from stiffness_model.errors import InputError
from stiffness_model.io.drawing_toml import drive_to_dict, load_drive
from stiffness_model.lookup.curve_lookup import curve_lookup


def test_validation_finds_no_problem(fmu, soft_fmu):
    assert validate_fmu(str(fmu)) == []
    assert validate_fmu(str(soft_fmu)) == []


def test_the_same_model_gives_the_same_bytes(model, fmu, tmp_path):
    again = export_fmu(model, tmp_path / "again.fmu", backend="python")
    assert again.read_bytes() == fmu.read_bytes()


def test_another_model_gives_other_names(model, fmu, tmp_path):
    hysteresis = model.with_parameters(**{"hysteresis.torque": 4.5})
    renamed = replace(model, name="gear_box")
    files = [
        read_archive(fmu),
        *(read_archive(export_fmu(m, tmp_path / "other.fmu", backend="python")) for m in (hysteresis, renamed)),
    ]
    assert len({file.guid for file in files}) == 3
    assert [file.model_identifier for file in files] == ["drive_1", "drive_1", "gear_box"]
    assert len({name for file in files for name in file.members if name.endswith(".py")}) == 3  # names of the modules
    assert all(file.model_identifier.isidentifier() for file in files)


@pytest.mark.parametrize("name", ["drive 1 / über", "29", "class", "x" * 300])
def test_any_name_becomes_an_identifier(model, name, tmp_path):
    file = read_archive(export_fmu(replace(model, name=name), tmp_path / "named.fmu", backend="python"))
    assert file.model_identifier.isascii()
    assert file.model_identifier.isidentifier()
    assert len(file.model_identifier) < 64
    assert validate_fmu(str(file.path)) == []


def test_description_says_when_steps_must_be_short_and_speeds_connected(description):
    """Alone a step may have any length, but not around masses; model exchange takes the path from the speeds."""
    assert "coupled with masses it must be short" in description.get("description")
    inputs = {v.get("name"): v.get("description") for v in description.iter("ScalarVariable")}
    for name in ("crank", "output"):
        assert "in model exchange by all friction and wear" in inputs[f"{name}.w"]


def test_description_declares_the_capabilities(description):
    simulation = description.find("CoSimulation")
    assert simulation is not None
    expected = {
        "needsExecutionTool": "true",
        "canGetAndSetFMUstate": "true",
        "canSerializeFMUstate": "true",
        "canHandleVariableCommunicationStepSize": "true",
        "canBeInstantiatedOnlyOncePerProcess": "false",
    }
    assert {key: simulation.get(key) for key in expected} == expected
    assert description.get("fmiVersion") == "2.0"
    assert re.fullmatch(r"\{[0-9a-f-]{36}\}", description.get("guid", ""))
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\dZ", description.get("generationDateAndTime", ""))
    assert "held constant over a communication step" in description.get("description", "")
    assert description.get("license") == "BSD-3-Clause"
    assert "reefmu" in description.get("generationTool", "")
    experiment = description.find("DefaultExperiment")
    assert experiment is not None
    assert float(experiment.get("stepSize", "0")) > 0


@pytest.mark.parametrize("masses", [None, Masses(1e-4, 1.0)], ids=["drive", "joint"])
@pytest.mark.parametrize(
    ("name", "begins"),
    [
        ("printed_cycloidal", "Cycloidal drive printed_cycloidal"),
        ("CHA-40A-50", "Catalogue gear CHA-40A-50"),
        ("workshop", "Rolling element eccentric drive workshop"),
    ],
)
def test_the_description_states_the_kind_of_the_drive(lookup, tmp_path, name, begins, masses):
    """The tables of another drive, since the description depends on the drawing alone."""
    drive = load_drive(name)
    table = None if name == "CHA-40A-50" else replace(lookup, drawing=drive_to_dict(drive))
    model = build_model(drive, inherent=False, lookup=table)
    path = export_fmu(model, tmp_path / "a.fmu", backend="python", masses=masses)
    assert _description(path).startswith(begins)


def _description(path):
    with zipfile.ZipFile(path) as archive:
        return ElementTree.fromstring(archive.read("modelDescription.xml")).get("description")


def test_the_description_of_a_curve_claims_no_kind(tmp_path):
    model = build_curve_model(curve_lookup([0.0, 1e-3], [0.0, 50.0], 0.01, "spring", 50))
    path = export_fmu(model, tmp_path / "a.fmu", backend="python")
    assert _description(path).startswith("Gear spring: torque and stiffness over twist.")


def test_every_variable_has_a_defined_unit(description):
    units = {unit.get("name"): unit.find("BaseUnit") for unit in description.iter("Unit")}
    types = {simple.get("name"): simple.find("Real") for simple in description.iter("SimpleType")}
    for variable in description.iter("ScalarVariable"):
        real = variable.find("Real")
        assert real is not None
        assert units[real.get("unit")] is not None
        assert variable.get("description")
        if real.get("declaredType"):
            assert types[real.get("declaredType")].get("unit") == real.get("unit")
    stiffness = units["N.m/rad"]
    assert {key: stiffness.get(key) for key in ("kg", "m", "s", "rad")} == {"kg": "1", "m": "2", "s": "-2", "rad": "-1"}


def test_parameters_are_tunable_within_bounds(description, model):
    variables = {v.get("name"): v for v in description.iter("ScalarVariable")}
    for parameter in model.parameters:
        expected = "tunable" if parameter.tunable else "fixed"
        assert variables[parameter.name].get("variability") == expected
    band = variables["band"].find("Real")
    assert (float(band.get("min")), float(band.get("max"))) == (-1.0, 1.0)
    assert variables["hysteresis.torque"].get("variability") == "tunable"


def test_all_states_are_variables(description, model):
    local = {v.get("name") for v in description.iter("ScalarVariable") if v.get("causality") == "local"}
    assert local == {state.name for state in drive_component(model).states}


def test_structure_lists_outputs_and_initial_unknowns_with_dependencies(description):
    variables = [v.get("name") for v in description.iter("ScalarVariable")]
    outputs = {v.get("name") for v in description.iter("ScalarVariable") if v.get("causality") == "output"}
    for tag in ("Outputs", "InitialUnknowns"):
        unknowns = description.findall(f"ModelStructure/{tag}/Unknown")
        named = {variables[int(u.get("index", "")) - 1]: u for u in unknowns}
        assert set(named) == outputs
        depends = [variables[int(i) - 1] for i in named["output.tau"].get("dependencies", "").split()]
        assert {"crank.phi", "output.phi"} <= set(depends)


def test_the_date_follows_source_date_epoch(model, tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1700000000")
    path = export_fmu(model, tmp_path / "dated.fmu", backend="python")
    with zipfile.ZipFile(path) as archive:
        assert b'generationDateAndTime="2023-11-14T22:13:20Z"' in archive.read("modelDescription.xml")
        assert {info.date_time for info in archive.infolist()} == {(2023, 11, 14, 22, 13, 20)}
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "yesterday")
    with pytest.raises(InputError, match="SOURCE_DATE_EPOCH"):
        export_fmu(model, tmp_path / "dated.fmu", backend="python")


def test_the_file_contains_nothing_of_this_machine(fmu):
    here = os.path.expanduser("~").encode()
    with zipfile.ZipFile(fmu) as archive:
        names = archive.namelist()
        assert not [name for name in names if "pycache" in name or name.startswith("/")]
        for name in names:
            if not name.startswith("binaries/"):
                assert here not in archive.read(name)
    assert "documentation/index.html" in names
    assert {"binaries/linux64", "binaries/win64"} <= {name.rsplit("/", 1)[0] for name in names}


def test_a_path_that_cannot_be_written_leaves_nothing(model, tmp_path):
    with pytest.raises(InputError, match="no_folder"):
        export_fmu(model, tmp_path / "no_folder" / "x.fmu", backend="python")
    (tmp_path / "folder.fmu").mkdir()
    with pytest.raises(InputError, match=r"folder\.fmu"):
        export_fmu(model, tmp_path / "folder.fmu", backend="python")
    assert sorted(p.name for p in tmp_path.rglob("*")) == ["folder.fmu"]


def test_a_failure_keeps_the_existing_file(model, tmp_path, monkeypatch):
    path = tmp_path / "kept.fmu"
    path.write_bytes(b"before")

    def full_disk(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(zipfile.ZipFile, "writestr", full_disk)
    with pytest.raises(InputError, match="No space left"):
        export_fmu(model, path, backend="python")
    assert [p.name for p in tmp_path.iterdir()] == ["kept.fmu"]
    assert path.read_bytes() == b"before"
