"""Sizes of an assembled drive beyond the validity of the theory, and other input of which no drive can be made."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import stiffness_model as sm
from stiffness_model.drawing.assembly_checks import MAX_CONTACT_RATIO, MAX_INDENTATION_RATIO
from stiffness_model.drawing.fields import fields_of
from stiffness_model.drawing.options import ModelOptions
from stiffness_model.elasticity.hertz import point_contact_ellipse, point_stiffness


def refused(**fields) -> str:
    with pytest.raises(sm.InputError) as error:
        sm.load_drive("drive_1", **fields)
    assert "\n" not in str(error.value)
    return str(error.value)


@pytest.mark.parametrize(
    ("fields", "parts"),
    [
        ({"cage_offset": "-8 mm"}, ["cage_offset", "bore radius above zero", "7 mm -8 mm"]),
        ({"element_offset": "-8 mm"}, ["element_offset", "element radius above zero"]),
        ({"crank_offset": "-42 mm"}, ["crank_offset", "crank radius above zero"]),
        ({"gear_offset": "-7.1 mm"}, ["gear_offset", "distance of the gear's profile from the ball path above zero"]),
        ({"element_tolerance": "30 mm"}, ["element_offset", "element radius above zero", "+-7.5 mm"]),
        ({"lobes": 200, "transmission_ratio": 199}, ["lobes", "200 lobes", "cuts itself 2.4 deg", "fewer lobes"]),
        (
            {"lobes": 200, "transmission_ratio": 199, "elements": 597, "gear_tolerance": "0 um"},
            ["lobes", "cuts itself"],
        ),
        ({"gear_offset": "-0.6 mm"}, ["gear_offset", "0.14 mm", "0.6 mm", "Hertz"]),
        ({"crank_offset": "0.6 mm"}, ["gear_offset", "0.6 mm", "Hertz"]),
        ({"gear_offset": "1.4 mm"}, ["gear_offset", "play", "1.4 mm", "clear the lobes"]),
        ({"cage_offset": "-0.1 mm"}, ["cage_offset", "70 um", "0.1 mm", "Hertz"]),
        ({"cage_offset": "6 mm"}, ["cage_offset", "half the lobes' pitch", "6 mm", "next lobe"]),
    ],
)
def test_sizes_of_no_drive_are_refused_in_one_line(fields, parts):
    message = refused(**fields)
    assert all(part in message for part in parts), message


def test_the_limit_is_a_contact_of_a_tenth_of_the_radius():
    """Hertz for a sphere on a plane: at a half width of a tenth of the radius the indentation is a hundredth of it."""
    radius, compliance = 7e-3, 2 * sm.MATERIALS["100Cr6"].compliance
    force = float(point_stiffness(compliance, 1 / radius, 1 / radius)) * (MAX_INDENTATION_RATIO * radius) ** 1.5
    width, _, pressure = point_contact_ellipse(force, compliance, 1 / radius, 1 / radius)
    assert width == pytest.approx(MAX_CONTACT_RATIO * radius, rel=1e-3)
    assert 7.2e9 < pressure < 7.4e9


def test_the_pressure_just_within_the_limit_is_bounded():
    drive = sm.load_drive("drive_1", gear_offset="-0.139 mm")
    pressure = sm.contact_pressures(drive, [0.0], 2).pressure
    assert pressure[..., :2].max() < 9e9  # 7.3 GPa for a plane, changed by the curvatures and the deviations.


@pytest.mark.parametrize("name", ["drive_1", "drive_2", "drive_3"])
def test_changed_drives_are_checked_too(name):
    drive = sm.load_drive(name)
    for change in (
        {"lobes": 200, "transmission_ratio": 199},
        {"tolerances": {**drive.tolerances, "cage": sm.Tolerance(5e-6, -8e-3)}},
    ):
        with pytest.raises(sm.InputError):
            dataclasses.replace(drive, **change)


def test_numpy_integers_are_counts():
    drive = sm.load_drive(
        "drive_1",
        lobes=np.int64(28),
        elements=np.int32(60),
        eccentrics=np.uint8(2),
        transmission_ratio=np.int64(29),
        crank_radius=np.float32(0.0410),
    )
    for name in ("lobes", "elements", "eccentrics", "transmission_ratio"):
        assert type(getattr(drive, name)) is int
    assert type(drive.crank_radius) is float
    assert "whole number" in refused(lobes=30.0)
    assert "whole number" in refused(lobes=True)


def test_quantities_of_a_units_library_are_converted():
    pint = pytest.importorskip("pint")
    unit = pint.UnitRegistry()
    drive = sm.load_drive(
        "drive_1",
        crank_radius=41 * unit.mm,
        max_twist=8 * unit.arcmin,
        cage_offset=2 * unit.um,
        bearing_stiffness=250 * unit.N / unit.um,
        housing_stiffness=2e5 * unit.N * unit.m / unit.rad,
        bearing_capacity=40 * unit.kN,
        crank_speed=1500 * unit.rpm,
        gear_pressure_limit=4.2 * unit.GPa,
        crank_tolerance=13 * unit.um,
    )
    same = sm.load_drive(
        "drive_1",
        crank_radius="41 mm",
        cage_offset="2 um",
        bearing_stiffness="250 N/um",
        housing_stiffness="200 kN.m/rad",
        bearing_capacity="40 kN",
        crank_speed="1500 rpm",
        gear_pressure_limit="4.2 GPa",
    )
    assert drive.crank_radius == pytest.approx(same.crank_radius, rel=1e-12)
    assert drive.max_twist == pytest.approx(same.max_twist, rel=1e-12)
    for name in fields_of(ModelOptions):
        value, expected = getattr(drive.beyond, name), getattr(same.beyond, name)
        assert value == (expected if isinstance(expected, str) else pytest.approx(expected, rel=1e-12))
    assert drive.tolerances["crank"].window == pytest.approx(13e-6, rel=1e-12)
    assert "expected a length" in refused(crank_radius=41 * unit.kg)
    assert "whole number" in refused(lobes=30 * unit.dimensionless)
    with pytest.raises(sm.InputError, match="expected a positive length"):
        dataclasses.replace(drive, crank_radius=41 * unit.mm)


def test_functions_take_a_preset_s_name_for_its_drive():
    by_name, drive = sm.simulate("drive_1", [0.001], 2), sm.load_drive("drive_1")
    assert (by_name.torque == sm.simulate(drive, [0.001], 2).torque).all()
    assert by_name.drive == drive
    with pytest.raises(sm.UnknownNameError, match="did you mean 'drive_1'"):
        sm.simulate("drive1", [0.001])
    with pytest.raises(sm.InputError, match="expected a Drive, a preset's name or a drawing's path, got 3"):
        sm.simulate(3, [0.001])  # type: ignore[arg-type]
