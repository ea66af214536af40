"""A drawing whose fields are those of another kind is answered with that kind; names are found whatever their case."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import stiffness_model as sm
from stiffness_model.errors import InputError, UnknownNameError, unknown_name
from stiffness_model.kinds import KINDS, ROLLING_ELEMENT_ECCENTRIC

NAMES = list(KINDS)


@pytest.mark.parametrize("stated", [None, *NAMES])
@pytest.mark.parametrize("name", NAMES)
def test_fields_of_another_kind_name_that_kind(name: str, stated: str | None) -> None:
    table = sm.drive_to_dict(sm.load_drive(KINDS[name].example))
    table = {key: value for key, value in table.items() if key != "kind"} | ({"kind": stated} if stated else {})
    if (stated or ROLLING_ELEMENT_ECCENTRIC) == name:
        assert sm.drive_from_dict(table) == sm.load_drive(KINDS[name].example)
        return
    with pytest.raises(InputError, match=re.escape(f'for {KINDS[name].noun} state kind = "{name}" before all tables')):
        sm.drive_from_dict(table, "mine.toml")


def test_a_curve_without_a_kind_is_a_catalogue_gear() -> None:
    """In the capitals of a sheet, and with points in place of stiffnesses."""
    for curve in ({"K1": "100 kN.m/rad"}, {"twist": ["0 rad", "1 mrad"], "torque": ["0 N.m", "9 N.m"]}):
        with pytest.raises(InputError, match='kind = "catalogue"'):
            sm.drive_from_dict({"name": "mine", "source": "sheet", "ratio": 50, **curve}, "mine.toml")


def test_a_slip_in_a_drawing_of_the_right_kind_stays_one() -> None:
    table = sm.drive_to_dict(sm.load_drive("workshop"))
    table["geometry"]["lobs"] = table["geometry"].pop("lobes")
    with pytest.raises(UnknownNameError, match="did you mean 'lobes'"):
        sm.drive_from_dict(table, "mine.toml")


def test_unknown_drives_are_answered_with_those_that_can_be_used(tmp_path: Path) -> None:
    with pytest.raises(UnknownNameError, match="did you mean 'RV-42N'"):
        sm.load_drive("rv42")
    with pytest.raises(UnknownNameError, match="expected one of") as error:
        sm.load_drive("something else")
    assert "CHA-40A-50" in str(error.value)
    for row in ("CSF-17-50", "HFUS-40-2A-50"):
        assert row not in str(error.value)


def test_all_spellings_of_a_close_name_are_proposed() -> None:
    assert str(unknown_name("unit", "KPA", ["kPa", "KPa", "rad"])).endswith("did you mean 'KPa' or 'kPa'?")
