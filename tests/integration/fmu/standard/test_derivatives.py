"""Directional derivatives and `stiffness` against differences of sixth order, with every effect, where all is smooth.

The model is not smooth where a speed changes its sign and at the knots of the lookup's splines, where the third
derivative jumps. At the random points speeds are not zero, and with this seed no difference crosses a knot.
"""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi1 import FMICallException
from fmpy.fmi2 import FMU2Slave

from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import Component, drive_component
from reefmu.fmu.model.joint_component import joint_component
from reefmu.fmu.validation.derivatives import differences
from reefmu.fmu.validation.fmu_check import embedded_component
from reefmu.fmu.validation.run_checks import check_derivatives
from reefmu.fmu.xml.archive import read_archive
from reefmu.model.drive_model import DriveModel
from reefmu.model.masses import Masses
from stiffness_model.numerics.arrays import Array
from tests.integration.fmu.model_exchange import Exchange

SIZES = {
    "crank.phi": 1e-2,
    "crank.w": 1.0,
    "output.phi": 3e-4,
    "output.w": 0.05,
    "temperature": 10.0,
    "motor.tau": 1.0,
    "load.tau": 10.0,
    "motor.phi": 1e-2,
    "motor.w": 1.0,
    "load.phi": 3e-4,
    "load.w": 0.05,
    "last.twist": 1e-4,
    "start.twist": 1e-4,
    "last.crank": 1e-2,
    "last.output": 1e-4,
    "creep.twist": 1e-4,
    "wear.travel": 100.0,
    "crank_friction.deflection": 1e-4,
    "elastoplastic_friction.deflection": 2e-5,
}
"""Range of each known in a run; 1 for the relative deflection of friction."""
SHORT = 3e-4
"""Step of a difference, relative to this range."""
TOLERANCE = 1e-8
has_compiler = pytest.mark.skipif(
    not any(shutil.which(n) for n in ("cc", "gcc", "clang")), reason="no C compiler on the PATH"
)


def scaled_differences(function: Callable[[Array], Array], at: Array, size: Array) -> Array:
    """Jacobian of `function` at a point, its columns multiplied by `size`."""
    return differences(function, at, SHORT * size) * size


def worst(came: Array, expected: Array) -> float:
    """The greatest deviation of a row relative to the row's greatest value; a row of zeros must be zero in both."""
    greatest = np.abs(came).max(axis=1)
    moving = greatest > 0
    assert moving.mean() > 0.7
    assert np.abs(expected[~moving]).max(initial=0.0) < 1e-10
    return float((np.abs(came - expected).max(axis=1)[moving] / greatest[moving]).max())


def sizes(component: Component) -> Array:
    return np.array([SIZES.get(s.name, 1.0) for s in (*component.inputs, *component.states)])


def points(model: DriveModel, count: int) -> Iterator[tuple[Array, Array]]:
    """Inputs and states after some steps with reversals, loads of both signs and speeds that are not zero."""
    rng = np.random.default_rng(0)
    component = drive_component(model)
    p = component.parameter_vector()
    for _ in range(count):
        crank = rng.uniform(-9, 9)
        u = np.array(
            [
                crank,
                rng.uniform(1, 20) * rng.choice([-1, 1]),
                crank / p[0] - rng.uniform(-1.5e-3, 1.5e-3),
                rng.uniform(0.02, 0.5) * rng.choice([-1, 1]),
                rng.uniform(0, 60),
            ]
        )
        if abs(u[1] / p[0] - u[3]) < 0.05:
            u[3] = -u[3]
        x = component.initial(u, p)
        for _ in range(5):
            x = component.advance(x, u + rng.normal(size=5) * [1e-2, 0, 1e-4, 0, 0], 0.01, p)
        yield u, np.array(x).ravel()


def values_of(component: Component, p: Array) -> Callable[[Array], Array]:
    """Outputs and rates as a function of inputs and states in one vector."""
    n = len(component.inputs)
    return lambda z: np.concatenate(
        [np.array(component.output(z[n:], z[:n], p)).ravel(), np.array(component.rate(z[n:], z[:n], p)).ravel()]
    )


def tangents(component: Component, u: Array, x: Array, p: Array, size: Array) -> Array:
    return np.array([np.array(component.tangent(x, u, p, d)).ravel() for d in np.diag(size)]).T


def test_derivatives_of_the_model(full_model: DriveModel) -> None:
    component = drive_component(full_model)
    p, size = component.parameter_vector(), sizes(component)
    for u, x in points(full_model, 12):
        expected = scaled_differences(values_of(component, p), np.concatenate([u, x]), size)
        assert worst(tangents(component, u, x, p, size), expected) < TOLERANCE


def test_derivatives_of_the_joint(full_model: DriveModel) -> None:
    component = joint_component(full_model, Masses(2e-4, 0.7, 1e-3, 0.2))
    p, size = component.parameter_vector(), sizes(component)
    for u, x in points(full_model, 4):
        joint = np.concatenate([u[:4], x[: len(full_model.states)]])
        expected = scaled_differences(values_of(component, p), np.concatenate([[0.3, -5.0], joint]), size)
        assert worst(tangents(component, np.array([0.3, -5.0]), joint, p, size), expected) < TOLERANCE


@has_compiler
def test_derivatives_of_the_native_fmu(full_model: DriveModel, unpacked: tuple[Path, Path, str]) -> None:
    """Against differences of the FMU itself, in model exchange, and against the derivatives of the model."""
    component = drive_component(full_model)
    p, size = component.parameter_vector(), sizes(component)
    with Exchange(unpacked[1], {}) as fmu:
        unknowns, knowns = [*fmu.outputs, *fmu.derivatives], [*fmu.inputs, *fmu.states]

        def values(z: Array) -> Array:
            fmu.set(dict(zip(fmu.inputs, z[:5].tolist(), strict=True)))
            fmu.set_states(z[5:])
            return fmu.get(unknowns)

        for u, x in points(full_model, 12):
            z = np.concatenate([u, x])
            expected = scaled_differences(values, z, size)
            values(z)
            came = np.array([fmu.tangent(unknowns, [name], [s]) for name, s in zip(knowns, size, strict=True)]).T
            assert worst(came, expected) < TOLERANCE
            assert worst(came, tangents(component, u, x, p, size)) < 1e-10
            # The derivative along all directions is the sum of the single ones.
            np.testing.assert_allclose(
                fmu.tangent(unknowns, knowns, size.tolist()),
                came.sum(axis=1),
                rtol=1e-9,
                atol=1e-12 * np.abs(came).max(),
            )
            # The missing element stays at the crank (windup 1), so that the output only changes the twist.
            stiffness, by_output, tau = (
                fmu.get(["stiffness"])[0],
                fmu.tangent(["output.tau"], ["output.phi"], [1.0])[0],
                fmu.get(["output.tau", "crank.tau"]),
            )
            assert -by_output == pytest.approx(stiffness, rel=TOLERANCE, abs=1e-9 * abs(tau[0]))


def lever(model: DriveModel, u: Array) -> float:
    """Derivative of the contacts' twist by the crank angle: 1/ratio less the slope of the kinematic error."""
    values = {q.name: q.value for q in model.parameters}
    slope = sum(
        k * values[f"kinematic_error.amplitude_{k}"] * np.cos(k * u[0] + values[f"kinematic_error.phase_{k}"])
        for k in range(1, 5)
    )
    return 1 / values["ratio"] - slope


@pytest.mark.parametrize(("missing", "windup"), [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0)])
def test_stiffness_is_the_slope_along_the_contacts_twist(full_model: DriveModel, missing: float, windup: float) -> None:
    """By the crank angle stiffness x lever, by the output angle -stiffness, unless a missing element moves."""
    model = full_model.with_parameters({"missing_ball.size": missing, "missing_ball.windup": windup})
    component = drive_component(model)
    p = component.parameter_vector()
    function = values_of(component, p)
    for u, x in points(model, 6):
        z = np.concatenate([u, x])
        stiffness = function(z)[3]
        slopes = scaled_differences(function, z, sizes(component))[0] / sizes(component)
        if windup == 0:
            assert slopes[0] == pytest.approx(stiffness * lever(model, u), rel=TOLERANCE)
        if missing == 0 or windup == 1:
            assert -slopes[2] == pytest.approx(stiffness, rel=TOLERANCE)


@pytest.mark.slow
@has_compiler
@pytest.mark.parametrize("torque", [0.0, 90.0])
@pytest.mark.parametrize("kind", ["drive", "joint", "individual"])
def test_derivatives_at_initialisation_by_inputs_and_parameters(
    full_model: DriveModel, full_individual: DriveModel, kind: str, torque: float, tmp_path: Path
) -> None:
    """Of outputs, states and rates, against differences of the FMU itself; states are unknowns there."""
    inside = {
        "missing_ball.size": 0.4,
        "kinematic_error.phase_1": 0.3,
        "band": 0.0 if kind == "individual" else 0.3,
        "missing_ball.windup": 0.5,
        "load_dependent_hysteresis.fraction": 0.1,
        "backlash.clearance": 2e-6,
    }
    model = (full_individual if kind == "individual" else full_model).with_parameters(inside)
    masses = Masses(2e-4, 0.7, 1e-3, 0.2) if kind == "joint" else None
    path = export_fmu(model, tmp_path / "d.fmu", backend="native", masses=masses)
    before, outside = ("start.", {"motor.tau": 0.3, "load.tau": -5.0}) if masses else ("", {"temperature": 41.0})
    start = {
        f"{before}crank.phi": 0.3,
        f"{before}crank.w": 2.0,
        f"{before}output.phi": 0.3 / -29 - 1.5e-3,
        f"{before}output.w": 0.1,
        "start.torque": torque,
        "start.wear.travel": 2.0,
        "start.torque_sensor_drift.grown": 3.0,
        "start.hysteresis.deflection": 0.4,
        **outside,
    }
    description = fmpy.read_model_description(str(path))
    variables = {v.name: v for v in description.modelVariables}
    fmu = FMU2Slave(
        guid=description.guid,
        unzipDirectory=fmpy.extract(str(path), str(tmp_path / "out")),
        instanceName="x",
        modelIdentifier=description.coSimulation.modelIdentifier,
    )
    fmu.instantiate()
    fmu.setupExperiment()
    fmu.enterInitializationMode()
    fmu.setReal([variables[name].valueReference for name in start], list(start.values()))
    unknowns = [u.variable for u in description.initialUnknowns]
    assert {"creep.twist", "der(last.twist)" if kind != "joint" else "der(motor.w)"} <= {v.name for v in unknowns}
    references = [v.valueReference for v in unknowns]
    names = [
        v.name
        for v in variables.values()
        if v.causality in ("input", "parameter")
        and (v.name != "band" or kind != "individual")
        and (v.name != "start.torque" or torque)  # which stands for none at zero
    ]
    for name in names:
        reference, value = variables[name].valueReference, fmu.getReal([variables[name].valueReference])[0]
        size = abs(value) or (float(variables[name].nominal or 1.0) if name.startswith("start.") else 1.0)
        if name in ("crank.phi", "start.crank.phi"):
            size = 1e-2

        def values(at: Array, reference: int = reference) -> Array:
            fmu.setReal([reference], [float(at[0])])
            return np.array(fmu.getReal(references))

        at, errors = np.array([value]), []
        here = values(at)
        came = np.array(fmu.getDirectionalDerivative(references, [reference], [size]))
        for step in (1e-3, 1e-4, 1e-5):
            expected = differences(values, at, np.array([step * size]))[:, 0] * size
            errors.append(np.abs(came - expected) / np.maximum(np.abs(expected), 1e-4 * np.abs(here) + 1e-9))
        values(at)
        error = np.min(errors, axis=0)
        assert error.max() < 1e-5, (name, unknowns[int(error.argmax())].name, error.max())
    depend = {u.variable.name: {v.name for v in u.dependencies} for u in description.initialUnknowns}
    assert {"missing_ball.size", "ratio"} <= depend["output.tau"]
    if description.derivatives:
        with pytest.raises(FMICallException):
            fmu.getDirectionalDerivative(references, [variables["creep.twist"].valueReference], [1.0])
    fmu.exitInitializationMode()
    with pytest.raises(FMICallException):
        fmu.getDirectionalDerivative(references[:1], [variables["missing_ball.size"].valueReference], [1.0])


@has_compiler
def test_check_finds_wrong_derivatives(unpacked: tuple[Path, Path, str], monkeypatch: pytest.MonkeyPatch) -> None:
    assert check_derivatives(unpacked[0], embedded_component(read_archive(unpacked[0]))).passed
    right = FmuDrive.derivative

    def wrong(self: FmuDrive, of: list[str], along: dict[str, float]) -> dict[str, float]:
        came = right(self, of, along)
        return {**came, "stiffness": came["stiffness"] * (1 + 1e-5)}

    monkeypatch.setattr(FmuDrive, "derivative", wrong)
    finding = check_derivatives(unpacked[0], embedded_component(read_archive(unpacked[0])))
    assert not finding.passed
    assert "stiffness" in finding.detail
