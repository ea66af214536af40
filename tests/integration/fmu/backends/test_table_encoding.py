"""The lookup's tables as C source: decoded exactly, and refused where they are not symmetric or damaged."""

from __future__ import annotations

import json
import zipfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from reefmu.effects import EFFECTS
from reefmu.fmu.export import export_fmu
from reefmu.fmu.model.table_encoding import TABLES, decode_tables, encode_tables, lookup_metadata
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import Masses
from stiffness_model.errors import InputError
from stiffness_model.lookup.build_lookup import Lookup


@pytest.fixture(scope="module")
def full(drive: object, lookup: Lookup) -> Lookup:
    """A lookup with the additional tables of effects at the contacts."""
    return build_model(drive, {"missing_ball": {}, "modulus_error": {}}, lookup=lookup).lookup  # type: ignore[arg-type]


def test_decoding_inverts_encoding(full: Lookup) -> None:
    """To 1e-13 of full torque in every coefficient, all else unchanged; encoded again the text is the same."""
    header, head = encode_tables(full), lookup_metadata(full)
    again = decode_tables(header, head, "here")
    size = np.array([full.full_torque] * 3 + [np.abs(full.coefficients[k]).max() for k in (3, 4)])[:, None, None]
    assert (np.abs(again.coefficients - full.coefficients) <= 1e-13 * size).all()
    assert again.element is not None
    assert full.element is not None
    assert np.abs(again.element.coefficients - full.element.coefficients).max() <= 1e-13 * full.full_torque
    same = replace(again, coefficients=full.coefficients, element=full.element, drawing=dict(full.drawing))
    assert json.dumps(json.loads(lookup_metadata(same))) == json.dumps(json.loads(head))
    assert encode_tables(again) == header


def test_encoding_changes_the_torque_by_rounding_only(full: Lookup) -> None:
    again = decode_tables(encode_tables(full), lookup_metadata(full), "here")
    rng = np.random.default_rng(3)
    twist, clearance = rng.uniform(-1.2, 1.2, 500) * full.twist.stop, rng.uniform(-1.2, 1.2, 500) * full.clearance.stop
    for band in (-1.0, 0.0, 0.7):
        assert (
            np.abs(again.torque(twist, clearance, band) - full.torque(twist, clearance, band)).max()
            <= 1e-12 * full.full_torque
        )
        slope = full.stiffness(twist, clearance, band)
        assert np.abs(again.stiffness(twist, clearance, band) - slope).max() <= 1e-12 * slope.max()


def test_tables_that_are_not_odd_or_even_are_refused(lookup: Lookup) -> None:
    bent = lookup.coefficients.copy()
    bent[0, 3] += 1.0
    with pytest.raises(InputError, match="expected a lookup that is odd or even in the twist"):
        encode_tables(replace(lookup, coefficients=bent))


@pytest.mark.parametrize(
    "change",
    [
        lambda text: text.replace("LOOKUP_WORDS", "OTHER"),
        lambda text: text[:5000],
        lambda text: text.replace("LOOKUP_ROWS", "LOOKUP_LINES"),
        lambda text: text.replace("LOOKUP_COLUMNS 3", "LOOKUP_COLUMNS 9"),
        lambda text: "",
        lambda text: text.replace(",", ";", 100),
    ],
)
def test_damaged_tables_are_refused(lookup: Lookup, change) -> None:
    with pytest.raises(InputError, match=r"^here: expected") as refused:
        decode_tables(change(encode_tables(lookup)), lookup_metadata(lookup), "here")
    assert "\n" not in str(refused.value)


@pytest.mark.slow
def test_a_native_fmu_is_small_and_contains_its_tables_once(
    drive: object, lookup: Lookup, full_model: DriveModel, tmp_path: Path
) -> None:
    """What runs is below 300 kB with a binary for one platform, also of a joint with all effects; documentation, sets
    of parameters and reference results add less than 150 kB."""
    plain = build_model(drive, lookup=lookup)  # type: ignore[arg-type]
    for model in (plain, full_model):
        assert len(model.effects) in (0, len(EFFECTS))
        path = export_fmu(model, tmp_path / "joint.fmu", backend="native", masses=Masses(1e-4, 1.0))
        with zipfile.ZipFile(path) as archive:
            explaining = ("extra/", "documentation/", "model.png")
            # Each member has a header and an entry in the directory, of 76 bytes and twice its name.
            added = sum(
                i.compress_size + 76 + 2 * len(i.filename)
                for i in archive.infolist()
                if i.filename.startswith(explaining)
            )
            assert path.stat().st_size - added < 300e3
            assert added < 150e3
            names = archive.namelist()
            header = archive.read(f"sources/{TABLES}")
            numbers = header[len(header) // 2 :][:60]
            assert [name for name in names if numbers in archive.read(name)] == [f"sources/{TABLES}"]
            assert any(len(archive.read(n)) > 0.8 * len(header) / 2.6 for n in names if n.startswith("binaries/"))
            others = sum(
                i.file_size
                for i in archive.infolist()
                if not i.filename.startswith(("binaries/", "extra/", "documentation/", "modelDescription"))
                and i.filename != f"sources/{TABLES}"
            )
        assert others < 200e3
