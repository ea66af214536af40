"""Texts with units: spellings that sheets use, and messages that state what to write instead."""

from __future__ import annotations

import pytest

import stiffness_model as sm
from stiffness_model.errors import InputError
from stiffness_model.units import UNITS, format_quantity, parse_quantity, quantity_of, si_unit


@pytest.mark.parametrize("quantity", UNITS)
def test_every_quantity_has_its_si_unit_and_is_read_back(quantity: str) -> None:
    assert UNITS[quantity][si_unit(quantity)] == 1.0
    assert quantity_of(si_unit(quantity)) == quantity
    for unit in UNITS[quantity]:
        value = parse_quantity(f"1.5 {unit}", quantity, "a")
        assert parse_quantity(format_quantity(value, quantity), quantity, "a") == value


@pytest.mark.parametrize("quantity", ["torque", "torsional stiffness", "rotational damping"])
def test_newton_metres_may_lack_their_point(quantity: str) -> None:
    for unit, size in UNITS[quantity].items():
        if "N.m" in unit:
            assert UNITS[quantity][unit.replace("N.m", "Nm")] == size


def test_a_decimal_comma_is_answered_with_the_decimal_point() -> None:
    with pytest.raises(InputError, match=r"got '3,1 kN\.m/rad'; with a decimal point it is '3\.1 kN\.m/rad'$"):
        parse_quantity("3,1 kN.m/rad", "torsional stiffness", "k1")
    with pytest.raises(InputError, match=r"got 'a, b'$"):
        parse_quantity("a, b", "torsional stiffness", "k1")


@pytest.mark.parametrize("text", ["<1 arcmin", "< 1 arcmin", "<= 1 arcmin", "≤1 arcmin", "below 1 arcmin"])
def test_an_upper_limit_is_answered_with_upper_limits(text: str) -> None:
    table = {"kind": "catalogue", "name": "a", "source": "sheet", "ratio": 50, "k1": "9 kNm/rad", "t1": "9 N.m"}
    with pytest.raises(InputError, match=r'lost_motion = "1 arcmin" and upper_limits = \["lost_motion"\]$'):
        sm.drive_from_dict({**table, "lost_motion": text}, "mine.toml")
