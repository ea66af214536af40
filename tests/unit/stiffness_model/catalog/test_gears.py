"""Published gears: the numbers as the sources state them, piecewise linear twist, users' rows and their faults."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from stiffness_model import ARCMIN
from stiffness_model.catalog.gears import CatalogGear, catalog, read_rows
from stiffness_model.errors import InputError, UnknownNameError

GEARS = {(gear.type, gear.ratio): gear for gear in catalog()}
OWN = '[[gear]]\nmaker = "Own"\ntype = "X1"\nsource = "own rig"\n'


def test_rows_state_what_the_sources_state() -> None:
    cha = GEARS["CHA-40A", "50"]
    assert (cha.t1, cha.t2) == (54, 196)
    assert (cha.k1, cha.k2, cha.k3) == (100e3, 140e3, 180e3)
    assert cha.lost_motion_below == pytest.approx(ARCMIN)
    assert "50" in cha.page
    rv = GEARS["RV-42N", ""]
    assert rv.stiffness == pytest.approx(113 / ARCMIN)
    assert (rv.rated_torque, rv.acceleration_torque, rv.momentary_torque) == (412, 1029, 2058)
    assert rv.greatest_torque == 2058
    csf = GEARS["CSF-32", "100"]
    assert (csf.k1, csf.k2, csf.k3, csf.rated_torque) == (67e3, 110e3, 120e3, 137)


def test_every_row_has_a_source_and_states_whether_it_is_second_hand() -> None:
    assert all(gear.source for gear in GEARS.values())
    assert {gear.type for gear in GEARS.values() if gear.second_hand} == {"RV-42N", "CSF-17", "CSF-25", "CSF-32"}


@pytest.mark.parametrize("key", [("Fine Cyclo F1C-A25", "29"), ("HFUS-40-2A", "50")])
def test_gears_of_the_paper_that_were_not_found_have_no_numbers(key: tuple[str, str]) -> None:
    gear = GEARS[key]
    numbers = ("t1", "t2", "k1", "k2", "k3", "stiffness", "lost_motion_below", "rated_torque")
    assert all(getattr(gear, name) is None for name in numbers)
    assert "not found" in gear.note
    assert not gear.has_curve


@pytest.mark.parametrize("key", [("Fine Cyclo F1C-A25", "29"), ("CSF-17", "50"), ("CSF-25", "50")])
def test_a_row_without_a_curve_has_no_twist(key: tuple[str, str]) -> None:
    with pytest.raises(InputError, match="expected a published stiffness curve, got none"):
        GEARS[key].twist_at(10.0)


def test_twist_is_piecewise_linear() -> None:
    cha = GEARS["CHA-40A", "50"]
    expected = [27 / 100e3, 54 / 100e3, 54 / 100e3 + 100 / 140e3, 54 / 100e3 + 142 / 140e3 + 104 / 180e3]
    np.testing.assert_allclose(cha.twist_at([27, 54, 154, 300]), expected, rtol=1e-14)
    np.testing.assert_array_equal(cha.twist_at([-27, -300]), -cha.twist_at([27, 300]))
    assert float(GEARS["RV-42N", ""].twist_at(226.0)) == pytest.approx(2 * ARCMIN)


@given(torque=st.floats(-1000, 1000), step=st.floats(1e-3, 10))
def test_twist_grows_by_the_segment_s_stiffness(torque: float, step: float) -> None:
    cha = GEARS["CHA-40A", "50"]
    slope = float(cha.twist_at(torque + step) - cha.twist_at(torque)) / step
    assert 1 / 180e3 * (1 - 1e-6) <= slope <= 1 / 100e3 * (1 + 1e-6)


def test_own_rows_come_after_the_published_ones(tmp_path: Path) -> None:
    file = tmp_path / "own.toml"
    file.write_text(
        OWN + 'ratio = 30\nt1 = "10 N.m"\nt2 = "0.03 kN.m"\nk1 = "2 N.m/arcmin"\nk2 = "10 kN.m/rad"\n'
        'k3 = "2e4 N.m/rad"\nsecond_hand = true\n',
        "utf-8",
    )
    gears = catalog(file)
    assert gears[:-1] == catalog()
    assert gears[-1].label == "Own X1 (ratio 30)"
    assert gears[-1].t2 == pytest.approx(30)
    assert float(gears[-1].twist_at(10)) == pytest.approx(5 * ARCMIN)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (OWN + 'ratoi = "30"', "gear 1: unknown field 'ratoi'; did you mean 'ratio'"),
        (OWN + 'k4 = "1 kN.m/rad"', "gear 1: unknown field 'k4'; expected one of .*k1, k2, k3"),
        ('[[gears]]\nmaker = "A"', "unknown table 'gears'; did you mean 'gear'"),
        ("", "expected one table \\[\\[gear\\]\\] or more, got 'none'"),
        ("gear = 3", "expected one table \\[\\[gear\\]\\] or more, got 3"),
        ('[[gear]]\nmaker = "A"\ntype = "B"', "gear 1: expected the field 'source'"),
        ('[[gear]]\nmaker = "A"\ntype = ""\nsource = "s"', "type: expected a text that is not empty"),
        (OWN + "stiffness = 100", "stiffness: expected a torsional stiffness with its unit.*got '100'"),
        (OWN + 'stiffness = "100"', "stiffness: expected a torsional stiffness with its unit.*got '100'"),
        (OWN + 'stiffness = "100 N.m/arcmni"', "unknown unit of torsional stiffness 'N.m/arcmni'; did you mean"),
        (OWN + 'stiffness = "100 N.m"', "unknown unit of torsional stiffness 'N.m'"),
        (OWN + 'stiffness = "-1 N.m/arcmin"', "stiffness: expected a positive value"),
        (OWN + 'stiffness = "0 N.m/arcmin"', "stiffness: expected a positive value"),
        (OWN + "stiffness = nan", "stiffness: expected a torsional stiffness with its unit.*got 'nan'"),
        (OWN + 'k1 = "1 kN.m/rad"\nstiffness = "1 kN.m/rad"', "expected either one stiffness or t1"),
        (OWN + 't1 = "1 N.m"\nk1 = "1 kN.m/rad"', "expected t1, t2, k1, k2 and k3 together, got 't1, k1'"),
        (
            OWN + 't1 = "3 N.m"\nt2 = "2 N.m"\nk1 = "1 kN.m/rad"\nk2 = "1 kN.m/rad"\nk3 = "1 kN.m/rad"',
            "expected t1 below t2, got '3 and 2 N.m'",
        ),
        (OWN + "ratio = true", "ratio: expected a text, got True"),
        (OWN + 'second_hand = "yes"', "second_hand: expected true or false, got 'yes'"),
        ("[[gear", "expected a TOML catalogue, got a syntax error"),
    ],
)
def test_a_faulty_row_is_reported_in_one_line(text: str, words: str) -> None:
    with pytest.raises(InputError, match=words) as caught:
        read_rows(text, "own.toml")
    assert str(caught.value).startswith("own.toml: ")
    assert "\n" not in str(caught.value)


def test_the_number_of_the_wrong_row_is_reported() -> None:
    with pytest.raises(UnknownNameError, match=r"own\.toml: gear 2: unknown field 'size_'"):
        read_rows(OWN + OWN + 'size_ = "1"', "own.toml")


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="expected a readable TOML catalogue, got: No such file"):
        catalog(tmp_path / "none.toml")
    (tmp_path / "binary.toml").write_bytes(b"\xff\xfe\x00")
    with pytest.raises(InputError, match="expected a readable TOML catalogue"):
        catalog(tmp_path / "binary.toml")


def test_gears_made_in_code_are_checked_too() -> None:
    gear = CatalogGear("A", "B", "rig", stiffness=1e5)
    assert gear.greatest_torque is None
    assert gear.label == "A B"
    with pytest.raises(InputError, match="gear A B: stiffness: expected a positive value, got nan"):
        replace(gear, stiffness=float("nan"))
