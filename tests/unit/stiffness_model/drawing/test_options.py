"""Options of the drawing: reading, writing, faults; and the tables that depend on them."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.model.contacts.tables import fingerprint
from stiffness_model.contact.element_contacts import build_contacts
from stiffness_model.contact.usable_elements import usable_elements
from stiffness_model.drawing import sampling
from stiffness_model.drawing.options import ModelOptions
from stiffness_model.equilibrium.closed_form import solve
from stiffness_model.lookup import build_lookup as lookup
from stiffness_model.lookup import element_table

ALL = {
    "bearing_stiffness": "250 N/um",
    "cage_wall_stiffness": "60 N/um",
    "ring_stiffness": "0.4 kN/mm",
    "housing_stiffness": "80 N.m/arcmin",
    "gear_contact": "exact",
    "cage_contact": "lamina",
    "inertia": "on",
    "crank_speed": "3000 rpm",
    "friction_coefficient": 0.05,
    "gear_pressure_limit": "4 GPa",
    "bearing_capacity": "40 kN",
    "bearing_type": "roller",
}


def test_round_trip(tmp_path) -> None:
    drive = sm.load_drive("drive_1", **ALL)
    assert sm.drive_from_dict(sm.drive_to_dict(drive)) == drive
    sm.save_drive(drive, tmp_path / "mine.toml")
    assert sm.load_drive(tmp_path / "mine.toml") == drive
    again = sm.load_drive(tmp_path / "mine.toml", bearing_stiffness="rigid")
    assert again.beyond == dataclasses.replace(drive.beyond, bearing_stiffness=math.inf)
    text = (tmp_path / "mine.toml").read_text()
    for words in (
        "[bodies]",
        'bearing_stiffness = "250 N/um"',
        "[contacts]",
        'gear_contact = "exact"',
        'crank_speed = "3000 rpm"',
        'bearing_capacity = "40000 N"',
    ):
        assert words in text


def test_an_allowable_pressure_and_its_source_round_trip(tmp_path) -> None:
    drawing = (Path(sm.__file__).parent / "presets" / "drive_3.toml").read_text("utf-8")
    mine = drawing.replace('gear_material = "PLA"', 'gear_material = "PA12"')
    table = '[material.PA12]\nyoungs_modulus = "1.7 GPa"\npoisson_ratio = 0.4\n'
    (tmp_path / "mine.toml").write_text(
        mine + table + 'allowable_pressure = "80 MPa"\nallowable_source = "1.6 x yield, data sheet"\n', "utf-8"
    )
    drive = sm.load_drive(tmp_path / "mine.toml")
    assert drive.materials["gear"].allowable("ball") == 80e6
    sm.save_drive(drive, tmp_path / "again.toml")
    assert sm.load_drive(tmp_path / "again.toml") == drive
    for more, words in (
        ('allowable_pressure = "80 MPa"', "allowable_source, a text that says where"),
        ("allowable_pressure = 80", "a pressure with its unit, such as '90 MPa'"),
        ('allowable_presure = "80 MPa"', "did you mean 'allowable_pressure'"),
    ):
        (tmp_path / "mine.toml").write_text(mine + table + more, "utf-8")
        with pytest.raises(sm.InputError) as error:
            sm.load_drive(tmp_path / "mine.toml")
        assert words in str(error.value)


def test_options_with_default_values_are_not_written() -> None:
    table = sm.drive_to_dict(sm.load_drive("drive_1"))
    assert set(table) == {"name", "description", "geometry", "materials", "tolerances", "operation"}
    assert table["operation"] == {"max_twist": "8 arcmin"}
    assert sm.load_drive("drive_1").beyond == ModelOptions()
    assert sm.load_drive("drive_1").beyond.is_plain


@pytest.mark.parametrize(
    ("fields", "words"),
    [
        ({"bearing_stifness": "1 N/um"}, "did you mean 'bearing_stiffness'"),
        ({"gear_contact": "exat"}, "gear_contact: unknown choice 'exat'; did you mean 'exact'?"),
        ({"cage_contact": "persson"}, "cage_contact: unknown choice 'persson'; expected one of hertz, lamina"),
        ({"cage_contact": 3}, "cage_contact: expected 'hertz' or 'lamina', got 3"),
        ({"inertia": "onn"}, "inertia: unknown choice 'onn'; did you mean 'on'?"),
        ({"bearing_stiffness": "250"}, "bearing_stiffness: expected a stiffness with its unit"),
        ({"bearing_stiffness": "250 N/nm"}, "unknown unit of stiffness 'N/nm'"),
        ({"bearing_stiffness": "-3 N/um"}, "bearing_stiffness: expected a positive stiffness or 'rigid'"),
        ({"housing_stiffness": "0 N.m/rad"}, "housing_stiffness: expected a positive torsional stiffness or 'rigid'"),
        ({"ring_stiffness": math.nan}, "ring_stiffness: expected a positive stiffness"),
        ({"crank_speed": "3000 rpn"}, "unknown unit of speed 'rpn'"),
        ({"friction_coefficient": 1.5}, "expected a coefficient of friction from 0 to below 1, got 1.5"),
        ({"bearing_type": "balls"}, "did you mean 'ball'?"),
    ],
)
def test_refused(fields: dict[str, object], words: str) -> None:
    with pytest.raises(sm.InputError, match=r"^drive_1") as error:
        sm.load_drive("drive_1", **fields)
    assert words in str(error.value)


def test_bare_numbers_and_unknown_fields_in_a_file(tmp_path) -> None:
    drawing = (Path(sm.__file__).parent / "presets" / "drive_1.toml").read_text("utf-8")
    for more, words in (
        ("[bodies]\nbearing_stiffness = 250\n", "a stiffness with its unit, such as '250 N/um'"),
        ("[bodies]\nbearing_stiff = '250 N/um'\n", "did you mean 'bearing_stiffness' or"),
        ("[contact]\ngear_contact = 'exact'\n", "did you mean 'contacts'?"),
    ):
        (tmp_path / "mine.toml").write_text(drawing + more, "utf-8")
        with pytest.raises(sm.InputError) as error:
            sm.load_drive(tmp_path / "mine.toml")
        assert words in str(error.value)


def test_every_option_changes_the_fingerprint() -> None:
    plain = sm.load_drive("drive_1")
    prints = {fingerprint(sm.load_drive("drive_1", **{name: value})) for name, value in ALL.items()}
    assert len(prints | {fingerprint(plain)}) == len(ALL) + 1


@pytest.mark.parametrize("name", ["drive_1", "drive_3"])
def test_quasi_random_drives_have_the_mean_of_quasi_random_elements(name: str) -> None:
    drive = sm.load_drive(name)
    twist = np.array([0.2, 0.6, 1.0]) * drive.max_twist
    drives = sampling.quasi_random_drives(drive, 256)
    contacts = usable_elements(drive, drives).contacts
    mean = solve(contacts, twist * drive.ratio).output_torque.sum(axis=1) / 256
    expected = lookup.mean_torque(drive, twist)
    assert np.abs(mean - expected).max() < 6e-4 * expected[-1]
    shared = sampling.quasi_random_drives(sm.load_drive(name, crank_deviation="eccentric"), 8).crank
    assert all(len(np.unique(row)) == 3 for row in shared)


def test_the_lookup_s_mean_includes_the_bearing() -> None:
    """Compared with the mean of sampled drives, within their sampling error."""
    drive = sm.load_drive("drive_1", bearing_stiffness="250 N/um")
    twist = np.array([-1.0, 0.3, 1.0]) * drive.max_twist
    mean, drawn = lookup.mean_torque(drive, twist), sm.simulate(drive, twist, 200).torque
    error = drawn.std(axis=0) / np.sqrt(200)
    assert (np.abs(mean - drawn.mean(axis=0)) < 3.5 * error + 1e-3 * mean[-1]).all()
    assert mean[-1] < 0.65 * lookup.mean_torque(sm.load_drive("drive_1"), twist)[-1]


def test_a_missing_element_costs_an_elastic_drive_less_torque() -> None:
    """The table's solver, compared for an elastic and a rigid bearing."""
    drive = sm.load_drive("drive_1", bearing_stiffness="250 N/um")
    args = np.array([0.8 * drive.max_twist]), np.array([0.0]), np.array([0.4, 1.0, 1.4])
    soft = element_table._mean_torques(drive, *args)
    rigid = element_table._mean_torques(sm.load_drive("drive_1"), *args)
    assert (soft > 0).all()
    assert (soft < 0.7 * rigid).all()
    stiff = element_table._mean_torques(sm.load_drive("drive_1", bearing_stiffness=1e30), *args)
    np.testing.assert_allclose(stiff, rigid, rtol=0.03)


def test_a_lookup_refuses_inertia() -> None:
    with pytest.raises(sm.InputError, match="inertia 'off', since the crank's speed is no axis of the tables"):
        lookup.build_lookup(sm.load_drive("drive_1", inertia="on", crank_speed="3000 rpm"), 2)


def test_coupled_elements_need_whole_drives() -> None:
    soft = sm.load_drive("drive_1", bearing_stiffness="250 N/um")
    loose = sampling.quasi_random_elements(soft, 64)
    with pytest.raises(sm.InputError, match="whole drives of 87 elements"):
        build_contacts(soft, loose)
    assert len(build_contacts(sm.load_drive("drive_1"), loose)) == 64


def test_the_preset_s_comment_shows_every_option(tmp_path) -> None:
    """The comment in the preset is a valid drawing once it is uncommented."""
    text = (Path(sm.__file__).parent / "presets" / "drive_1.toml").read_text("utf-8")
    plain, _, shown = text.partition("# [bodies]")
    lines = [line.removeprefix("#").strip() for line in ("# [bodies]" + shown).splitlines()]
    (tmp_path / "mine.toml").write_text(plain + "\n".join(x for x in lines if not x.startswith("crank_speed")), "utf-8")
    options = sm.load_drive(tmp_path / "mine.toml").beyond
    for field in dataclasses.fields(ModelOptions):
        assert f"{field.name} =" in text or field.name in ("crank_pressure_limit", "cage_pressure_limit")
    assert options.bearing_stiffness == 2.5e8
    assert options.gear_contact == "exact"
