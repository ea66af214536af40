"""The equations of the joint and its python-control systems: physics, linearisation, names, invalid input."""

from __future__ import annotations

import subprocess
import sys

import control as ct
import numpy as np
import pytest
from scipy.linalg import expm

import stiffness_model as sm
from reefmu.fmu.model.component import drive_component
from reefmu.joint import JointModel, Masses, drive_system, joint_system, linearize, simulate_joint
from reefmu.joint.equations import DRIVE_INPUTS
from reefmu.model.drive_model import DriveModel, build_model
from stiffness_model.errors import InputError, UnknownNameError
from stiffness_model.lookup.build_lookup import Lookup

MASSES = Masses(motor_inertia=1e-4, load_inertia=2.0)
ELASTIC = {
    "backlash": {"clearance": 4e-6},
    "structural_compliance": {"compliance": 3e-6},
    "kinematic_error": {"amplitude_1": 2e-4, "phase_1": 0.4, "amplitude_2": 1e-4},
}
LOSSY = {**ELASTIC, "hysteresis": {"torque": 3.0, "presliding": 5e-5}, "viscous_friction": {"coefficient": 2.0}}


def free(_time: float, _motion: np.ndarray) -> tuple[float, float]:
    return 0.0, 0.0


@pytest.fixture(scope="module")
def joint(model: DriveModel) -> JointModel:
    return JointModel(model, MASSES)


@pytest.fixture(scope="module")
def lossy(drive: sm.Drive, lookup: Lookup) -> JointModel:
    return JointModel(build_model(drive, LOSSY, lookup=lookup), Masses(1e-4, 2.0, 1e-3, 0.5))


# -- physics -----------------------------------------------------------------------------------------------


def energy(joint: JointModel, elastic: DriveModel, motion: np.ndarray) -> np.ndarray:
    """Kinetic energy and that of the drive's springs, J; the latter is the integral of the torque."""
    values = {q.name: q.value for q in joint.drive.parameters}
    crank, crank_w, output, output_w = motion
    error = sum(
        values.get(f"kinematic_error.amplitude_{k}", 0.0)
        * np.sin(k * crank + values.get(f"kinematic_error.phase_{k}", 0.0))
        for k in (1, 2)
    )
    twist = crank / joint.ratio - output - error
    grid = np.linspace(-1.2, 1.2, 4001) * np.abs(twist).max()
    inputs = np.zeros((5, len(grid)))
    inputs[2] = -grid
    p = np.repeat(elastic.parameter_vector()[:, None], len(grid), axis=1)
    torque = np.asarray(elastic.output.map(len(grid))(np.zeros((0, len(grid))), inputs, p))[0]
    potential = np.concatenate([[0.0], np.cumsum((torque[1:] + torque[:-1]) / 2 * np.diff(grid))])
    kinetic = (joint.masses.motor_inertia * crank_w**2 + joint.masses.load_inertia * output_w**2) / 2
    return kinetic + np.interp(twist, grid, potential - potential.min())


def test_energy_is_conserved_without_dissipation(drive: sm.Drive, lookup: Lookup) -> None:
    """Also with backlash, a series spring, and a kinematic error, which changes the crank's torque."""
    joint = JointModel(build_model(drive, ELASTIC, lookup=lookup), MASSES)
    series = {k: v for k, v in ELASTIC.items() if k != "kinematic_error"}
    start, _ = joint.equilibrium(-150.0, crank_angle=0.7)
    start[1] = 3.0
    motion = simulate_joint(joint, free, step=2e-4, duration=0.06, start=start)
    total = energy(joint, build_model(drive, series, lookup=lookup), motion.values[:, :4].T)
    assert np.ptp(motion["output.tau"]) > 200, "the swing passes through the backlash"
    assert total == pytest.approx(np.full_like(total, total[0]), rel=3e-6)


def test_friction_dissipates_energy(lossy: JointModel) -> None:
    start, _ = lossy.equilibrium(-150.0)
    motion = simulate_joint(lossy, free, step=2e-4, duration=0.04, start=start)
    assert np.ptp(motion["output.tau"][-30:]) < 0.7 * np.ptp(motion["output.tau"][:30])


def test_energy_lost_is_the_work_of_friction_at_the_crank(drive: sm.Drive, lookup: Lookup) -> None:
    """Of a swing that the friction brakes; its work includes the energy that its elastic part stores."""
    friction = {"torque": 0.2, "fraction": 0.1, "stribeck": 0.3, "viscous": 1e-3}
    joint = JointModel(build_model(drive, {"crank_friction": friction}, lookup=lookup), MASSES)
    start, _ = joint.equilibrium(-150.0)
    motion = simulate_joint(joint, free, step=2e-5, duration=0.03, start=start)
    total = energy(joint, build_model(drive, {}, lookup=lookup), motion.values[:, :4].T)
    torque = -motion["crank.tau"] - motion["output.tau"] / joint.ratio
    power = torque * motion["crank.w"]
    work = np.concatenate([[0.0], np.cumsum((power[1:] + power[:-1]) / 2 * 2e-5)])
    assert total + work == pytest.approx(np.full_like(total, total[0]), abs=1e-3 * total[0])
    assert total[-1] < 0.7 * total[0]
    # Below the friction the crank stays where it is, apart from the friction's elastic deflection.
    held, _ = joint.equilibrium(4.0)
    rest = simulate_joint(joint, free, step=2e-4, duration=0.05, start=held)
    assert np.abs(rest["crank.phi"]).max() < 2 * 4 / 29 / 1000


def test_momentum_is_conserved(joint: JointModel) -> None:
    """Without a kinematic error the drive's torques do no work on a rotation without twist."""
    start, _ = joint.equilibrium(-100.0)
    motion = simulate_joint(joint, free, step=2e-4, duration=0.02, start=start)
    momentum = MASSES.motor_inertia * joint.ratio * motion["crank.w"] + MASSES.load_inertia * motion["output.w"]
    assert np.abs(momentum).max() < 1e-9 * MASSES.load_inertia * np.abs(motion["output.w"]).max()


@pytest.mark.parametrize("load", [0.0, -40.0, 180.0])
def test_equilibrium_is_at_rest(lossy: JointModel, load: float) -> None:
    x, u = lossy.equilibrium(load, crank_angle=1.1)
    system = joint_system(lossy)
    assert u[1] == load
    assert x[0] == 1.1
    assert system.dynamics(0, x, u) == pytest.approx(0, abs=1e-7)
    assert system.output(0, x, u)[4] == pytest.approx(-load, abs=1e-9)


def test_equilibrium_beyond_the_reach_of_a_start(joint: JointModel) -> None:
    """The drive carries a load that an FMU refuses at its start for its great twist, but no absurd one."""
    component, load = drive_component(joint.drive), -4 * joint.drive.full_torque
    assert component.start is not None
    _, greatest = np.asarray(component.start.limits([0, 0, 0, 0, 20], component.parameter_vector())).ravel()
    assert -load > greatest
    x, u = joint.equilibrium(load, crank_angle=1.1)
    assert joint_system(joint).dynamics(0, x, u) == pytest.approx(0, abs=1e-7)
    with pytest.raises(InputError, match=r"load_torque: expected a torque the drive can carry, got 1e\+15 N\.m"):
        joint.equilibrium(1e15)


@pytest.mark.parametrize("load", [0.0, -30.0, -200.0])
def test_eigenfrequency(joint: JointModel, lookup: Lookup, load: float) -> None:
    x, u = joint.equilibrium(load)
    stiffness = float(lookup.stiffness(lookup.twist_at(-load)))
    poles = linearize(joint, x, u).poles()
    motor, inertia = MASSES.motor_inertia * joint.ratio**2, MASSES.load_inertia
    assert poles.imag.max() == pytest.approx(np.sqrt(stiffness * (1 / motor + 1 / inertia)), rel=1e-9)
    assert MASSES.reduced_inertia(joint.ratio) == pytest.approx(1 / (1 / motor + 1 / inertia))


# -- linearisation -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("twist", [0.0, 2e-4, -1.5e-3, 0.02])
def test_linearised_drive_has_the_stiffness_of_the_lookup(model: DriveModel, lookup: Lookup, twist: float) -> None:
    linear = ct.linearize(drive_system(model), [], [0.3, 0, 0.3 / -29 - twist, 0, 20])
    stiffness = float(lookup.stiffness(twist))
    d = dict(zip(linear.output_labels, linear.D, strict=True))
    assert d["output_tau"] == pytest.approx([stiffness / -29, 0, -stiffness, 0, 0], rel=1e-11)
    assert d["crank_tau"] == pytest.approx([-stiffness / 29**2, 0, stiffness / -29, 0, 0], rel=1e-11)
    assert d["twist"] == pytest.approx([1 / -29, 0, -1, 0, 0], rel=1e-12)


def test_linearisation_is_the_derivative_of_the_dynamics(lossy: JointModel) -> None:
    """Against differences of the system's functions, in motion, where they are smooth."""
    x, u = lossy.equilibrium(-80.0, crank_angle=0.4)
    x[1], x[3], x[4] = -20.0, 0.9, 0.3
    system = joint_system(lossy)
    linear = ct.linearize(system, x, u)
    for k, h in enumerate([1e-6, 1e-3, 1e-8, 1e-4, 1e-4]):
        step = np.zeros(len(x))
        step[k] = h
        rates, outputs = ((f(0, x + step, u) - f(0, x - step, u)) / (2 * h) for f in (system.dynamics, system.output))
        assert linear.A[:, k] == pytest.approx(rates, rel=1e-5, abs=1e-5 * np.abs(linear.A[:, k]).max())
        assert linear.C[:, k] == pytest.approx(outputs, rel=1e-4, abs=1e-5 * np.abs(linear.C[:, k]).max())


def test_hysteresis_at_rest_has_its_presliding_stiffness(lossy: JointModel) -> None:
    x, u = lossy.equilibrium(0.0)
    linear = linearize(lossy, x, u)
    row = linear.state_labels.index("hysteresis_deflection")
    assert linear.A[row, 3] == pytest.approx(-1 / 5e-5, rel=1e-6)


def test_differences_of_an_interconnection_stay_close(joint: JointModel) -> None:
    """python-control linearises interconnections by differences of 1e-6: an error of 0.1 % in the stiffness."""
    gain = ct.StateSpace([], [], [], [[2.0]], inputs=["crank_phi"], outputs=["motor_tau"], name="gain")
    system = joint_system(joint)
    loop = ct.interconnect([system, gain], inputs=["load_tau"], outputs=["output_phi"], name="loop", check_unused=False)
    x, u = joint.equilibrium(-100.0)
    exact, near = ct.linearize(system, x, u).A, ct.linearize(loop, x, [u[1]]).A
    exact = exact + np.outer(linearize(joint, x, u).B[:, 0], [2.0, 0, 0, 0])
    assert near == pytest.approx(exact, rel=1e-3, abs=1e-6)


def test_parameters_by_their_names(model: DriveModel, joint: JointModel) -> None:
    x, u = joint.equilibrium(-60.0)
    changed = JointModel(model.with_parameters(band=1.0), Masses(1e-4, 5.0, load_damping=0.3))
    params = {"band": 1.0, "load.inertia": 5.0, "load.damping": 0.3}
    system, expected = joint_system(joint), linearize(changed, x, u)
    linear = ct.linearize(system, x, u, params=params)
    assert np.asarray(linear.A) == pytest.approx(np.asarray(expected.A))
    assert system.dynamics(0, x, u, params) == pytest.approx(joint_system(changed).dynamics(0, x, u))


# -- python-control ----------------------------------------------------------------------------------------


def test_signals_are_named_as_the_contract(model: DriveModel, lossy: JointModel) -> None:
    drive, joint = drive_system(model), joint_system(lossy)
    assert drive.input_labels == ["crank_phi", "crank_w", "output_phi", "output_w", "temperature"]
    assert drive.output_labels[:4] == ["output_tau", "crank_tau", "twist", "stiffness"]
    assert drive.output_labels[4:6] == ["max_contact_force", "load_share"]
    assert drive.name == "drive_1"
    assert joint.input_labels == ["motor_tau", "load_tau"]
    assert joint.output_labels == ["crank_phi", "crank_w", "output_phi", "output_w", *drive.output_labels]
    assert joint.state_labels == ["crank_phi", "crank_w", "output_phi", "output_w", "hysteresis_deflection"]
    assert joint.isctime()
    linear = linearize(lossy, *lossy.equilibrium(0.0))
    assert (linear.input_labels, linear.output_labels) == (joint.input_labels, joint.output_labels)
    assert len(DRIVE_INPUTS) == drive.ninputs


def test_python_control_integrates_as_our_own_integrator(lossy: JointModel) -> None:
    start, u = lossy.equilibrium(-80.0)
    start[3] += 0.05
    # Either method is of the first order only across a reversal of the twist: short steps make it negligible.
    own = simulate_joint(lossy, lambda _t, _x: (float(u[0]), -80.0), step=2e-4, duration=0.01, start=start, substeps=20)
    held = np.repeat(u[:, None], len(own.time), axis=1)
    theirs = ct.input_output_response(
        joint_system(lossy), own.time, held, start, solve_ivp_kwargs={"max_step": 2e-4, "rtol": 1e-8, "atol": 1e-11}
    )
    scale = np.ptp(own.values, axis=0)
    assert np.abs(np.asarray(theirs.outputs).T - own.values).max(axis=0) == pytest.approx(0, abs=2e-6 * scale.max())
    assert np.abs(np.asarray(theirs.outputs)[2] - own["output.phi"]).max() < 1e-5 * np.ptp(own["output.phi"])


def test_runge_kutta_converges_with_order_four(joint: JointModel) -> None:
    start, _ = joint.equilibrium(-100.0)
    ends = [
        simulate_joint(joint, free, step=1e-3, duration=1e-2, start=start, substeps=n).values[-1, 2] for n in (4, 8, 64)
    ]
    order = np.log2(abs(ends[0] - ends[2]) / abs(ends[1] - ends[2]))
    assert 3.3 < order < 5.0


# -- bad input ---------------------------------------------------------------------------------------------


def test_unknown_names_are_refused(model: DriveModel, joint: JointModel) -> None:
    with pytest.raises(TypeError, match="moter_inertia"):
        Masses(moter_inertia=1e-4, load_inertia=2.0)  # type: ignore[call-arg]
    with pytest.raises(TypeError, match="stiffness"):
        joint_system(joint, stiffness=1.0)  # type: ignore[call-arg]
    x, u = joint.equilibrium()
    with pytest.raises(UnknownNameError, match="did you mean 'band'"):
        ct.linearize(joint_system(joint), x, u, params={"bnad": 1.0})
    with pytest.raises(TypeError, match="colour"):
        ct.linearize(joint_system(joint), x, u, colour="red")
    with pytest.raises(InputError, match="no eps"):
        ct.linearize(drive_system(model), [], np.zeros(5), eps=1e-3)
    with pytest.raises(InputError, match="5 finite inputs"):
        ct.linearize(drive_system(model), [], np.zeros(4))


@pytest.mark.parametrize(
    "bad", [{"motor_inertia": 0.0}, {"load_inertia": -1.0}, {"motor_damping": np.nan}, {"load_damping": -1e-9}]
)
def test_impossible_masses_are_refused(bad: dict[str, float]) -> None:
    with pytest.raises(InputError, match=next(iter(bad))):
        Masses(**({"motor_inertia": 1e-4, "load_inertia": 2.0} | bad))


@pytest.mark.parametrize("step", [1e-6, 1e-4, 5e-3, 0.1])
@pytest.mark.parametrize("stiffness", [0.0, 1.3e5])
def test_masses_move_exactly(step: float, stiffness: float) -> None:
    masses = Masses(1e-4, 2.0, 1e-3, 0.5)
    a, b = masses.matrices(-29.0, stiffness)
    block = np.zeros((6, 6))
    block[:4, :4], block[:4, 4:] = a * step, b * step
    whole, size = expm(block), np.array([29, 29 / step, 1, 1 / step])
    phi, gamma = masses.step_matrices(step, -29.0, stiffness)
    assert phi / size[:, None] * size == pytest.approx(whole[:4, :4] / size[:, None] * size, abs=1e-9)
    assert gamma == pytest.approx(whole[:4, 4:], rel=1e-7, abs=1e-9 * np.abs(gamma).max())


def test_invalid_simulations_are_refused(joint: JointModel) -> None:
    with pytest.raises(InputError, match=r"load_torque: expected a finite torque"):
        joint.equilibrium(float("nan"))
    with pytest.raises(InputError, match="multiple of the step"):
        simulate_joint(joint, free, step=1e-3, duration=2.5e-3)
    with pytest.raises(InputError, match="a state of 4 finite numbers"):
        simulate_joint(joint, free, step=1e-3, duration=1e-2, start=np.zeros(3))
    with pytest.raises(InputError, match=r"controller at 0\.001 s: expected two finite torques"):
        simulate_joint(joint, lambda t, _x: (np.nan if t else 0.0, 0.0), step=1e-3, duration=1e-2)
    with pytest.raises(InputError, match="controller at 0 s"):
        simulate_joint(joint, lambda _t, _x: None, step=1e-3, duration=1e-2)  # type: ignore[arg-type,return-value]


def test_the_package_imports_no_heavy_module() -> None:
    code = "import sys, reefmu.joint; print(sorted({'control', 'casadi', 'fmpy'} & set(sys.modules)))"
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert out.stdout.strip() == "[]"
