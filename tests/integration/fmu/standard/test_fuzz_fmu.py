"""Damaged and hostile FMUs, and values that no drive can have: an error of one line, before memory is allocated."""

from __future__ import annotations

import io
import json
import re
import tracemalloc
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from reefmu.cli import main
from reefmu.fmu.validation.fmu_check import check_fmu
from reefmu.fmu.xml.archive import parse_xml, read_archive
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import DAMPINGS, INERTIAS, STEPS, Masses
from reefmu.model.model_file import load_model
from stiffness_model.drawing.drive import Drive
from stiffness_model.errors import InputError
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.lookup.element_table import ElementTable
from tests.fuzz.fuzz_fmu import complaint, examine, findings, make_bases

Members = Mapping[str, bytes]


@pytest.fixture(scope="module")
def bases(drive: Drive, lookup: Lookup, tmp_path_factory: pytest.TempPathFactory) -> dict[str, dict[str, bytes]]:
    """FMUs of a model with both tables and a modulus, of both back ends, and of a joint."""
    model = build_model(drive, {"hysteresis": {"torque": 2.0}, "missing_ball": {}, "modulus_error": {}}, lookup=lookup)
    return make_bases(model, tmp_path_factory.mktemp("bases"))


def written(members: Members, folder: Path, **changed: bytes) -> Path:
    """An FMU with changed members; a keyword names a member by its file name with '_' for the dot."""
    path = folder / "changed.fmu"
    names = {name.rpartition("/")[2].replace(".", "_"): name for name in members}
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in {**members, **{names[key]: value for key, value in changed.items()}}.items():
            archive.writestr(name, content)
    return path


def refused(path: Path) -> str:
    assert complaint(path) == ""
    with pytest.raises(InputError) as error:
        examine(path)
    return str(error.value)


@pytest.mark.slow
def test_eighty_damaged_fmus(bases: dict[str, dict[str, bytes]], tmp_path: Path) -> None:
    assert findings(bases, 7, 80, tmp_path) == []


@pytest.mark.parametrize(
    "content",
    [
        b"<a>" * 20000,
        b"<a>" * 20000 + b"</a>" * 20000,
        b"<?xml version='1.0' encoding='klingon'?><a/>",
        b"<?xml version='1.0' encoding='rot13'?><a/>",
        b"<?xml version='1.0' encoding='utf-7'?><a/>",
        b"",
        b"<a>",
        b"\xff\xfe",
    ],
)
def test_invalid_xml_gives_one_line(content: bytes, bases: dict[str, dict[str, bytes]], tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"^here: expected XML in a\.xml"):
        parse_xml(content, "a.xml", "here")
    assert "expected XML in modelDescription.xml" in refused(
        written(bases["python"], tmp_path, modelDescription_xml=content)
    )


def test_xml_with_too_deep_elements_below_a_valid_root(bases: dict[str, dict[str, bytes]], tmp_path: Path) -> None:
    """The parser of the standard library accepts it, FMPy's parser does not: its limit is 256 elements."""
    content = bases["native"]["modelDescription.xml"]
    nested = b"<Tool name='x'>" + b"<a>" * 20000 + b"</a>" * 20000 + b"</Tool>"
    deep = content.replace(b"<VendorAnnotations>", b"<VendorAnnotations>" + nested)
    assert "elements within each other" in refused(written(bases["native"], tmp_path, modelDescription_xml=deep))


def test_toml_and_json_nested_too_deep(bases: dict[str, dict[str, bytes]], tmp_path: Path) -> None:
    for base, name in (("python", "model_toml"), ("joint", "joint_toml"), ("native", "model_toml")):
        assert "too deep" in refused(written(bases[base], tmp_path, **{name: b"a = " + b"[" * 50000}))
    assert "too deep" in refused(written(bases["native"], tmp_path, lookup_json=b"[" * 100000))
    (tmp_path / "model.toml").write_bytes(b"a = " + b"[" * 50000)
    with pytest.raises(InputError, match="nested too deep"):
        load_model(tmp_path / "model.toml")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda head: [1], "expected an object in JSON"),
        (lambda head: {k: v for k, v in head.items() if k != "twist"}, "expected a key 'twist'"),
        (lambda head: head | {"twist": ["a", "b", "c"]}, "twist: expected a whole number of cells"),
        (lambda head: head | {"twist": [0.0, 1e-3, 10**12]}, "1 to 10000"),
        (lambda head: head | {"full_torque": "280"}, "expected a full torque above zero"),
        (lambda head: head | {"full_torque": 0.0}, "expected a full torque above zero"),
        (lambda head: head | {"full_torque": float("nan")}, "expected a full torque above zero"),
        (lambda head: head | {"error": {}}, "error: expected a key 'torque_mean'"),
        (lambda head: head | {"modulus": [1, 2]}, "modulus: expected an object"),
        (lambda head: head | {"element": {"axes": 3}}, "expected encoded tables"),
        (lambda head: head | {"drawing": None}, "drawing: expected an object"),
    ],
)
def test_invalid_metadata_are_refused(change, words: str, bases: dict[str, dict[str, bytes]], tmp_path: Path) -> None:
    head = json.loads(bases["native"]["resources/lookup.json"])
    assert words in refused(written(bases["native"], tmp_path, lookup_json=json.dumps(change(head)).encode()))
    content = io.BytesIO()
    with np.load(io.BytesIO(bases["python"]["resources/lookup.npz"])) as data:
        tables = {name: data[name] for name in data.files if name != "head"}
        stored = change(json.loads(str(data["head"])))
    np.savez(content, head=np.array(json.dumps(stored)), **tables)
    refused(written(bases["python"], tmp_path, lookup_npz=content.getvalue()))


@pytest.mark.parametrize("stated", ["LOOKUP_ROWS", "LOOKUP_COLUMNS", "LOOKUP_PLANES", "ELEMENT_LAYERS"])
def test_tables_with_a_false_size_allocate_no_memory(
    stated: str, bases: dict[str, dict[str, bytes]], tmp_path: Path
) -> None:
    """100 000 000 rows would have been 138 GiB."""
    header = re.sub(
        rf"#define {stated} .*".encode(), f"#define {stated} 100000000".encode(), bases["native"]["sources/tables.h"]
    )
    path = written(bases["native"], tmp_path, tables_h=header)
    tracemalloc.start()
    try:
        assert "expected encoded tables" in refused(path)
        assert tracemalloc.get_traced_memory()[1] < 100e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    "change",
    [
        lambda a: a.astype(complex),
        lambda a: a.astype(str),
        lambda a: a.astype(np.float32),
        lambda a: a[0],
        lambda a: a[..., :-1],
        lambda a: a * np.nan,
        lambda a: a * 1e300,
        lambda a: a.astype(object),
    ],
)
def test_invalid_arrays_are_refused(change, lookup: Lookup, tmp_path: Path) -> None:
    lookup.save(tmp_path / "lookup.npz")
    with np.load(tmp_path / "lookup.npz") as data:
        head = data["head"]
    with np.errstate(invalid="ignore"):
        np.savez(tmp_path / "other.npz", head=head, coefficients=change(lookup.coefficients))
    with pytest.raises(InputError) as error:
        Lookup.load(tmp_path / "other.npz")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("load", [Lookup.load, ElementTable.load])
def test_a_false_shape_allocates_no_memory(load, lookup: Lookup, tmp_path: Path) -> None:
    """5e11 doubles would have been 3.64 TiB."""
    lookup.save(tmp_path / "lookup.npz")
    with zipfile.ZipFile(tmp_path / "lookup.npz") as source, zipfile.ZipFile(tmp_path / "lied.npz", "w") as lied:
        for name in source.namelist():
            lied.writestr(name, re.sub(rb"\(5, \d+, \d+\)", b"(500000000000,)", source.read(name)))
    with pytest.raises(InputError, match=r"bytes for an array \(500000000000,\)"):
        load(tmp_path / "lied.npz")


@pytest.mark.slow
@pytest.mark.parametrize("name", ["modelDescription_xml", "model_toml", "lookup_npz"])
def test_a_member_of_400_mb_is_refused_unread(name: str, bases: dict[str, dict[str, bytes]], tmp_path: Path) -> None:
    size = 400 << 20
    path = written(bases["python"], tmp_path, **{name: b" " * size})
    tracemalloc.start()
    try:
        with pytest.raises(InputError, match="bytes unpacked"):
            check_fmu(path)
        assert tracemalloc.get_traced_memory()[1] < 50e6
    finally:
        tracemalloc.stop()


def test_another_guid_in_the_description_of_a_python_fmu_is_found(fmu: Path, tmp_path: Path) -> None:
    guid = read_archive(fmu).guid
    with zipfile.ZipFile(fmu) as source, zipfile.ZipFile(tmp_path / "other.fmu", "w") as copy:
        for name in source.namelist():
            content = source.read(name)
            copy.writestr(
                name,
                content.replace(guid.encode(), b"{00000000-0000-5000-8000-000000000000}")
                if name == "modelDescription.xml"
                else content,
            )
    report = check_fmu(tmp_path / "other.fmu")
    assert not report["declaration"].passed
    assert "guid" in report["declaration"].detail


@pytest.mark.parametrize(
    "words",
    [
        ["--step", "0"],
        ["--step", "1e-300"],
        ["--step", "nan"],
        ["--step", "1e300"],
        ["--motor-inertia", "1e-300"],
        ["--load-inertia", "1e308"],
        ["--motor-inertia", "1e-300", "--kind", "joint"],
        ["--load-damping", "1e300"],
    ],
)
def test_export_refuses_values_that_no_drive_can_have(
    words: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["export", "drive_1", "-o", str(tmp_path / "d.fmu"), "--drives", "8", *words]) == 2
    assert "within" in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    "words",
    [
        ["--inertia", "0.08", "--step", "1e300"],
        ["--inertia", "0.08", "--step", "1e-300"],
        ["--inertia", "1e-300"],
        ["--inertia", "1e308", "--step", "1e-3"],
    ],
)
def test_check_refuses_the_same(words: list[str], fmu: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", str(fmu), *words]) == 2
    out, err = capsys.readouterr()
    assert (out, len(err.splitlines())) == ("", 1)
    assert "within" in err


def test_a_joint_declares_the_bounds_that_python_enforces(model: DriveModel) -> None:
    from reefmu.fmu.model.joint_component import joint_component

    parameters = {p.name: p for p in joint_component(model, Masses(1e-4, 1.0)).parameters}
    for name in ("motor", "load"):
        assert (parameters[f"{name}.inertia"].minimum, parameters[f"{name}.inertia"].maximum) == INERTIAS
        assert (parameters[f"{name}.damping"].minimum, parameters[f"{name}.damping"].maximum) == DAMPINGS
    assert STEPS[0] < 1e-6 < 1.0 < STEPS[1]
    for bad in (INERTIAS[0] / 2, INERTIAS[1] * 2):
        with pytest.raises(InputError, match="load_inertia: expected a positive inertia within"):
            Masses(1e-4, bad)


@pytest.mark.parametrize("epoch", ["abc", "1e9", "1e26", "-5", " 5", "4354819199", "9" * 5000])
def test_an_invalid_date_is_an_error_of_one_line(
    epoch: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """For every command, because libraries read the variable too."""
    monkeypatch.setenv("SOURCE_DATE_EPOCH", epoch)
    for words in (["export", "drive_1", "-o", str(tmp_path / "d.fmu")], ["curve", "drive_1", "--out", str(tmp_path)]):
        assert main(words) == 2
        err = capsys.readouterr().err
        assert err.startswith("reefmu: SOURCE_DATE_EPOCH: expected seconds since 1970, a whole number up to 4354819198")
        assert len(err.splitlines()) == 1
    assert not list(tmp_path.iterdir())
