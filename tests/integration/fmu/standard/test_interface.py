import subprocess
import sys

import numpy as np
import pytest

from reefmu.fmu.model.component import drive_component
from reefmu.fmu.model.declaration import declare
from reefmu.model.signals import INPUTS, OUTPUTS
from stiffness_model.errors import UnknownNameError

CONTRACT = {
    "input": ["crank.phi", "crank.w", "output.phi", "output.w", "temperature"],
    "output": ["output.tau", "crank.tau", "twist", "stiffness", "max_contact_force", "load_share"],
}
UNITS = {
    "crank.phi": "rad",
    "crank.w": "rad/s",
    "output.phi": "rad",
    "output.w": "rad/s",
    "output.tau": "N.m",
    "crank.tau": "N.m",
    "twist": "rad",
    "stiffness": "N.m/rad",
    "max_contact_force": "N",
}


def test_names_and_units_of_the_contract(model):
    interface = declare(drive_component(model))
    for causality, names in CONTRACT.items():
        assert set(names) <= {v.name for v in interface.block(causality)}
    parameters = [v.name for v in interface.block("parameter")]
    assert parameters[:2] == ["ratio", "band"]
    assert {name.split(".")[0] for name in parameters[2:]} == {
        "backlash",
        "structural_compliance",
        "hysteresis",
        "kinematic_error",
        "start",
    }
    assert {name: interface[name].unit for name in UNITS} == UNITS
    assert interface["temperature"].unit in ("K", "degC")


def test_blocks_are_the_vectors_of_the_model(model):
    component = drive_component(model)
    interface = declare(component)
    assert [v.reference for v in interface.variables] == list(range(len(interface.variables)))
    for causality, size in (
        ("input", len(INPUTS)),
        ("output", len(OUTPUTS)),
        ("parameter", len(component.parameters)),
        ("local", len(component.states)),
    ):
        span = interface.span(causality)
        assert span.stop - span.start == size
    starts = [v.start for v in interface.block("parameter")]
    np.testing.assert_array_equal(starts, component.parameter_vector())


def test_dependencies_contain_every_input_that_changes_an_output(model):
    """Found by changing each input at a point where the drive carries load."""
    interface = declare(drive_component(model))
    parameters = model.parameter_vector()
    start = np.array([0.3, 1.0, 0.3 / parameters[0] - 1e-3, -0.1, 25.0])

    def outputs(inputs):
        states = model.advance(model.initial(start, parameters), inputs, 0.01, parameters)
        return np.asarray(model.output(states, inputs, parameters)).ravel()

    for column, signal in enumerate(INPUTS):
        moved = start.copy()
        moved[column] += 1e-5
        for row in np.flatnonzero(outputs(moved) != outputs(start)):
            assert signal.name in interface[OUTPUTS[row].name].dependencies
    assert {"crank.phi", "output.phi"} <= set(interface["output.tau"].dependencies)
    assert "ratio" in interface["output.tau"].initial_dependencies
    assert "ratio" not in interface["output.tau"].dependencies


def test_an_inadmissible_value_is_named_with_its_bounds(model):
    band = declare(drive_component(model))["band"]
    assert band.range_error(3.0) == "band: expected a number from -1 to 1 [1], got 3"
    assert "got nan" in band.range_error(float("nan"))


def test_unknown_variable(model):
    with pytest.raises(UnknownNameError, match=r"did you mean 'output\.tau'"):
        _ = declare(drive_component(model))["output.ta"]


def test_the_digest_changes_with_the_variables(model, soft_model):
    assert declare(drive_component(model)).digest == declare(drive_component(model)).digest
    assert declare(drive_component(model)).digest != declare(drive_component(soft_model)).digest


@pytest.mark.parametrize(
    "module", ["model.variables", "xml.fmi2", "xml.archive", "export", "importer.instance", "validation.fmu_check"]
)
def test_importing_loads_no_fmi_library(module):
    code = (
        f"import sys, reefmu.fmu.{module}\n"
        "print([m for m in ('pythonfmu', 'fmpy', 'casadi', 'control', 'lxml') if m in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
