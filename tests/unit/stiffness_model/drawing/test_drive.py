"""Drawings: reading, writing and faults."""

from __future__ import annotations

import dataclasses
import importlib.resources
import math
import warnings

import pytest

import stiffness_model as sm

DRAWING = (importlib.resources.files("stiffness_model") / "presets" / "drive_1.toml").read_text("utf-8")
OWN = '[material.POM]\nyoungs_modulus = "2.8 GPa"\npoisson_ratio = 0.35\n'


def edited(tmp_path, *changes: tuple[str, str]):
    """A file with drive_1's drawing, texts replaced."""
    text = DRAWING
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    file = tmp_path / "mine.toml"
    file.write_text(text, "utf-8")
    return file


@pytest.mark.parametrize("name", ["drive_1", "drive_2", "drive_3"])
def test_presets_are_table_i(name):
    drive = sm.load_drive(name)
    assert drive.name == name
    assert (drive.crank_radius, drive.element_radius, drive.eccentricity) == (41e-3, 7e-3, 0.7e-3)
    assert (drive.transmission_ratio, drive.elements, drive.eccentrics, drive.lobes) == (29, 87, 3, 30)
    plastic = {"cage", "gear"} if name == "drive_3" else set()
    for part, material in drive.materials.items():
        expected = (3e9, 0.33) if part in plastic else (208e9, 0.30)
        assert (material.youngs_modulus, material.poisson_ratio) == expected


def test_ratio_is_signed():
    assert sm.load_drive("drive_1").ratio == -29
    assert sm.load_drive("drive_1").orientation == -1
    assert sm.load_drive("drive_1", lobes=28).ratio == 29
    assert sm.load_drive("drive_1", lobes=28).orientation == 1


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"lobes": 28, "crank_deviation": "eccentric"},
        {"element": "roller", "element_length": "12.5 mm", "crank_radius": "40.123456789 mm"},
        {"cage_offset": "-3.3 um", "gear_tolerance": "17 um", "max_twist": "0.3 deg"},
        {"gear_material": sm.Material("POM", 2.8e9, 0.35, 1410.0)},
    ],
)
@pytest.mark.parametrize("name", ["drive_1", "drive_3"])
def test_round_trip_through_toml(tmp_path, name, changes):
    drive = sm.load_drive(name, **changes)
    file = tmp_path / "again.toml"
    sm.save_drive(drive, file)
    assert sm.load_drive(file) == drive
    assert sm.drive_from_dict(sm.drive_to_dict(drive)) == drive


def test_overrides_are_texts_or_si_numbers():
    assert sm.load_drive("drive_1", crank_radius="42 mm") == sm.load_drive("drive_1", crank_radius=0.042)
    assert sm.load_drive("drive_1", cage_tolerance="IT6").tolerances["cage"].window == pytest.approx(11e-6)
    # The grade is that of the overridden size.
    assert sm.load_drive("drive_1", element_radius="10 mm").tolerances["cage"].window == pytest.approx(6e-6)


def test_own_material(tmp_path):
    drive = sm.load_drive(
        edited(tmp_path, ("[materials]", OWN + "[materials]"), ('gear_material = "100Cr6"', 'gear_material = "POM"'))
    )
    assert drive.materials["gear"].youngs_modulus == pytest.approx(2.8e9)
    assert drive.materials["cage"].name == "100Cr6"


def test_elements_that_do_not_fit_cause_a_warning_with_the_number_that_does():
    for per_row in (29, 21, 15):
        said = rf"{per_row} elements do not fit on the 29 seats .* 10.38 mm apart .* -3.62 mm of wall.*14 elements fit"
        with pytest.warns(sm.DoesNotFitWarning, match=said):
            sm.load_drive("drive_1", elements=3 * per_row)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sm.load_drive("drive_1", elements=3 * 14)
        sm.load_drive("drive_1", element_radius="4.5 mm")
    with pytest.warns(sm.DoesNotFitWarning, match="40 elements do not fit on the 29 seats"):
        sm.load_drive("drive_1", elements=3 * 40)


def test_a_drive_is_immutable():
    drive = sm.load_drive("drive_1")
    with pytest.raises(dataclasses.FrozenInstanceError):
        drive.lobes = 28  # type: ignore[misc]


BAD = {
    # old text, new text, parts of the message besides the file: field, expectation, value
    "unknown field": ("lobes = 30", "lobe = 30", ["[geometry]", "'lobe'", "did you mean 'lobes'"]),
    "unknown section": ("[geometry]", "[geometri]", ["'geometri'", "did you mean 'geometry'"]),
    "field in the wrong section": ("[geometry]", "x = 1\n[geometry]", ["'x'", "expected one of", "geometry"]),
    "no unit": ('"41 mm"', '"41"', ["crank_radius", "with its unit", "'41'"]),
    "bare number": ('"41 mm"', "41", ["crank_radius", "with its unit", "got 41"]),
    "bare angle": ('"8 arcmin"', "8", ["max_twist", "with its unit", "got 8"]),
    "bare tolerance": ('"IT4"', "5", ["cage_tolerance", "with its unit", "got 5"]),
    "bare offset": ('"3 sigma"', "5", ["cage_offset", "with its unit", "got 5"]),
    "bare modulus": (
        "[materials]",
        OWN.replace('"2.8 GPa"', "2.8e9") + "[materials]",
        ["material.POM", "youngs_modulus", "with its unit", "2800000000"],
    ),
    "unknown unit": ('"41 mm"', '"41 mmm"', ["crank_radius", "'mmm'", "did you mean 'mm'"]),
    "unit of something else": ('"41 mm"', '"41 GPa"', ["crank_radius", "unit of length", "'GPa'"]),
    "negative": ('"41 mm"', '"-41 mm"', ["crank_radius", "positive", "-0.041"]),
    "zero": ('"0.7 mm"', '"0 mm"', ["eccentricity", "positive", "0.0"]),
    "not a number": ('"41 mm"', "nan", ["crank_radius", "expected", "nan"]),
    "text that is not a number": ('"41 mm"', '"nan mm"', ["crank_radius", "expected", "'nan mm'"]),
    "infinite": ('"41 mm"', '"1e999 mm"', ["crank_radius", "positive", "inf"]),
    "a list": ('"41 mm"', '["41 mm"]', ["crank_radius", "expected a length", "['41 mm']"]),
    "element larger than its path": ('"7 mm"', '"60 mm"', ["element_radius", "smaller than its path", "60 mm"]),
    "eccentricity beyond the centre": ('"0.7 mm"', '"50 mm"', ["eccentricity", "below crank_radius", "0.05"]),
    "a ratio without lobe count": ("lobes = 30", "lobes = 31", ["lobes", "28", "30", "31"]),
    "a ratio that is not whole": ("transmission_ratio = 29", "transmission_ratio = 29.5", ["lobes", "28.5", "got 30"]),
    "a negative ratio": ("transmission_ratio = 29", "transmission_ratio = -29", ["transmission_ratio", "-29"]),
    "a ratio that is not a number": (
        "transmission_ratio = 29",
        "transmission_ratio = nan",
        ["transmission_ratio", "nan"],
    ),
    "a text for a count": ("lobes = 30", 'lobes = "30"', ["lobes", "whole number", "'30'"]),
    "a truth value for a count": ("elements = 87", "elements = true", ["elements", "whole number", "True"]),
    "no elements": ("elements = 87", "elements = 0", ["elements", "at least 1", "0"]),
    "elements that do not divide": ("elements = 87", "elements = 86", ["elements", "multiple of the 3", "86"]),
    "no such element": ('"ball"', '"needle"', ["element", "unknown choice 'needle'", "ball, roller"]),
    "a roller without length": ('"ball"', '"roller"', ["element_length", "positive", "0.0"]),
    "no such material": (
        'cage_material = "100Cr6"',
        'cage_material = "100Cr7"',
        ["cage_material", "did you mean '100Cr6'"],
    ),
    "a number for a material": (
        'cage_material = "100Cr6"',
        "cage_material = 3",
        ["cage_material", "material's name", "3"],
    ),
    "a material that is no table": ("[materials]", "[material]\nPOM = 3\n[materials]", ["material.POM", "table", "3"]),
    "a material without a ratio": (
        "[materials]",
        OWN.replace("poisson_ratio = 0.35\n", "") + "[materials]",
        ["material.POM", "'poisson_ratio'", "none"],
    ),
    "an impossible material": (
        "[materials]",
        OWN.replace("0.35", "0.7") + "[materials]",
        ["POM", "Poisson's ratio between -1 and 0.5", "0.7"],
    ),
    "no such grade": ('"IT4"', '"IT44"', ["cage_tolerance", "IT1 to IT16", "IT44"]),
    "a negative tolerance": ('"IT4"', '"-5 um"', ["cage_tolerance", "not negative", "e-06"]),
    "an offset in words": ('"3 sigma"', '"three sigma"', ["cage_offset", "'3 sigma'", "'three sigma'"]),
    "no such deviation": (
        'crank_deviation = "element"',
        'crank_deviation = "drive"',
        ["crank_deviation", "unknown choice 'drive'", "eccentric, element"],
    ),
    "a field missing": ('eccentricity = "0.7 mm"', "", ["'eccentricity'", "none"]),
    "a number for a name": ('name = "drive_1"', "name = 3", ["name", "text", "3"]),
    "a section that is no table": ("[operation]\n", "[[operation]]\n", ["operation", "table"]),
    "not TOML": ("[geometry]", "[geometry", ["expected a TOML drawing", "line"]),
}


@pytest.mark.parametrize("case", BAD)
def test_faults_of_a_drawing_are_reported_with_file_field_and_expectation(tmp_path, case):
    old, new, parts = BAD[case]
    file = edited(tmp_path, (old, new))
    with pytest.raises(sm.InputError) as error:
        sm.load_drive(file)
    message = str(error.value)
    assert all(part in message for part in [str(file), *parts]), message
    assert "\n" not in message


@pytest.mark.parametrize(
    ("fields", "parts"),
    [
        ({"lobs": 28}, ["drive_1", "'lobs'", "did you mean 'lobes'"]),
        ({"crank_radius": math.nan}, ["drive_1", "crank_radius", "nan"]),
        ({"crank_radius": -0.04}, ["drive_1", "crank_radius", "positive", "-0.04"]),
        ({"lobes": 31}, ["drive_1", "lobes", "31"]),
        ({"cage_offset": math.inf}, ["drive_1", "cage_offset", "inf"]),
        ({"max_twist": 0.0}, ["drive_1", "max_twist", "positive"]),
    ],
)
def test_bad_overrides(fields, parts):
    with pytest.raises(sm.InputError) as error:
        sm.load_drive("drive_1", **fields)
    assert all(part in str(error.value) for part in parts), str(error.value)


@pytest.mark.parametrize(
    ("source", "parts"),
    [
        ("drive_4", ["'drive_4'", "did you mean"]),
        ("nowhere/mine.toml", ["mine.toml", "expected a TOML drawing", "no such file"]),
    ],
)
def test_no_such_drawing(source, parts):
    with pytest.raises(sm.InputError) as error:
        sm.load_drive(source)
    assert all(part in str(error.value) for part in parts), str(error.value)


def test_a_file_that_is_no_text(tmp_path):
    file = tmp_path / "picture.toml"
    file.write_bytes(b"\x89PNG\r\n\xff\xfe\xd0")
    with pytest.raises(sm.InputError, match=r"picture\.toml: expected a readable TOML drawing"):
        sm.load_drive(file)


@pytest.mark.parametrize("changes", [{}, {"element_offset": "4 um", "element_tolerance": "20 um"}])
def test_bores_without_an_offset_clear_their_elements(changes):
    """Without a cage_offset the clearance is three of its standard deviations; at 0 half of the elements interfere."""
    table = sm.drive_to_dict(sm.load_drive("drive_1", **changes))
    del table["tolerances"]["cage_offset"]
    drive = sm.drive_from_dict(table)
    clearance, sigma = (
        drive.tolerances["cage"].offset - drive.tolerances["element"].offset,
        math.hypot(drive.tolerances["cage"].sigma, drive.tolerances["element"].sigma),
    )
    assert clearance == pytest.approx(3 * sigma, rel=1e-12)
    population = sm.simulate(drive, [0.0], 200)
    # 0.135 % of 17 400 elements are 23.5 with a standard deviation of 4.8.
    assert population.interference_count < 23.5 + 4 * 4.8
    assert sm.simulate(sm.load_drive("drive_1", cage_offset=0.0), [0.0], 200).interference_count == pytest.approx(
        8700, abs=300
    )
