"""Tolerance windows of the standards, and the texts of drawings that state them."""

from __future__ import annotations

import itertools

import pytest
from hypothesis import given
from hypothesis import strategies as st

import stiffness_model as sm
from stiffness_model.drawing.tolerances import Tolerance, iso_286, iso_492_normal, iso_3290, read_offset, read_window

UM = 1e-6

TABLE_II = [
    # drive, part, window of the diameter, standard deviation of the radius: um
    *((f"drive_{n}", "crank", 13, 1.08) for n in (1, 2, 3)),
    *((f"drive_{n}", "element", 0.5, 0.042) for n in (1, 2, 3)),
    ("drive_1", "gear", 15, 1.25),
    ("drive_1", "cage", 5, 0.42),
    ("drive_2", "gear", 87, 7.25),
    ("drive_2", "cage", 11, 0.92),
    ("drive_3", "gear", 220, 18.33),
    ("drive_3", "cage", 270, 22.5),
]


@pytest.mark.parametrize(("drive", "part", "window", "sigma"), TABLE_II)
def test_table_ii(drive, part, window, sigma):
    tolerance = sm.load_drive(drive).tolerances[part]
    assert tolerance.window == pytest.approx(window * UM, rel=1e-12)
    # The table rounds to two decimals, that of the ball to three.
    assert tolerance.sigma == pytest.approx(sigma * UM, abs=0.005 * UM if sigma > 0.1 else 0.0005 * UM)


@pytest.mark.parametrize("drive", ["drive_1", "drive_2", "drive_3"])
def test_mean_offsets_of_section_iv(drive):
    tolerances = sm.load_drive(drive).tolerances
    assert tolerances["cage"].offset == pytest.approx(3 * tolerances["cage"].sigma, rel=1e-12)
    assert [tolerances[part].offset for part in ("element", "crank", "gear")] == [0, 0, 0]


@pytest.mark.parametrize(
    ("grade", "size_mm", "window"),
    [
        # A size belongs to the step that ends with it: above 10 up to and including 18, and so on.
        (5, 10, 6),
        (5, 10.001, 8),
        (5, 18, 8),
        (5, 18.001, 9),
        (11, 80, 190),
        (11, 80.001, 220),
        (11, 120, 220),
        (11, 120.001, 250),
        (1, 0.5, 0.8),
        (1, 3, 0.8),
        (6, 3.001, 8),
        (7, 500, 63),
        (16, 500, 4000),
        (4, 14, 5),
        (13, 14, 270),
        (9, 96, 87),
    ],
)
def test_iso_286(grade, size_mm, window):
    assert iso_286(grade, size_mm * 1e-3) == pytest.approx(window * UM, rel=1e-12)


def test_iso_286_windows_are_multiples_of_the_tolerance_unit():
    """ISO 286-1, annex: IT8 is 25 i and IT13 250 i, i = 0.45 D^(1/3) + 0.001 D in um, with D the geometric mean of the
    step's sizes in mm, rounded; the rounded values of IT8 are also compared with the printed ones."""
    ends = (1, 3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
    printed = (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97)
    for (low, high), window in zip(itertools.pairwise(ends), printed, strict=True):
        mean = (low * high) ** 0.5
        unit = 0.45 * mean ** (1 / 3) + 0.001 * mean
        assert iso_286(8, high * 1e-3) == pytest.approx(window * UM, rel=1e-12)
        assert iso_286(8, high * 1e-3) == pytest.approx(25 * unit * UM, rel=0.035)
        assert iso_286(13, high * 1e-3) == pytest.approx(250 * unit * UM, rel=0.035)


def test_iso_286_grows_with_grade_and_size():
    sizes = [2e-3, 5e-3, 8e-3, 14e-3, 25e-3, 40e-3, 65e-3, 0.1, 0.15, 0.2, 0.28, 0.35, 0.45]
    rows = [[iso_286(grade, size) for size in sizes] for grade in range(1, 17)]
    for finer, coarser in itertools.pairwise(rows):
        assert all(a < b for a, b in zip(finer, coarser, strict=True))
    assert all(row == sorted(row) for row in rows)


@pytest.mark.parametrize(
    ("size_mm", "window"),
    [
        (18, 8),
        (18.01, 9),
        (30, 9),
        (50, 11),
        (80, 13),
        (80.01, 15),
        (82, 15),
        (120, 15),
        (120.01, 18),
        (500, 45),
    ],
)
def test_iso_492(size_mm, window):
    assert iso_492_normal(size_mm * 1e-3) == pytest.approx(window * UM, rel=1e-12)


@pytest.mark.parametrize(
    ("grade", "window"),
    [
        (3, 0.13),
        (5, 0.25),
        (10, 0.5),
        (16, 0.8),
        (20, 1.0),
        (24, 1.2),
        (28, 1.4),
        (40, 2.0),
        (60, 3.0),
        (100, 5),
        (200, 10),
    ],
)
def test_iso_3290(grade, window):
    assert iso_3290(grade) == pytest.approx(window * UM, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "size_mm", "window"),
    [
        ("13 um", 82, 13),
        ("0.013 mm", 82, 13),
        ("IT5", 96, 15),
        ("IT 5", 96, 15),
        ("ISO 286 IT5", 96, 15),
        ("ISO 492 Normal", 82, 15),
        ("ISO 492", 82, 15),
        ("ISO 3290 G10", 14, 0.5),
        ("G10", 14, 0.5),
        (2e-6, 14, 2),
        ("0 um", 14, 0),
    ],
)
def test_reading_windows(text, size_mm, window):
    assert read_window(text, size_mm * 1e-3, "here") == pytest.approx(window * UM, rel=1e-12)


@pytest.mark.parametrize(
    ("text", "size", "parts"),
    [
        ("IT17", 0.1, ["cage_tolerance", "IT1 to IT16", "IT17"]),
        ("IT0", 0.1, ["cage_tolerance", "IT1 to IT16", "IT0"]),
        ("G11", 0.014, ["cage_tolerance", "G10", "G11"]),
        ("IT5", 0.6, ["cage_tolerance", "up to 500 mm", "600 mm"]),
        ("ISO 492", 5e-3, ["cage_tolerance", "above 6", "5 mm"]),
        ("fine", 0.1, ["cage_tolerance", "'13 um'", "'fine'"]),
        ("13", 0.1, ["cage_tolerance", "with its unit", "'13'"]),
        ("-13 um", 0.1, ["cage_tolerance", "not negative", "-1.3e-05"]),
        ("13 umm", 0.1, ["cage_tolerance", "did you mean 'um'", "'umm'"]),
        (None, 0.1, ["cage_tolerance", "None"]),
        (float("nan"), 0.1, ["cage_tolerance", "nan"]),
    ],
)
def test_bad_windows_say_what_and_where(text, size, parts):
    with pytest.raises(sm.InputError) as error:
        read_window(text, size, "cage_tolerance")
    assert all(part in str(error.value) for part in parts), str(error.value)


def test_offsets():
    assert read_offset("3 sigma", 0.4 * UM, "here") == pytest.approx(1.2 * UM)
    assert read_offset("-1.5 sigma", 0.4 * UM, "here") == pytest.approx(-0.6 * UM)
    assert read_offset("5 um", 0.4 * UM, "here") == pytest.approx(5 * UM)
    with pytest.raises(sm.InputError, match=r"cage_offset: expected .*'3 sigma'.* got 'three sigma'"):
        read_offset("three sigma", 0.4 * UM, "cage_offset")


@given(st.floats(0, 1e-3), st.floats(-1e-3, 1e-3))
def test_limits_of_a_radius_lie_at_three_sigma(window, offset):
    tolerance = Tolerance(window, offset)
    # The window is six sigma of the diameter wide, and the radius has half the sigma of the diameter.
    assert 2 * 6 * tolerance.sigma == pytest.approx(window)


@pytest.mark.parametrize(("window", "offset"), [(-1e-6, 0.0), (float("inf"), 0.0), (1e-6, float("nan"))])
def test_impossible_tolerances(window, offset):
    with pytest.raises(sm.InputError, match="expected"):
        Tolerance(window, offset)
