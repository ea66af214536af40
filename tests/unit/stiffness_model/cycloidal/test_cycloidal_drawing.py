"""The drawing of a cycloidal drive: what is read is what was written, and wrong values are refused in one line."""

from __future__ import annotations

from typing import Any

import pytest

from stiffness_model.cycloidal.cycloidal_drawing import read_cycloidal, write_cycloidal
from stiffness_model.errors import InputError
from tests.cycloidal_drives import TOLERANCES, cycloidal

DRIVE = cycloidal(bearing_stiffness=2e7, ring="lobes", discs=2, **TOLERANCES)


def test_written_drawing_reads_back() -> None:
    assert read_cycloidal(write_cycloidal(DRIVE)) == DRIVE
    assert read_cycloidal(write_cycloidal(cycloidal())) == cycloidal()


def test_keywords_override_fields() -> None:
    table = write_cycloidal(DRIVE)
    assert read_cycloidal(table, pins=12, profile_clearance="60 um").ratio == -11
    assert read_cycloidal(table, eccentricity=1.2e-3).eccentricity == 1.2e-3


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("pin_radius", 8e-3, "pin_radius: expected less than"),
        ("roller_radius", 9e-3, "roller_radius: expected less than"),
        ("roller_circle_radius", 25e-3, "roller_circle_radius: expected less than 23"),
        ("pins", 2, "pins: expected a whole number of at least 3, got 2"),
        ("pins", 21.5, "pins: expected a whole number of at least 3, got 21.5"),
        ("eccentricity", 2.5e-3, "eccentricity: expected less than 2.428 mm, pin_circle_radius/pins"),
        ("disc_thickness", -1e-3, "disc_thickness: expected"),
        ("profile_clearance", float("nan"), "profile_clearance: expected"),
        ("ring", "pinz", "unknown choice 'pinz'; did you mean 'pins'"),
        ("stiffness_scatter", 3.0, "stiffness_scatter: expected a standard deviation from 0 to below 2"),
        ("bearing_stifness", 1e7, "unknown field 'bearing_stifness'; did you mean 'bearing_stiffness'"),
    ],
)
def test_wrong_values_are_refused(field: str, value: Any, message: str) -> None:
    with pytest.raises(InputError) as raised:
        read_cycloidal(write_cycloidal(DRIVE), "mine.toml", **{field: value})
    assert message in str(raised.value)
    assert str(raised.value).startswith("mine.toml")
    assert "\n" not in str(raised.value)


def test_eight_rollers_of_the_stated_radius_would_overlap() -> None:
    """The printed gear's 9 mm are the rollers' diameter: as a radius, eight of them do not fit on 20 mm."""
    with pytest.raises(InputError, match="holes of neighbouring rollers touch"):
        cycloidal(roller_radius=9e-3)


def test_other_kinds_are_refused() -> None:
    with pytest.raises(InputError, match="expected kind 'cycloidal' here, got 'rolling element eccentric'"):
        read_cycloidal({}, "mine.toml")
