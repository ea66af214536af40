"""A data sheet as a drive: its lines to the digit, its fields, its faults, and what it does not have."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import stiffness_model as sm
from stiffness_model.catalog.catalogue_drive import CatalogueDrive
from stiffness_model.catalog.gears import catalog
from stiffness_model.kinds import CATALOGUE, KINDS
from stiffness_model.lookup.build_lookup import build_lookup
from stiffness_model.numerics.piecewise_line import rounding_error

SHEET = """
kind = "catalogue"
name = "mine"
ratio = -100
source = "own sheet, page 3"
K1 = "100 kN.m/rad"
T1 = "54 N.m"
K2 = "140 kN.m/rad"
T2 = "196 N.m"
K3 = "180 kN.m/rad"
hysteresis_loss = "1 arcmin"
rated_torque = "265 N.m"
momentary_torque = "686 N.m"
inertia = "4.5 kg.cm2"

[sources]
inertia = "own sheet, page 5"

[efficiency]
speed = ["500 rpm", "2000 rpm"]
torque = ["50 N.m", "265 N.m"]
value = [[0.5, 0.75], [0.4, 0.7]]
"""


def from_text(text: str, folder: Path) -> CatalogueDrive:
    (folder / "mine.toml").write_text(text, "utf-8")
    drive = sm.load_drive(folder / "mine.toml")
    assert isinstance(drive, CatalogueDrive)
    return drive


@pytest.fixture(scope="module")
def cha() -> CatalogueDrive:
    return sm.load_drive("CHA-40A-50")


def test_the_curve_is_the_sheet_s_to_the_digit(cha: CatalogueDrive) -> None:
    """54 N.m at 54/100e3 rad, then 140e3 N.m/rad: 118.4 N.m at 1 mrad, where a spline had 112.7."""
    population = sm.simulate("CHA-40A-50", [5.4e-4, 1e-3, -1e-3], n_drives=2)
    np.testing.assert_allclose(population.torque[0], [54.0, 118.4, -118.4], rtol=1e-14)
    np.testing.assert_allclose(population.crank_torque, population.torque / 50, rtol=1e-14)
    curve = sm.simulate(cha, np.linspace(0, cha.max_twist, 13)).curve()
    assert float(curve.torque_at(1e-3)) == pytest.approx(118.4, rel=1e-14)
    assert float(curve.twist_at(118.4)) == pytest.approx(1e-3, rel=1e-12)
    assert float(curve.stiffness_at(1e-3)) == pytest.approx(140e3, rel=1e-12)
    assert float(build_lookup(cha).torque(1e-3)) == pytest.approx(118.4, rel=1e-13)
    assert rounding_error(cha.line) < 1.1e-3


@pytest.mark.parametrize("gear", [gear for gear in catalog() if gear.has_curve], ids=lambda gear: gear.name)
def test_the_drive_and_the_row_have_the_same_twists(gear: object) -> None:
    """`CatalogGear.twist_at` is an independent statement of the same lines."""
    drive = sm.load_drive(gear.name, ratio=100)  # type: ignore[attr-defined]
    torque = np.linspace(-500, 500, 41)
    np.testing.assert_allclose(drive.line.at(gear.twist_at(torque)), torque, rtol=1e-12, atol=1e-10)  # type: ignore[attr-defined]


@given(st.floats(1, 100), st.floats(1.1, 5), st.floats(1, 200), st.floats(0.3, 3), st.floats(0.3, 3))
def test_every_corner_is_a_torque_limit(t1: float, factor: float, k1: float, two: float, three: float) -> None:
    t2 = t1 * factor
    ks = (1e3 * k1, 1e3 * k1 * two, 1e3 * k1 * two * three)
    drive = CatalogueDrive(name="a", ratio=50, source="own", k1=ks[0], t1=t1, k2=ks[1], t2=t2, k3=ks[2])
    corners = [t1 / ks[0], t1 / ks[0] + (t2 - t1) / ks[1]]
    np.testing.assert_allclose(drive.line.at(corners), [t1, t2], rtol=1e-12)
    assert float(drive.line.at(10 * corners[1])) == pytest.approx(t2 + ks[2] * 9 * corners[1], rel=1e-9)


def test_a_sheet_is_read_and_written(tmp_path: Path) -> None:
    drive = from_text(SHEET, tmp_path)
    assert drive.ratio == -100
    assert drive.inertia == pytest.approx(4.5e-4)
    assert drive.source_of("inertia") == "own sheet, page 5"
    assert drive.source_of("k1") == "own sheet, page 3"
    assert drive.efficiency is not None
    assert float(drive.efficiency.at(1250 * np.pi / 30, 157.5)) == pytest.approx((0.5 + 0.75 + 0.4 + 0.7) / 4)
    assert float(drive.line.at(drive.max_twist)) == pytest.approx(686.0)
    sm.save_drive(drive, tmp_path / "copy.toml")
    assert sm.load_drive(tmp_path / "copy.toml") == drive
    assert "[sources]" in (tmp_path / "copy.toml").read_text("utf-8")


def test_a_table_of_twist_and_torque_is_a_curve(tmp_path: Path) -> None:
    text = """
kind = "catalogue"
name = "measured"
ratio = 81
source = "own rig"
twist = ["0 arcmin", "1 arcmin", "3 arcmin"]
torque = ["0 N.m", "20 N.m", "100 N.m"]
"""
    drive = from_text(text, tmp_path)
    np.testing.assert_allclose(drive.line.at(np.array([-2.0, 0.5, 2.0]) * sm.ARCMIN), [-60, 10, 60], rtol=1e-12)
    assert drive.max_twist == pytest.approx(3 * sm.ARCMIN)
    assert sm.drive_from_dict(sm.drive_to_dict(drive)) == drive


@pytest.mark.parametrize(
    ("before", "after", "message"),
    [
        ('K3 = "180 kN.m/rad"', 'K4 = "180 kN.m/rad"', "unknown field 'K4'"),
        ('rated_torque = "265', 'ratd_torque = "265', "did you mean 'rated_torque'"),
        ("ratio = -100", "", "expected the field 'ratio', got none; state it with its sign"),
        ("ratio = -100", "ratio = 1", "a ratio of magnitude above 1"),
        ('source = "own sheet, page 3"', "", "expected the field 'source'"),
        ('T1 = "54 N.m"', "T1 = 54", "T1: expected a torque with its unit".replace("T1", "t1")),
        ('T1 = "54 N.m"', "", "expected k1, t1, k2, t2 and k3"),
        ('T1 = "54 N.m"', 'T1 = "254 N.m"', "t1 below t2"),
        ('K1 = "100 kN.m/rad"', 'K1 = "100 kN.m/rad"\nk1 = "90 kN.m/rad"', "k1 once"),
        ('K1 = "100 kN.m/rad"', 'K1 = "100 kN.m/rad"\nstiffness = "9 N.m/arcmin"', "or one stiffness"),
        ('"4.5 kg.cm2"', '"4.5 kg"', "unknown unit of moment of inertia 'kg'"),
        ("[0.5, 0.75], ", "", "2 rows of 2 numbers"),
        ("0.75]", "75]", "efficiencies above 0, at most 1"),
        ('inertia = "own sheet, page 5"', 'inertai = "own sheet"', "did you mean 'inertia'"),
        ('kind = "catalogue"', 'kind = "catalog"', "unknown kind 'catalog'; did you mean 'catalogue'"),
    ],
)
def test_a_fault_is_one_line(before: str, after: str, message: str, tmp_path: Path) -> None:
    assert before in SHEET
    with pytest.raises(sm.InputError) as caught:
        from_text(SHEET.replace(before, after, 1), tmp_path)
    assert message in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("RV-42N", "expected the field 'ratio', got none"),
        ("CHA-40A", r"expected the field 'ratio' \(above 50\), got none"),
        ("CHA-40A-50x", "unknown drive 'CHA-40A-50x'; did you mean 'CHA-40A-50'"),
        ("HFUS-40-2A-50", "got none .source: Harmonic Drive"),
        ("CSF-17-50", "got k1, k2, k3 alone"),
    ],
)
def test_no_number_is_invented_for_a_row_without_it(name: str, message: str) -> None:
    with pytest.raises(sm.InputError, match=message):
        sm.load_drive(name)


def test_a_row_for_a_range_of_ratios_takes_one_of_them() -> None:
    assert sm.load_drive("CHA-40A-120").ratio == sm.load_drive("CHA-40A", ratio=120).ratio == 120
    with pytest.raises(sm.InputError, match="a ratio above 50, for which the numbers hold, got 40"):
        sm.load_drive("CHA-40A", ratio=40)


def test_what_a_sheet_lacks_is_one_line_and_no_number(cha: CatalogueDrive) -> None:
    population = sm.simulate(cha, [0.0, 1e-3], n_drives=3)
    line = "CHA-40A-50 is a catalogue gear without contact forces: its data sheet states nothing of contacts"
    for name in ("contact_force", "load_share"):
        assert not hasattr(population, name)
        with pytest.raises(sm.InputError, match=line):
            getattr(population, name)
    assert set(population.curve().columns()) == {
        "twist [arcmin]",
        "torque_mean [N.m]",
        "torque_p10 [N.m]",
        "torque_p90 [N.m]",
        "stiffness [N.m/arcmin]",
    }
    with pytest.raises(sm.InputError, match="which has no contact force"):
        build_lookup(cha).max_contact_force(1e-3)
    with pytest.raises(sm.InputError, match="expected a rolling element eccentric drive, got CHA-40A-50, a catalogue"):
        sm.contact_pressures(cha, [1e-3])


def test_every_kind_s_functions_exist() -> None:
    for kind in KINDS.values():
        assert kind.fields
        names = (kind.read, kind.write, kind.simulate, kind.lookup, kind.inherent_effects, kind.packaged)
        for name in filter(None, names):
            from stiffness_model.display import view

            assert callable(view(name)), name
    assert KINDS[CATALOGUE].noun == "a catalogue gear"


def test_it_shows_itself_with_its_sources(tmp_path: Path) -> None:
    pytest.importorskip("pandas")
    drive = from_text(SHEET, tmp_path)
    assert "ratio -100" in repr(drive)
    assert "4.5 kg.cm2" in drive._repr_html_()
    frame = drive.to_dataframe().set_index("field")
    assert frame.loc["inertia", "source"] == "own sheet, page 5"
    assert frame.loc["k1", "value"] == "100 kN.m/rad"
    lookup = build_lookup(drive)
    assert lookup.to_dataframe()["torque [N.m]"].max() == pytest.approx(686.0)
    population = sm.simulate(drive, np.linspace(0, 1e-3, 200), 2)
    for shown in (drive, lookup, population, population.curve()):
        assert shown.plot().get_xlabel()
        assert "\n" not in repr(shown)
        assert len(repr(shown)) < 200
