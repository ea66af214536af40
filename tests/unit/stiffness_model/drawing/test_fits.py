"""Tolerance zones as a workshop writes them: limit deviations printed in ISO 286, the mean drive's shift."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

import stiffness_model as sm
from stiffness_model.drawing.fits import LETTERS, lower_limit_deviation, read_zone
from stiffness_model.drawing.tolerances import iso_286

UM = 1e-6


@pytest.mark.parametrize(
    ("fit", "size_mm", "upper", "lower"),
    [
        # Printed in ISO 286-2:2010, tables 2 to 32 (limit deviations), and in every workshop's table book.
        ("H7", 14, 18, 0),
        ("h6", 82, 0, -22),
        ("H6", 7, 9, 0),
        ("h5", 10, 0, -6),
        ("H11", 500, 400, 0),
        ("g6", 50, -9, -25),
        ("G7", 14, 24, 6),
        ("f7", 80, -30, -60),
        ("F8", 40, 64, 25),
        ("e8", 120, -72, -126),
        ("E9", 20, 92, 40),
        ("d9", 60, -100, -174),
        ("D10", 10, 98, 40),
        ("js6", 25, 6.5, -6.5),
        ("JS7", 50, 12.5, -12.5),
        ("k6", 25, 15, 2),
        ("k5", 3, 4, 0),
        ("k8", 50, 39, 0),
        ("m6", 40, 25, 9),
        ("n6", 40, 33, 17),
        ("p6", 100, 59, 37),
        ("K6", 100, 4, -18),
        ("K7", 30, 6, -15),
        ("K8", 20, 10, -23),
        ("K7", 3, 0, -10),
        ("M7", 60, 0, -30),
        ("M6", 100, -6, -28),
        ("M6", 300, -9, -41),
        ("M8", 14, 2, -25),
        ("N7", 20, -7, -28),
        ("N6", 14, -9, -20),
        ("N9", 60, 0, -74),
        ("N9", 3, -4, -29),
        ("P7", 10, -9, -24),
        ("P6", 80, -26, -45),
        ("P9", 100, -37, -124),
    ],
)
def test_printed_limit_deviations(fit, size_mm, upper, lower):
    letter, grade = fit.rstrip("0123456789"), int(fit.lstrip("DEFGHJKMNPSdefghjkmnps"))
    assert lower_limit_deviation(letter, grade, size_mm * 1e-3) == pytest.approx(lower * UM, abs=1e-12)
    assert iso_286(grade, size_mm * 1e-3) == pytest.approx((upper - lower) * UM, rel=1e-12)
    zone = read_zone(f"{size_mm} {fit}", size_mm * 1e-3, letter.isupper(), "here")
    assert zone.window == pytest.approx((upper - lower) * UM, rel=1e-12)
    # The mean radius is off by half the deviation of the zone's middle.
    assert zone.offset == pytest.approx((upper + lower) / 4 * UM, abs=1e-12)


@given(st.sampled_from([name for name in LETTERS if name not in ("js",)]), st.integers(5, 8), st.floats(1e-3, 0.5))
def test_a_hole_mirrors_its_shaft(letter, grade, size):
    """ISO 286-1, 4.3.2: the limits mirror each other, except for K to P, which are shifted by less than a grade."""
    hole, shaft = lower_limit_deviation(letter.upper(), grade, size), lower_limit_deviation(letter, grade, size)
    mirrored = -shaft - iso_286(grade, size)
    if letter in "defgh":
        assert hole == pytest.approx(mirrored, abs=1e-12)
    else:
        assert mirrored - 1e-12 <= hole <= mirrored + iso_286(grade, size)


@pytest.mark.parametrize(
    ("text", "window", "offset"),
    [
        ("0/-15 um", 15, -3.75),
        ("-15/0 um", 15, -3.75),
        ("+21/0 um", 21, 5.25),
        ("+0.021 / 0 mm", 21, 5.25),
        ("+5/-5 um", 10, 0),
        ("-7/-20 um", 13, -6.75),
    ],
)
def test_limits(text, window, offset):
    for hole in (True, False):
        zone = read_zone(text, 14e-3, hole, "here")
        assert (zone.window, zone.offset) == pytest.approx((window * UM, offset * UM), abs=1e-15)


def test_a_grade_is_centred_on_the_size_and_a_bearing_ring_lies_below_it():
    for text in ("IT5", "13 um", "ISO 3290 G10", 13e-6):
        assert read_zone(text, 82e-3, False, "here").offset is None
    ring = read_zone("ISO 492 Normal", 82e-3, False, "here")
    assert (ring.window, ring.offset) == pytest.approx((15e-6, -3.75e-6))


def test_g_is_a_fit_of_a_hole_and_a_grade_of_balls():
    assert read_zone("G10", 14e-3, False, "here").window == pytest.approx(0.5e-6)
    assert read_zone("G10", 14e-3, True, "here").window == pytest.approx(70e-6)


@pytest.mark.parametrize(
    ("fields", "parts"),
    [
        ({"cage_tolerance": "14 H7", "cage_offset": "5 um"}, ["cage_offset", "none beside", "'14 H7'", "+4.5 um"]),
        ({"cage_tolerance": "16 H7"}, ["cage_tolerance", "drawn 14 mm", "'14 H7'", "'16 H7'"]),
        ({"cage_tolerance": "14 h7"}, ["cage_tolerance", "capital letter", "'14 h7'"]),
        ({"crank_tolerance": "82 H6"}, ["crank_tolerance", "small letter", "'82 H6'"]),
        ({"cage_tolerance": "14 X7"}, ["cage_tolerance", "unknown fit 'X'"]),
        ({"cage_tolerance": "14 K9"}, ["cage_tolerance", "K up to IT8"]),
        ({"cage_tolerance": "0/-15 umm"}, ["cage_tolerance", "did you mean 'um'"]),
        ({"crank_tolerance": "ISO 492 Normal", "crank_offset": "2 um"}, ["crank_offset", "-3.75 um", "'15 um'"]),
    ],
)
def test_contradictory_tolerances_are_refused(fields, parts):
    with pytest.raises(sm.InputError) as error:
        sm.load_drive("drive_1", **fields)
    assert all(part in str(error.value) for part in parts), str(error.value)
    assert "\n" not in str(error.value)


def test_the_middle_of_a_tolerance_zone_shifts_the_mean_drive():
    """A ring at 0/-15 um is a centred one of 15 um whose mean radius is 3.75 um smaller, which softens the drive."""
    one_sided = sm.load_drive("drive_1", crank_tolerance="0/-15 um")
    stated = sm.load_drive("drive_1", crank_tolerance="15 um", crank_offset="-3.75 um")
    assert one_sided.tolerances["crank"].offset == pytest.approx(stated.tolerances["crank"].offset, rel=1e-12)
    twist = [3 * sm.ARCMIN]
    centred = sm.simulate(sm.load_drive("drive_1", crank_tolerance="15 um"), twist, 16).torque.mean()
    assert sm.simulate(one_sided, twist, 16).torque.mean() < 0.8 * centred


def test_a_fit_on_the_command_line_overrides_the_offset_of_the_drawing():
    assert sm.load_drive("drive_1", cage_tolerance="14 H7").tolerances["cage"].offset == pytest.approx(4.5e-6)
