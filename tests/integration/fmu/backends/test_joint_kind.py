"""Kind `joint`: the drive between the inertias of motor and load, in both back ends."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from reefmu.cli import main
from reefmu.effects import EFFECTS
from reefmu.fmu.export import export_fmu
from reefmu.fmu.importer.instance import FmuDrive
from reefmu.fmu.model.component import Component
from reefmu.fmu.model.joint_component import joint_component
from reefmu.fmu.validation.fmu_check import check_fmu
from reefmu.joint.equations import JointModel, count_effect_states
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.masses import Masses
from stiffness_model.lookup.build_lookup import Lookup

HAS_COMPILER = any(shutil.which(name) for name in ("cc", "gcc", "clang"))
MASSES = Masses(1e-4, 1.0)
TWIST = 1.2e-3


@pytest.fixture(scope="module")
def plain(drive: object, lookup: Lookup) -> DriveModel:
    return build_model(drive, lookup=lookup)  # type: ignore[arg-type]


def started(component: Component, **values: float) -> np.ndarray:
    """Parameters for a start at rest with a twist, and with these values ('__' for the dot in a name)."""
    p = component.parameter_vector()
    names = [q.name for q in component.parameters]
    for name, value in {"start__output__phi": -TWIST, **values}.items():
        p[names.index(name.replace("__", "."))] = value
    return p


def energy(component: Component, p: np.ndarray, x: np.ndarray) -> float:
    """Kinetic energy and the integral of the torque over the twist from zero to that of x, J."""
    names = [q.name for q in component.parameters]
    motor, load, ratio = (p[names.index(name)] for name in ("motor.inertia", "load.inertia", "ratio"))
    twist = x[0] / ratio - x[2]
    nodes, weights = np.polynomial.legendre.leggauss(16)
    edges = np.linspace(0.0, twist, 65)
    at = ((edges[1:] + edges[:-1]) / 2 + np.outer(nodes, np.diff(edges) / 2)).ravel()
    states = np.zeros((len(x), len(at)))
    states[2] = -at
    torque = np.array(component.output.map(len(at))(states, np.zeros((2, len(at))), np.tile(p[:, None], len(at))))[4]
    return float(
        0.5 * motor * x[1] ** 2
        + 0.5 * load * x[3] ** 2
        + np.sum(torque * np.outer(weights, np.diff(edges) / 2).ravel())
    )


@pytest.mark.parametrize("step", [1e-5, 1e-3, 1 / 60, 0.1])
def test_energy_is_conserved(plain: DriveModel, step: float) -> None:
    """To 1e-6, over more than 10 cycles, with every step size."""
    component = joint_component(plain, MASSES)
    p = started(component)
    x = np.array(component.initial([0, 0], p)).ravel()
    first = energy(component, p, x)
    turned = 0
    for k in range(max(1, round(0.1 / step)) if step > 1e-4 else 1000):
        x, before = np.array(component.step(x, [0, 0], step, p)).ravel(), x
        turned += before[3] * x[3] < 0
        if step > 1e-4 or k % 37 == 0:
            assert energy(component, p, x) == pytest.approx(first, rel=1e-6)
    if step == 1e-3:
        assert turned > 20


@pytest.mark.slow
@pytest.mark.skipif(not HAS_COMPILER, reason="no C compiler on the PATH")
def test_the_native_joint_conserves_energy(plain: DriveModel, tmp_path: Path) -> None:
    """To 1e-6 over 80 cycles."""
    component = joint_component(plain, MASSES)
    p = started(component)
    first = energy(component, p, np.array(component.initial([0, 0], p)).ravel())
    path = export_fmu(plain, tmp_path / "joint.fmu", backend="native", masses=MASSES)
    turned, speed = 0, 0.0
    with FmuDrive(path, parameters={"start.output.phi": -TWIST}) as joint:
        joint.initialize()
        for k in range(500):
            outputs = joint.step(1e-3)
            turned, speed = turned + (speed * outputs["output.w"] < 0), outputs["output.w"]
            if k % 23 == 0:
                x = np.array(list(joint.read([s.name for s in component.states]).values()))
                assert energy(component, p, x) == pytest.approx(first, rel=1e-6)
    assert turned > 150


def test_one_long_step_equals_many_short_ones(plain: DriveModel) -> None:
    component = joint_component(plain, MASSES)
    p = started(component)
    ends = []
    for parts in (1, 7, 300):
        x = component.initial([0, 0], p)
        for _ in range(parts):
            x = component.step(x, [0.1, -3.0], 0.02 / parts, p)
        ends.append(np.array(x).ravel())
    speed = np.abs(ends[0][3])
    np.testing.assert_allclose(ends[0][3], ends[2][3], atol=1e-4 * speed)
    np.testing.assert_allclose(ends[0][2], ends[2][2], atol=1e-5 * TWIST)
    np.testing.assert_allclose(ends[0][2], ends[1][2], atol=1e-5 * TWIST)


def test_the_integrator_has_order_four(plain: DriveModel) -> None:
    component = joint_component(plain, MASSES)
    p = started(component)
    # A thirtieth of a cycle, within which the lookup is smooth enough.
    ends = []
    for parts in (2, 4, 64):
        x = component.initial([0, 0], p)
        for _ in range(parts):
            x = component.advance(x, [0, 0], 1e-3 / parts, p)
        ends.append(np.array(x).ravel()[3])
    coarse, fine = abs(ends[0] - ends[2]), abs(ends[1] - ends[2])
    assert coarse / fine > 10


def test_the_rate_is_that_of_the_joint_under_control(drive: object, lookup: Lookup) -> None:
    """The same equations as in reefmu.joint, in the form of the splitting method."""
    model = build_model(drive, {n: {} for n in EFFECTS}, lookup=lookup)  # type: ignore[arg-type]
    sizes = {
        q.name: float(np.clip(q.nominal, q.minimum, q.maximum))
        for q in model.parameters
        if q.tunable and q.minimum is not None and q.maximum is not None
    }
    model = model.with_parameters({**sizes, "band": 0.0})
    masses = Masses(2e-4, 0.7, 1e-3, 0.2)
    component = joint_component(model, masses)
    equations = JointModel(model, masses, 20.0).equations
    rng = np.random.default_rng(1)
    own = count_effect_states(model)
    x = np.array(component.initial([0, 0], started(component))).ravel()
    x[:4] += rng.normal(size=4) * [1e-3, 1.0, 1e-4, 0.1]
    if own:
        x[-own:] += 1e-6 * rng.normal(size=own)
    came = np.array(component.rate(x, [0.3, -5.0], started(component))).ravel()
    p = np.array(list(equations.parameters.values()))
    inner = np.concatenate([x[:4], x[len(x) - own :]])
    expected = np.array(equations.rate(inner, [0.3, -5.0], p)).ravel()
    np.testing.assert_allclose(np.concatenate([came[:4], came[len(came) - own :]]), expected, rtol=1e-9, atol=1e-12)


@pytest.fixture(scope="module")
def sluggish(drive: object, lookup: Lookup) -> tuple[DriveModel, Masses]:
    """Dampings a hundred times beyond the stability of an explicit step, and friction."""
    model = build_model(
        drive,
        {
            "damping": {"coefficient": 1e4},
            "viscous_friction": {"coefficient": 100.0},
            "coulomb_friction": {"torque": 5.0},
        },
        lookup=lookup,
    )  # type: ignore[arg-type]
    return model, Masses(1e-4, 0.1, 1.0, 10.0)


def test_strong_damping_never_adds_energy(sluggish: tuple[DriveModel, Masses]) -> None:
    component = joint_component(*sluggish)
    p = started(component, start__crank__w=100.0)
    x = np.array(component.initial([0, 0], p)).ravel()
    for _ in range(200):
        x = np.array(component.step(x, [0, 0], 1e-4, p)).ravel()
        assert np.abs(x[[1, 3]]).max() <= 110.0


@pytest.mark.slow
@pytest.mark.skipif(not HAS_COMPILER, reason="no C compiler on the PATH")
def test_strong_damping_and_friction_come_to_rest(sluggish: tuple[DriveModel, Masses], tmp_path: Path) -> None:
    """The twist decays slowly (half a second) and monotonically against the dampers, equally with any step size."""
    path = export_fmu(sluggish[0], tmp_path / "sluggish.fmu", backend="native", masses=sluggish[1])
    speeds = []
    for step in (1e-3, 1e-2, 0.3):
        with FmuDrive(path, parameters={"start.output.phi": -TWIST, "start.crank.w": 100.0}) as joint:
            joint.initialize()
            seen = []
            for k in range(round(3.0 / step)):
                outputs = joint.step(step)
                if (k + 1) % round(0.3 / step) == 0:
                    seen.append([outputs["crank.w"], outputs["output.w"]])
        speeds.append(seen)
    fastest = np.abs(np.array(speeds)).max(axis=2)
    assert (np.diff(fastest, axis=1) < 0).all()
    assert (fastest[:, 2:] < 1e-2).all()
    assert (fastest[:, -1] < 1e-4).all()
    np.testing.assert_allclose(fastest[1:], fastest[:1].repeat(2, axis=0), rtol=1e-3)


def test_agreement_with_an_integrator_of_scipy(plain: DriveModel) -> None:
    component = joint_component(plain, Masses(1e-4, 1.0, 1e-3, 2.0))
    p = started(component)
    x = np.array(component.initial([0, 0], p)).ravel()
    u = [0.2, -2.0]
    exact = solve_ivp(
        lambda _, y: np.array(component.rate(y, u, p)).ravel(), (0, 0.02), x, rtol=1e-10, atol=1e-14, method="DOP853"
    ).y[:, -1]
    came = np.array(component.step(x, u, 0.02, p)).ravel()
    np.testing.assert_allclose(came[3], exact[3], atol=1e-4 * np.abs(exact[3]))
    np.testing.assert_allclose(came[2], exact[2], atol=1e-5 * TWIST)


@pytest.mark.slow
@pytest.mark.parametrize(
    "backend",
    ["python", pytest.param("native", marks=pytest.mark.skipif(not HAS_COMPILER, reason="no C compiler on the PATH"))],
)
def test_both_back_ends(model: DriveModel, plain: DriveModel, backend: str, tmp_path: Path) -> None:
    # With effects the Python back end is right as well, but slow.
    path = export_fmu(model if backend == "native" else plain, tmp_path / "joint.fmu", backend=backend, masses=MASSES)
    report = check_fmu(path)
    assert report.passed, str(report)
    with FmuDrive(path, parameters={"motor.inertia": 2e-4}) as joint:
        assert joint.inputs == ("motor.tau", "load.tau")
        assert {"crank.phi", "crank.w", "output.phi", "output.w", "output.tau", "twist", "stiffness"} <= set(
            joint.outputs
        )
        assert {"motor.inertia", "load.inertia", "motor.damping", "load.damping", "band", "ratio"} <= set(
            joint.parameters
        )
        joint.initialize()
        outputs = joint.step(0.5, {"motor.tau": 0.05, "load.tau": 0.0})
        # Both masses turn together under the motor's torque.
        ratio = joint.read(["ratio"])["ratio"]
        expected = 0.05 * ratio * 0.5 / (2e-4 * ratio**2 + 1.0)
        assert outputs["output.w"] == pytest.approx(expected, rel=0.2)
        assert outputs["twist"] == pytest.approx(outputs["crank.phi"] / ratio - outputs["output.phi"], abs=1e-15)


@pytest.mark.slow
def test_export_warns_of_a_step_too_long_for_the_spring(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["export", "drive_1", "-o", str(tmp_path / "d.fmu"), "--load-inertia", "2"]
    assert main(words) == 0
    assert "communication step 0.001 s: a master that holds the drive's torque" in capsys.readouterr().err
    assert main([*words, "--step", "1e-7"]) == 0
    assert "communication step" not in capsys.readouterr().err
    assert main([*words, "--load-inertia", "-2"]) == 2
    assert "load_inertia: expected a positive inertia" in capsys.readouterr().err
    assert main([*words, "--kind", "joint"]) == 0
    assert "kind joint" in capsys.readouterr().out
