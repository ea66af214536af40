"""model.toml: files read back to the same numbers; invalid ones are refused in one line."""

from __future__ import annotations

from pathlib import Path

import pytest

import stiffness_model as sm
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.model_file import is_model_file, load_model, model_text, save_model
from stiffness_model.lookup.build_lookup import Lookup


@pytest.fixture
def saved(lookup: Lookup, tmp_path: Path) -> Path:
    lookup.save(tmp_path / "lookup.npz")
    return tmp_path / "lookup.npz"


@pytest.fixture(scope="module")
def rich(drive: sm.Drive, lookup: Lookup) -> DriveModel:
    effects = {"backlash": {"clearance": 1 / 3e6}, "hysteresis": {"torque": 0.1 + 0.2}}
    return build_model(drive, effects, lookup=lookup).with_parameters(band=-0.3)


def test_round_trip_keeps_every_digit(rich: DriveModel, saved: Path, tmp_path: Path) -> None:
    save_model(rich, tmp_path / "model.toml")
    again = load_model(tmp_path / "model.toml", saved)
    assert again.parameters == rich.parameters
    assert again.drive == rich.drive
    assert model_text(again) == model_text(rich)
    assert is_model_file(tmp_path / "model.toml")


def test_units_of_drawings_are_accepted(rich: DriveModel, saved: Path, tmp_path: Path) -> None:
    text = model_text(rich).replace(f'"{1 / 3e6!r} m"', '"2 um"').replace('"5e-05 rad"', '"0.2 arcmin"')
    (tmp_path / "model.toml").write_text(text)
    values = {p.name: p.value for p in load_model(tmp_path / "model.toml", saved).parameters}
    assert values["backlash.clearance"] == pytest.approx(2e-6)
    assert values["hysteresis.presliding"] == pytest.approx(0.2 * sm.ARCMIN)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[effects.backlash]", "[effects.backlach]", "unknown effect 'backlach'; did you mean 'backlash'"),
        ("clearance = ", "clearence = ", "did you mean 'clearance'"),
        ('"0.30000000000000004 N.m"', '"0.3"', "expected a torque with its unit"),
        ('"0.30000000000000004 N.m"', '"-1 N.m"', "expected a value within 0"),
        ('"0.30000000000000004 N.m"', '"0.3 Nmm"', "unknown unit of torque 'Nmm'"),
        ('"0.30000000000000004 N.m"', "0.3", "expected a text with its unit"),
        ("schema = 1", "schema = 7", "expected schema = 1, got 7"),
        ("[lookup]", "[lookups]", "did you mean 'lookup'"),
        ("seed = 0", "sead = 0", "did you mean 'seed'"),
        ("band = -0.3", "band = 3", "expected a value within -1"),
        ("lobes = 30", "lobes = 31", "lobes: expected"),
        ("[model]", "[model", "expected a model in TOML"),
    ],
)
def test_invalid_files_are_refused(
    rich: DriveModel, saved: Path, tmp_path: Path, old: str, new: str, message: str
) -> None:
    text = model_text(rich)
    assert old in text
    (tmp_path / "model.toml").write_text(text.replace(old, new))
    with pytest.raises(sm.InputError) as error:
        load_model(tmp_path / "model.toml", saved)
    assert message in str(error.value)
    assert "\n" not in str(error.value).split("TOML")[0]


def test_a_drawing_is_not_a_model(tmp_path: Path, drive: sm.Drive) -> None:
    sm.save_drive(drive, tmp_path / "drive.toml")
    assert not is_model_file(tmp_path / "drive.toml")
    assert sm.load_drive(tmp_path / "drive.toml") == drive
