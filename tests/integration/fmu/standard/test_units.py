import zipfile
from xml.etree import ElementTree

import pytest

from reefmu.fmu.export import export_fmu
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


@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_every_display_unit_is_defined_and_suits_its_variable(model, fmi, tmp_path):
    path = export_fmu(model, tmp_path / "x.fmu", backend="native", platform="none", fmi=fmi)
    with zipfile.ZipFile(path) as archive:
        root = ElementTree.fromstring(archive.read("modelDescription.xml"))
    defined = {
        unit.get("name"): {d.get("name") for d in unit.findall("DisplayUnit")}
        for unit in root.findall("UnitDefinitions/Unit")
    }
    shown = {}
    for variable in root.find("ModelVariables"):
        real = variable if fmi == "3.0" else variable[0]
        if real.get("displayUnit"):
            assert real.get("displayUnit") in defined[real.get("unit")]
            shown[variable.get("name")] = real.get("displayUnit")
    assert shown["twist"] == "arcmin"
    assert shown["crank.phi"] == "deg"
    assert shown["stiffness"] == "N.m/arcmin"
    assert shown["backlash.clearance"] == "um"
