"""Nominal values, tolerance, step size and dependencies for an integrator; and angles connected without speeds."""

from __future__ import annotations

import re
import shutil
import zipfile
from pathlib import Path
from xml.etree import ElementTree

import casadi as ca
import fmpy
import numpy as np
import pytest
from scipy.integrate import solve_ivp

import stiffness_model as sm
from reefmu.cli import main
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import drive_component
from reefmu.fmu.model.joint_component import joint_component
from reefmu.fmu.model.nominals import propose_experiment, twist_at_full_torque, with_nominals
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import TYPICAL_MASSES
from stiffness_model.lookup.build_lookup import Lookup
from tests.integration.fmu.model_exchange import Exchange

needs_compiler = pytest.mark.skipif(
    not any(shutil.which(name) for name in ("cc", "gcc", "clang")), reason="no C compiler on the PATH"
)


def description(path: Path) -> ElementTree.Element:
    with zipfile.ZipFile(path) as archive:
        return ElementTree.fromstring(archive.read("modelDescription.xml"))


def test_nominal_values_are_those_of_the_drive_at_full_torque(full_model: DriveModel) -> None:
    component = drive_component(full_model)
    found = {s.name: s.nominal for s in (*with_nominals(component).outputs, *with_nominals(component).states)}
    twist, values = twist_at_full_torque(component), {q.name: q.value for q in full_model.parameters}
    assert all(size is not None and size > 0 for size in found.values())
    assert found["output.tau"] == pytest.approx(full_model.full_torque, rel=0.05)
    assert found["crank.tau"] == pytest.approx(full_model.full_torque / 29, rel=0.1)  # 10 %: kinematic error
    assert found["twist"] == found["last.twist"] == found["last.output"] == twist
    assert found["last.crank"] == pytest.approx(29 * twist)
    assert found["creep.twist"] == values["creep.compliance"] * full_model.full_torque
    assert found["hysteresis.deflection"] == 1.0


def test_nominal_speeds_of_a_joint_are_those_of_its_oscillation(model: DriveModel) -> None:
    """The greatest speeds of a free oscillation from the twist at full torque have the nominal magnitude."""
    plain = build_model(sm.load_drive("drive_1"), lookup=model.lookup)
    component = joint_component(plain, TYPICAL_MASSES)
    found = {s.name: s.nominal or 0.0 for s in with_nominals(component).states}
    twist = twist_at_full_torque(drive_component(plain))
    p = component.parameter_vector()
    p[[q.name for q in component.parameters].index("start.output.phi")] = -twist
    x, greatest = component.initial([0, 0], p), np.zeros(4)
    for _ in range(300):
        x = component.advance(x, [0, 0], 2e-5, p)
        greatest = np.maximum(greatest, np.abs(np.array(x).ravel()))
    # The lighter side oscillates with nearly the whole twist, the other with its share.
    for row, name in ((0, "motor.phi"), (1, "motor.w")):
        assert 0.3 * found[name] < greatest[row] < 2.5 * found[name]


@pytest.mark.slow
@needs_compiler
@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_creep_at_a_coarse_tolerance(drive: sm.Drive, lookup: Lookup, tmp_path: Path, fmi: str) -> None:
    """At 1e-4 with FMPy's CVode the error is below 2e-4 of the torque; a nominal of 1 for a twist gives above 1e-3."""
    model = build_model(drive, {"creep": {"compliance": 1e-6, "time": 0.05}}, lookup=lookup)
    component = drive_component(model)
    p = component.parameter_vector()
    u = np.array([0, 0, -2e-3, 0, 20])
    exact = solve_ivp(
        lambda _, x: np.array(component.rate(x, u, p)).ravel(),
        (0, 0.3),
        np.array(component.initial(u, p)).ravel(),
        rtol=1e-11,
        atol=1e-16,
        method="LSODA",
        dense_output=True,
    )
    path = export_fmu(model, tmp_path / "creep.fmu", backend="native", fmi=fmi)
    came = fmpy.simulate_fmu(
        str(path),
        fmi_type="ModelExchange",
        solver="CVode",
        relative_tolerance=1e-4,
        stop_time=0.3,
        output_interval=1e-2,
        start_values={"output.phi": -2e-3},
        output=["output.tau"],
    )
    expected = np.array([float(component.output(exact.sol(t), u, p)[0]) for t in came["time"]])
    assert np.ptp(expected) > 10
    assert np.abs(came["output.tau"] - expected).max() < 3e-4 * np.abs(expected).max()


@pytest.mark.slow
def test_explicit_euler_is_usable_at_the_proposed_step(drive: sm.Drive, lookup: Lookup) -> None:
    """Over the proposed experiment an undamped oscillation grows by exp(1/2) a second at most, also with friction."""
    for effects in ({}, {"hysteresis": {"torque": 4.0}, "coulomb_friction": {"torque": 2.0}}):
        component = joint_component(build_model(drive, effects, lookup=lookup), TYPICAL_MASSES)
        proposed = propose_experiment(component)
        steps = proposed.stop_time / proposed.step_size
        assert steps == pytest.approx(round(steps))
        p = component.parameter_vector()
        p[[q.name for q in component.parameters].index("start.output.phi")] = -1e-3
        x = ca.MX.sym("x", len(component.states))
        euler = ca.Function("euler", [x], [x + proposed.step_size * component.rate(x, [0, 0], p)])
        states = [np.array(component.initial([0, 0], p)).ravel()]
        for _ in range(20):
            states.append(np.array(euler.fold(round(steps / 20))(states[-1])).ravel())
        assert np.abs(np.array(states)[:, 2]).max() < 1.1e-3


@pytest.mark.parametrize("masses", [None, TYPICAL_MASSES])
def test_the_proposed_step_passes_the_package_s_own_check(
    drive: sm.Drive, lookup: Lookup, tmp_path: Path, capsys: pytest.CaptureFixture[str], masses: object
) -> None:
    path = export_fmu(build_model(drive, lookup=lookup), tmp_path / "d.fmu", masses=masses)  # type: ignore[arg-type]
    proposed = description(path).find("DefaultExperiment")
    assert proposed is not None
    assert float(proposed.get("tolerance", "")) == 1e-6
    if masses is None:
        assert main(["check", str(path), "--inertia", str(TYPICAL_MASSES.reduced_inertia(-29.0))]) == 0
        said = re.search(r"ok   coupling: (\S+) \(at most", capsys.readouterr().out)
        assert said is not None
        assert float(said[1]) == float(proposed.get("stepSize", ""))


@needs_compiler
@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_a_joint_has_no_direct_feedthrough_from_torque_to_angle(model: DriveModel, tmp_path: Path, fmi: str) -> None:
    """In the declared dependencies and in the directional derivative."""
    path = export_fmu(model, tmp_path / "joint.fmu", backend="native", fmi=fmi, masses=TYPICAL_MASSES)
    outputs = fmpy.read_model_description(str(path)).outputs
    assert len(outputs) > 10
    for unknown in outputs:
        assert not {v.name for v in unknown.dependencies} & {"motor.tau", "load.tau"}
    with FmuDrive(path) as joint:
        joint.initialize({"motor.tau": 0.1})
        joint.step(1e-3)
        slopes = joint.derivative(joint.outputs, {"motor.tau": 1.0})
    assert set(slopes.values()) == {0.0}


@needs_compiler
def test_friction_follows_angles_without_speeds(full_model: DriveModel, unpacked: tuple[Path, Path, str]) -> None:
    """In model exchange, at events requested after integrator steps: the same states as in co-simulation."""
    along = [s.name for s in full_model.states if s.name not in ("creep.twist", "torque_sensor_drift.grown")]
    way = [3e-4 * np.sin(0.4 * k) for k in range(40)]
    with Exchange(unpacked[1], {}) as exchange, FmuDrive(unpacked[0]) as slave:
        slave.initialize()
        for k, angle in enumerate(way[1:]):
            moved = {"output.phi": angle, "crank.phi": -20 * angle}
            slave.step(1e-3, moved)
            exchange.set(moved)
            assert exchange.completed() == (True, False), k
            exchange.fmu.enterEventMode()
            _, _, _, changed, _, _ = exchange.fmu.newDiscreteStates()
            assert changed
            exchange.fmu.enterContinuousTimeMode()
            # The limit of friction at the crank is that of the load, which other states change at the same time.
            tolerance = [1e-8 if name == "crank_friction.deflection" else 1e-15 for name in along]
            difference = np.abs(np.subtract(exchange.get(along), list(slave.read(along).values())))
            assert (difference <= tolerance).all(), k
        # Without motion there is no event.
        assert exchange.completed() == (False, False)


@needs_compiler
def test_with_speeds_there_is_no_such_event(full_model: DriveModel, unpacked: tuple[Path, Path, str]) -> None:
    """Although the integrator has an error of one per cent of the path."""
    component = drive_component(full_model)
    p = component.parameter_vector()
    names, memory = [s.name for s in component.states], slice(0, component.n_indicators)
    with Exchange(unpacked[1], {}) as exchange:
        states = exchange.get(names)
        start = states[memory].copy()
        for k in range(1, 200):
            angle = 1e-3 * np.sin(0.1 * k)
            exchange.set({"output.phi": angle, "crank.phi": -20 * angle})
            there = np.array(component.initial([-20 * angle, 0, angle, 0, 20], p)).ravel()[memory]
            states[memory] = start + 0.99 * (there - start)
            exchange.set_states(states)
            assert exchange.completed() == (False, False), k


@needs_compiler
@pytest.mark.parametrize("fmi", ["2.0", "3.0"])
def test_states_that_may_jump_are_declared_reinit(full_model: DriveModel, tmp_path: Path, fmi: str) -> None:
    path = export_fmu(full_model, tmp_path / "d.fmu", backend="native", platform="none", fmi=fmi)
    jumping = {
        v.get("name")
        for v in description(path).iterfind("ModelVariables/*")
        if "true" in (v.get("reinit"), *(child.get("reinit") for child in v))
    }
    assert {"last.twist", "last.crank", "last.output", "hysteresis.deflection", "wear.travel"} <= jumping
    assert "creep.twist" not in jumping
