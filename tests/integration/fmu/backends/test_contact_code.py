"""The handwritten C between the generated functions (tables, contacts, their derivatives) against the model."""

from __future__ import annotations

import math
import shutil
from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from reefmu.effects import EFFECTS, Effect, Parameter, Place
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import Component, drive_component
from reefmu.fmu.model.declaration import declare_with_derivatives
from reefmu.fmu.model.table_encoding import decode_tables, embedded_lookup, encode_tables, lookup_metadata
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.stages.scalar import make_scalar_stages
from stiffness_model.lookup.build_lookup import Lookup

needs_compiler = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler on the PATH"
)


def random_parameters(component: Component, rng: np.random.Generator) -> dict[str, float]:
    """Random tunable parameters around their nominal values; about a third of them zero."""
    values = {}
    for q in component.parameters:
        if q.tunable:
            low, high = (-1.0 if q.minimum is None else q.minimum), (1.0 if q.maximum is None else q.maximum)
            size = q.nominal * rng.uniform(0.2, 1.5) * (rng.choice([-1, 1]) if low < 0 else 1)
            off = rng.random() < 0.3 and low <= 0
            values[q.name] = 0.0 if off else float(np.clip(size, low, high))
    return values


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize(
    ("name", "fmu"), [("full_model", "full_native"), ("full_individual", "full_native_individual")]
)
def test_outputs_and_directional_derivatives_are_the_models(
    name: str, fmu: str, request: pytest.FixtureRequest
) -> None:
    """To 1e-12 of the greatest value, within and beyond the tables, with random parameters and random directions."""
    # The decoded tables of the FMU, because test_table_encoding checks their rounding.
    full_model, path = request.getfixturevalue(name), request.getfixturevalue(fmu)
    embedded = embedded_lookup(full_model)
    decoded = decode_tables(encode_tables(embedded), lookup_metadata(embedded), "")
    component = drive_component(replace(full_model, lookup=decoded))
    interface = declare_with_derivatives(component)
    unknowns = [v.name for v in (*interface.block("output"), *interface.derivatives)]
    knowns = [v.name for v in (*interface.block("input"), *interface.block("local")) if not v.derivative_of]
    states, outputs = [s.name for s in component.states], [s.name for s in component.outputs]
    rng = np.random.default_rng(11)
    reach = full_model.lookup.twist.stop
    ratio = full_model.drive.ratio
    with FmuDrive(path) as drive:
        for case in range(150):
            drive.reset(random_parameters(component, rng))
            crank = rng.uniform(-7, 7)
            start = {"crank.phi": crank, "output.phi": crank / ratio, "temperature": 20.0}
            drive.initialize(start)
            u = {
                **start,
                "crank.w": rng.normal(),
                "output.w": 0.05 * rng.normal(),
                "output.phi": crank / ratio - rng.uniform(-1.3, 1.3) * reach,
                "temperature": 20 + rng.uniform(-30, 30) * (case % 3 > 0),
            }
            came = drive.step(0.01, u)
            x = np.array(list(drive.read(states).values()))
            u_vector = np.array([u[name] for name in drive.inputs])
            p = np.array(list(drive.read([q.name for q in component.parameters]).values()))
            expected = np.array(component.output(x, u_vector, p)).ravel()
            scale = np.maximum(np.abs(expected), 1e-3)
            scale[outputs.index("output.tau")] = full_model.full_torque
            assert (np.abs(np.array([came[n] for n in outputs]) - expected) / scale).max() < 3e-12
            direction = rng.normal(size=len(knowns)) * rng.choice([0, 1], len(knowns))
            change = np.array(list(drive.derivative(unknowns, dict(zip(knowns, direction, strict=True))).values()))
            expected = np.array(component.tangent(x, u_vector, p, direction)).ravel()
            # Relative to the sum of the absolute values of the terms, because the terms cancel.
            terms = np.zeros(len(unknowns))
            for k in np.flatnonzero(direction):
                one = np.zeros(len(knowns))
                one[k] = direction[k]
                terms += np.abs(np.array(component.tangent(x, u_vector, p, one)).ravel())
            assert (np.abs(change - expected) <= 1e-10 * terms + 1e-11).all(), (case, change - expected, terms)


def test_an_effect_that_does_not_fit_the_stages_is_refused(lookup: Lookup) -> None:
    """A compliance that depends on the temperature is not a function of parameters alone: an error, not a wrong FMU."""
    soft = Effect(
        "soft",
        "",
        "",
        Place.SERIES,
        (Parameter("c", "rad/(N.m)", 0.0, 0.0, 1.0, 1e-6, ""),),
        lambda signals, p, x: (p["c"] * signals.temperature, 0.0),
        "",
        "",
        "",
    )
    with pytest.raises(NotImplementedError, match=r"coefficients: expected .* got one that also needs u"):
        make_scalar_stages(lookup, (soft,))


def test_stages_together_are_the_model(full_model: DriveModel) -> None:
    """In Python: kinematics, the contacts of the whole model and output agree with the model up to rounding."""
    stages = make_scalar_stages(full_model.lookup, full_model.effects)
    p = full_model.parameter_vector()
    rng = np.random.default_rng(2)
    for _ in range(20):
        u = np.array([rng.uniform(-4, 4), rng.normal(), 0.0, 0.1 * rng.normal(), rng.uniform(0, 40)])
        u[2] = u[0] / full_model.drive.ratio - rng.uniform(-1, 1) * 2e-3
        x = np.array(full_model.initial(u, p)).ravel()
        x[len(x) - 2 :] = rng.uniform(0, 1e-6)
        whole = np.array(full_model.output(x, u, p)).ravel()
        k = stages.functions["kinematics"](u, p)
        # The outputs of the contacts, recovered from the model's outputs; the states above cause no friction there.
        torque = ca.MX.sym("torque")
        given = ca.Function(
            "given", [torque], [stages.functions["output"](x, u, k, p, ca.vertcat(torque, 0, 0, 0, 0))[0]]
        )
        at_zero, slope = float(given(0.0)), float(given(1.0)) - float(given(0.0))
        found = (whole[0] - at_zero) / slope
        y = np.array(stages.functions["output"](x, u, k, p, [found, 0, whole[4], whole[5], whole[6]])).ravel()
        assert math.isclose(slope, 1.0, rel_tol=0.2)
        np.testing.assert_allclose(
            y[[0, 1, 2, 4, 5, 6, 7]], whole[[0, 1, 2, 4, 5, 6, 7]], rtol=1e-9, atol=1e-9 * full_model.full_torque
        )


def test_every_effect_has_stages(full_model: DriveModel) -> None:
    for effect in EFFECTS.values():
        stages = make_scalar_stages(replace(full_model.lookup), (effect,))
        assert stages.has_angle_states == any(s.independent_variable.value != "time" for s in effect.states)
        assert stages.has_time_states == any(s.independent_variable.value == "time" for s in effect.states)
        assert stages.has_series_compliance == (effect.name in ("structural_compliance",))


def test_the_slope_at_a_node_of_the_tables_agrees_with_differences(drive: object, lookup: Lookup) -> None:
    """The nominal clearance is a node, and every fit that starts from neutral values uses the slope there."""
    model = build_model(drive, {"thermal_clearance": {"rate": 3e-7}}, lookup=lookup)  # type: ignore[arg-type]
    p = model.parameter_vector()
    u = np.array([0.0, 0.0, -1.1e-3, 0.0, 20.0])

    def at(h: float) -> np.ndarray:
        return np.array(model.output([], u + h * np.eye(5)[4], p)).ravel()

    h = 0.02
    differences = (8 * (at(h) - at(-h)) - (at(2 * h) - at(-2 * h))) / (12 * h)
    exact = np.array(model.jacobian([], u, p))[:, 4]
    assert abs(exact[0]) > 0.1
    np.testing.assert_allclose(exact, differences, rtol=1e-6, atol=1e-9)
