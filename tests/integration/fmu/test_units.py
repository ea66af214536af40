import pytest

from reefmu.fmu.model.base_units import base_unit
from stiffness_model.errors import InputError, UnknownNameError


@pytest.mark.parametrize(
    ("unit", "exponents"),
    [
        ("1", ()),
        ("rad", (("rad", 1),)),
        ("N.m", (("kg", 1), ("m", 2), ("s", -2))),
        ("N.m/rad", (("kg", 1), ("m", 2), ("s", -2), ("rad", -1))),
        ("rad/(N.m)", (("kg", -1), ("m", -2), ("s", 2), ("rad", 1))),
        ("N.m.s/rad", (("kg", 1), ("m", 2), ("s", -1), ("rad", -1))),
        ("kg.m2", (("kg", 1), ("m", 2))),
        ("1/K", (("K", -1),)),
    ],
)
def test_exponents(unit, exponents):
    base = base_unit(unit)
    assert base.exponents == exponents
    assert base.factor == 1.0
    assert base.offset == 0.0


def test_factors_and_offset():
    assert base_unit("um/K").factor == pytest.approx(1e-6)
    assert base_unit("N.m/arcmin").factor == pytest.approx(3437.7467707849396)
    celsius = base_unit("degC")
    assert (celsius.exponents, celsius.offset) == ((("K", 1),), 273.15)


@pytest.mark.parametrize("unit", ["", "N.m/", "N/m/s", "N..m"])
def test_a_text_of_another_form_is_refused(unit):
    with pytest.raises(InputError):
        base_unit(unit)


def test_an_unknown_unit_is_named_in_the_error():
    with pytest.raises(UnknownNameError, match="'arcmn'; did you mean 'arcmin'"):
        base_unit("N.m/arcmn")
