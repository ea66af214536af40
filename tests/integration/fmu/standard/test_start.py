"""The start of an FMU: equilibrium under a torque, and the states of the effects, in every back end."""

from __future__ import annotations

import shutil
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import Component, drive_component
from reefmu.fmu.model.joint_component import joint_component
from reefmu.fmu.validation.reference_run import make_excitation, run_fmu
from reefmu.joint.equations import JointModel
from reefmu.model.drive_model import DriveModel
from reefmu.model.masses import Masses
from stiffness_model.errors import InputError
from stiffness_model.numerics.arrays import Array

pytestmark = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler on the PATH"
)
TORQUE = 110.0
MASSES = Masses(2e-4, 0.7)
FORMS = [("native", "2.0"), ("native", "3.0"), ("python", "2.0")]


@pytest.fixture(scope="module")
def steady_model(full_model: DriveModel) -> DriveModel:
    """Every effect; the drifting sensor, which no load holds at rest, without size."""
    return full_model.with_parameters({"torque_sensor_drift.rate": 0.0})


@pytest.fixture(scope="module")
def files(steady_model: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> Mapping[tuple[str, str, str], Path]:
    """FMUs by kind, back end and version of FMI."""
    folder = tmp_path_factory.mktemp("start")
    return {
        (kind, backend, fmi): export_fmu(
            steady_model,
            folder / f"{kind}_{backend}_{fmi[0]}.fmu",
            backend=backend,
            fmi=fmi,
            masses=MASSES if kind == "joint" else None,
        )
        for kind in ("drive", "joint")
        for backend, fmi in FORMS
    }


def component_of(model: DriveModel, kind: str) -> Component:
    return joint_component(model, MASSES) if kind == "joint" else drive_component(model)


def first_states(component: Component, start: Mapping[str, float], inputs: Mapping[str, float]) -> dict[str, float]:
    """The states of the Python model at the start, by name."""
    u = np.array([inputs.get(s.name, s.start) for s in component.inputs])
    p = np.array([start.get(q.name, q.value) for q in component.parameters])
    x = np.asarray(component.initial(u, p)).ravel().tolist()
    return dict(zip((s.name for s in component.states), x, strict=True))


@pytest.mark.parametrize(
    ("kind", "backend", "fmi"),
    [
        *(("drive", backend, fmi) for backend, fmi in FORMS),
        *(
            pytest.param("joint", backend, fmi, marks=pytest.mark.slow if backend == "python" else ())
            for backend, fmi in FORMS
        ),
    ],
)
def test_a_start_under_a_torque_stays_at_rest(
    steady_model: DriveModel, files: Mapping[tuple[str, str, str], Path], kind: str, backend: str, fmi: str
) -> None:
    """To 1e-9, with friction, creep and play inside and the crank away from zero, whatever the angles say."""
    component, away = component_of(steady_model, kind), {"crank.phi": 0.7, "output.phi": 0.4}
    start, held = {"start.torque": TORQUE}, {} if kind == "joint" else away
    start |= {f"start.{name}": value for name, value in away.items()} if kind == "joint" else {}
    states = [s.name for s in component.states if s.name != "torque_sensor_drift.grown"]
    expected = first_states(component, start, held)
    with FmuDrive(files[kind, backend, fmi], parameters=start) as fmu:
        first = fmu.initialize(held)
        if kind == "joint":
            # The host reads the crank's torque, and holds it before the first step.
            held = {"motor.tau": -first["crank.tau"], "load.tau": -TORQUE}
        before = fmu.read(states)
        rows = [fmu.step(1e-2, held) for _ in range(100)]
        after = fmu.read(states)
    assert before == pytest.approx({name: expected[name] for name in states}, rel=1e-12, abs=1e-15)
    assert before["creep.twist"] > 1e-5
    np.testing.assert_allclose([row["output.tau"] for row in (first, *rows)], TORQUE, rtol=1e-9)
    scale = component_twist(steady_model)
    for name in states:
        assert after[name] == pytest.approx(before[name], rel=1e-9, abs=1e-9 * scale), name


def component_twist(model: DriveModel) -> float:
    return float(model.lookup.twist.stop)


@pytest.mark.parametrize(("backend", "fmi"), FORMS)
def test_start_values_continue_a_run(
    steady_model: DriveModel, files: Mapping[tuple[str, str, str], Path], backend: str, fmi: str
) -> None:
    """Values that are read from one FMU are those of another after its initialisation, and it goes on alike."""
    path, component = files["drive", backend, fmi], drive_component(steady_model)
    own = [p.name.removeprefix("start.") for p in component.parameters if p.name.startswith("start.")][1:]
    assert own == [f"{e.name}.{s.name}" for e in steady_model.effects for s in e.states]
    excitation, names = make_excitation(component), [s.name for s in component.outputs]
    half = len(excitation.dt) // 2 + 5
    with FmuDrive(path) as one:
        run_fmu(one, excitation.part(0, half), names)
        start = {f"start.{name}": value for name, value in one.read(own).items()}
        with FmuDrive(path, parameters=start) as other:
            other.initialize(excitation.at(half))
            np.testing.assert_array_equal(list(other.read(own).values()), list(start.values()))
            rows = [
                [list(fmu.step(float(excitation.dt[k]), excitation.at(k + 1)).values()) for fmu in (one, other)]
                for k in range(half, len(excitation.dt))
            ]
    came = np.array(rows)
    np.testing.assert_allclose(came[:, 1], came[:, 0], rtol=1e-11, atol=1e-11 * steady_model.full_torque)


def test_states_and_torque_combine(steady_model: DriveModel, files: Mapping[tuple[str, str, str], Path]) -> None:
    """The torque is reached with friction that is built up, and creep begins beyond its equilibrium."""
    component = drive_component(steady_model)
    start = {"start.torque": -TORQUE, "start.hysteresis.deflection": 0.8, "start.creep.twist": 2e-5}
    rest = first_states(component, {"start.torque": -TORQUE}, {})
    for backend, fmi in FORMS:
        with FmuDrive(files["drive", backend, fmi], parameters=start) as fmu:
            outputs = fmu.initialize({})
            states = fmu.read([s.name for s in component.states])
        assert outputs["output.tau"] == pytest.approx(-TORQUE, rel=1e-12)
        assert states == pytest.approx(first_states(component, start, {}), rel=1e-12, abs=1e-15)
        assert states["hysteresis.deflection"] == 0.8
        size = {p.name: p.value for p in steady_model.parameters}["hysteresis.torque"]
        compliance = {p.name: p.value for p in steady_model.parameters}["creep.compliance"]
        # Against friction inside the contacts carry more than the torque, and creep follows them.
        more = rest["creep.twist"] - (states["creep.twist"] - 2e-5)
        assert more == pytest.approx(0.8 * size * compliance, rel=1e-9)


def test_a_joint_starts_where_python_control_does(
    steady_model: DriveModel, files: Mapping[tuple[str, str, str], Path]
) -> None:
    """`JointModel.equilibrium` under the same load is the same state, creep included."""
    state, torques = JointModel(steady_model, MASSES).equilibrium(-TORQUE)
    component = joint_component(steady_model, MASSES)
    expected = first_states(component, {"start.torque": TORQUE}, {})
    own = [value for name, value in expected.items() if not name.startswith("last.")]
    np.testing.assert_allclose(state, own, rtol=1e-9, atol=1e-14)
    with FmuDrive(files["joint", "native", "2.0"], parameters={"start.torque": TORQUE}) as joint:
        assert -joint.initialize({})["crank.tau"] == pytest.approx(torques[0], rel=1e-9)


@pytest.mark.parametrize("kind", ["drive", "joint"])
@pytest.mark.parametrize("sign", [1, -1])
def test_a_torque_out_of_reach_is_refused(
    steady_model: DriveModel,
    files: Mapping[tuple[str, str, str], Path],
    caplog: pytest.LogCaptureFixture,
    kind: str,
    sign: int,
) -> None:
    """In one line, with the limits; within them a start is possible."""
    component = component_of(steady_model, kind)
    assert component.start is not None
    u, p = [s.start for s in component.inputs], component.parameter_vector()
    limits: Array = np.asarray(component.start.limits(u, p)).ravel()
    inside, outside = 0.999 * limits[(sign + 1) // 2], 1.001 * limits[(sign + 1) // 2]
    line = f"start.torque: expected a torque from {limits[0]:.4g} to {limits[1]:.4g} N.m, which the drive reaches"
    for backend, fmi in FORMS:
        path = files[kind, backend, fmi]
        with FmuDrive(path, parameters={"start.torque": outside}) as fmu:
            if backend == "native":
                with pytest.raises(InputError) as refused:
                    fmu.initialize({})
                message = str(refused.value)
            else:  # pythonfmu cannot refuse the call: it logs the line, and has no results
                assert np.isnan(fmu.initialize({})["output.tau"])
                message = caplog.messages[-1]
        assert line in message
        assert "\n" not in message
        with FmuDrive(path, parameters={"start.torque": inside}) as fmu:
            assert fmu.initialize({})["output.tau"] == pytest.approx(inside, rel=1e-9)


def test_start_values_have_bounds(files: Mapping[tuple[str, str, str], Path]) -> None:
    with pytest.raises(InputError, match=r"start\.hysteresis\.deflection"):
        FmuDrive(files["drive", "native", "2.0"], parameters={"start.hysteresis.deflection": 1.5})
