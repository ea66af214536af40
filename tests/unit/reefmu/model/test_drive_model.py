"""The drive model: lookup, places of the effects, exact states, neutral effects, derivatives."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

import stiffness_model as sm
from reefmu.effects import EFFECTS
from reefmu.joint import JointModel, Masses
from reefmu.model.drive_model import DriveModel, build_model
from reefmu.model.signals import INPUTS, OUTPUTS
from reefmu.simulate import inputs_at_twist, simulate_signal
from stiffness_model.lookup.build_lookup import Lookup

TAU = [s.name for s in OUTPUTS].index("output.tau")
LOADED = {
    "backlash": {"clearance": 4e-6},
    "preload": {"clearance": 1e-6},
    "structural_compliance": {"compliance": 5e-6},
    "hysteresis": {"torque": 6.0, "presliding": 4e-5},
    "kinematic_error": {"amplitude_1": 1e-4, "phase_1": 0.4, "amplitude_3": 3e-5},
}


@pytest.fixture(scope="module")
def loaded(drive: sm.Drive, lookup: Lookup) -> DriveModel:
    return build_model(drive, LOADED, lookup=lookup)


def wander(n: int, seed: int = 3) -> np.ndarray:
    """Random inputs (n, 5) that cover the range: crank and output both move."""
    rng = np.random.default_rng(seed)
    crank = np.cumsum(rng.normal(0, 0.05, n))
    twist = 0.003 * np.sin(np.cumsum(rng.normal(0, 0.3, n)))
    speeds = rng.normal(0, 1, (2, n))
    return np.stack([crank, speeds[0], crank / -29 - twist, speeds[1], np.full(n, 20.0)], axis=1)


def test_plain_model_is_the_lookup(model: DriveModel, lookup: Lookup) -> None:
    twist = np.linspace(-1.2, 1.2, 301) * lookup.twist.stop
    response = simulate_signal(model, np.arange(301.0), inputs_at_twist(twist, model))
    scale = lookup.full_torque
    assert response["output.tau"] == pytest.approx(lookup.torque(twist), abs=1e-12 * scale)
    assert response["stiffness"] == pytest.approx(lookup.stiffness(twist), rel=1e-9)
    assert response["twist"] == pytest.approx(twist, abs=1e-15)
    assert response["max_contact_force"] == pytest.approx(lookup.max_contact_force(twist), rel=1e-9)
    assert response["load_share"] == pytest.approx(lookup.load_share(twist), rel=1e-9)
    assert (response["in_range"] == lookup.in_range(twist)).all()


def test_band_and_clearance_reach_the_lookup(drive: sm.Drive, lookup: Lookup) -> None:
    model = build_model(drive, {"backlash": {"clearance": 6e-6}, "preload": {"clearance": 2e-6}}, lookup=lookup)
    model = model.with_parameters(band=0.7)
    twist = np.linspace(-1, 1, 101) * drive.max_twist
    tau = simulate_signal(model, np.arange(101.0), inputs_at_twist(twist, model))["output.tau"]
    assert tau == pytest.approx(lookup.torque(twist, 4e-6, 0.7), abs=1e-10 * lookup.full_torque)


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_a_neutral_effect_changes_no_bit(name: str, drive: sm.Drive, lookup: Lookup, model: DriveModel) -> None:
    u = wander(300)
    time = np.cumsum(np.random.default_rng(1).uniform(1e-4, 0.1, 300))
    with_effect = build_model(drive, {name: {}}, lookup=lookup)
    assert (simulate_signal(with_effect, time, u).outputs == simulate_signal(model, time, u).outputs).all()


def test_all_places_against_a_loop_in_numpy(loaded: DriveModel, lookup: Lookup) -> None:
    u, z, last = wander(200), 0.0, None
    expected = []
    for crank, _, output, _, _ in u:
        between_shafts = crank / -29 - output
        step = 0.0 if last is None else between_shafts - last
        z = np.sign(step) + (z - np.sign(step)) * np.exp(-abs(step) / 4e-5)
        last = between_shafts
        twist = between_shafts - 1e-4 * np.sin(crank + 0.4) - 3e-5 * np.sin(3 * crank)
        low, high = twist - 0.01, twist + 0.01
        for _ in range(80):  # contact twist by bisection
            middle = (low + high) / 2
            if middle + 5e-6 * float(lookup.torque(middle, 3e-6)) > twist:
                high = middle
            else:
                low = middle
        expected.append(float(lookup.torque(low, 3e-6)) + 6.0 * z)
    tau = simulate_signal(loaded, np.arange(200.0), u)["output.tau"]
    assert tau == pytest.approx(np.array(expected), abs=1e-9 * lookup.full_torque)


@settings(max_examples=40, deadline=None)
@given(softness=st.floats(0, 3), share=st.floats(-2, 2), clearance=st.floats(-1, 1))
def test_series_twists_add_up(drive: sm.Drive, lookup: Lookup, softness: float, share: float, clearance: float) -> None:
    compliance = softness / float(lookup.stiffness(drive.max_twist))
    shift = {"backlash" if clearance > 0 else "preload": {"clearance": abs(clearance) * lookup.clearance.stop}}
    model = build_model(drive, {"structural_compliance": {"compliance": compliance}, **shift}, lookup=lookup)
    twist = share * drive.max_twist
    tau = float(simulate_signal(model, [0.0], inputs_at_twist(twist, model))["output.tau"][0])
    contact = float(lookup.torque(twist - compliance * tau, clearance * lookup.clearance.stop))
    assert tau == pytest.approx(contact, abs=1e-9 * lookup.full_torque)


def test_one_step_equals_many_along_the_same_path(loaded: DriveModel) -> None:
    p = loaded.parameter_vector()
    first, last = inputs_at_twist([0.0, 0.001], loaded)
    x = loaded.initial(first, p)
    whole = np.array(loaded.advance(x, last, 0.1, p)).ravel()
    for share in np.linspace(0, 1, 38)[1:]:
        x = loaded.advance(x, first + share * (last - first), 0.1 / 37, p)
    assert np.array(x).ravel() == pytest.approx(whole, abs=1e-12)


def test_rate_is_the_limit_of_the_step(loaded: DriveModel) -> None:
    p, h = loaded.parameter_vector(), 1e-7
    u = np.array([0.3, 2.0, -0.0095, 0.01, 20.0])
    x = loaded.advance(loaded.initial(u - [0.01, 0, 0, 0, 0], p), u, 0.1, p)
    later = u + h * np.array([2.0, 0, 0.01, 0, 0])
    difference = (np.array(loaded.advance(x, later, h, p)) - np.array(x)).ravel() / h
    assert np.array(loaded.rate(x, u, p)).ravel() == pytest.approx(difference, rel=1e-4)


def test_loop_is_dissipative_and_of_the_right_width(drive: sm.Drive, lookup: Lookup) -> None:
    model = build_model(drive, {"hysteresis": {"torque": 6.0, "presliding": 2e-5}}, lookup=lookup)
    phase = np.linspace(0, 6 * np.pi, 6001)
    twist = 0.002 * np.sin(phase)
    tau = simulate_signal(model, phase, inputs_at_twist(twist, model))["output.tau"]
    turn = phase > 4 * np.pi
    work = float(np.trapezoid(tau[turn], twist[turn]))
    presliding_loss = 4 * 6.0 * 0.002 - work
    assert 0 < presliding_loss < 8 * 6.0 * 2e-5
    rising = np.gradient(twist) > 0
    middle = turn & (np.abs(twist) < 2e-5)
    width = tau[middle & rising].mean() - tau[middle & ~rising].mean()
    assert width == pytest.approx(12.0, rel=0.05)


def test_jacobian_and_stiffness_are_the_derivatives(loaded: DriveModel) -> None:
    p = loaded.parameter_vector()
    for u in wander(20, seed=9):
        x = loaded.advance(loaded.initial(u - [0.02, 0, 0, 0, 0], p), u, 0.01, p)
        jacobian = np.array(loaded.jacobian(x, u, p))
        for column, h in ((0, 1e-7), (2, 1e-9)):
            step = np.zeros(5)
            step[column] = h
            difference = (np.array(loaded.output(x, u + step, p)) - np.array(loaded.output(x, u - step, p))) / (2 * h)
            assert jacobian[:2, column] == pytest.approx(difference[:2, 0], rel=1e-5, abs=1e-3)
        y = np.array(loaded.output(x, u, p)).ravel()
        assert y[3] == pytest.approx(-jacobian[TAU, 2], rel=1e-8)


def test_power_balance_without_losses(drive: sm.Drive, lookup: Lookup) -> None:
    """Virtual work: over any closed path the work of crank and output torque is zero."""
    model = build_model(
        drive,
        {
            "kinematic_error": LOADED["kinematic_error"],
            "backlash": LOADED["backlash"],
            "structural_compliance": LOADED["structural_compliance"],
        },
        lookup=lookup,
    )
    s = np.linspace(0, 2 * np.pi, 20001)
    crank = 2.0 * np.sin(s)
    output = crank / -29 - 0.002 * np.cos(2 * s)
    zeros = np.zeros_like(s)
    y = simulate_signal(model, s, np.stack([crank, zeros, output, zeros, zeros + 20], axis=1))
    work = np.trapezoid(y["crank.tau"], crank) + np.trapezoid(y["output.tau"], output)
    through = np.trapezoid(np.abs(y["output.tau"] * np.gradient(output, s)), s)
    assert abs(work) < 1e-6 * through


def test_losses_beside_a_kinematic_error_are_the_work_along_the_twist(drive: sm.Drive, lookup: Lookup) -> None:
    """What the torques of crank and output lose over a closed path is what hysteresis and damping take along the twist
    between the shafts; this is positive whatever the kinematic error does to the contacts."""
    effects = {
        "kinematic_error": {"amplitude_1": 4e-4, "phase_1": 0.4},
        "hysteresis": {"torque": 6.0, "presliding": 2e-5},
        "damping": {"coefficient": 3e3},
    }
    model = build_model(drive, effects, lookup=lookup)
    s = np.linspace(0, 2 * np.pi, 20001)
    crank, twist = 2.0 * np.sin(s), 3e-4 * np.cos(s)
    output = crank / -29 - twist
    speed, output_speed = 2.0 * np.cos(s), 2.0 * np.cos(s) / -29 + 3e-4 * np.sin(s)
    y = simulate_signal(model, s, np.stack([crank, speed, output, output_speed, 0 * s + 20], axis=1))
    lost = -np.trapezoid(y["crank.tau"], crank) - np.trapezoid(y["output.tau"], output)
    damped = 3e3 * 3e-4**2 * np.pi
    rubbed = 6.0 * 4 * 3e-4
    assert lost == pytest.approx(damped + rubbed, abs=8 * 6.0 * 2e-5)


def test_drives_with_negative_and_positive_ratio_have_their_sign(lookup: Lookup) -> None:
    together = sm.load_drive("drive_1", lobes=28)
    model = build_model(together, lookup=lookup)
    u = np.array([[0.02, 0, 0, 0, 20.0]])
    y = simulate_signal(model, [0.0], u)
    assert y["twist"][0] == pytest.approx(0.02 / 29)
    assert y["output.tau"][0] > 0
    assert y["crank.tau"][0] == pytest.approx(-y["output.tau"][0] / 29)


def test_parameters_are_checked(loaded: DriveModel) -> None:
    with pytest.raises(sm.UnknownNameError, match=r"did you mean 'backlash.clearance'"):
        loaded.with_parameters({"backlash.clearence": 1e-6})
    with pytest.raises(sm.InputError, match=r"expected a value within 0 \.\.\. 0\.001 m"):
        loaded.with_parameters({"backlash.clearance": -1e-6})
    with pytest.raises(sm.InputError, match="finite number"):
        loaded.with_parameters({"hysteresis.torque": float("nan")})
    with pytest.raises(sm.UnknownNameError, match=r"unknown tunable parameter .ratio."):
        loaded.with_parameters(ratio=30.0)
    with pytest.raises(sm.UnknownNameError, match="did you mean 'hysteresis'"):
        build_model(loaded.drive, {"hysterisis": {}}, lookup=loaded.lookup)


def test_signal_names_are_those_of_the_contract() -> None:
    assert [s.name for s in INPUTS] == ["crank.phi", "crank.w", "output.phi", "output.w", "temperature"]
    assert [s.name for s in OUTPUTS][:6] == [
        "output.tau",
        "crank.tau",
        "twist",
        "stiffness",
        "max_contact_force",
        "load_share",
    ]


def test_functions_generate_c_code_without_casadi(loaded: DriveModel, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("code")
    generator = ca.CodeGenerator("drive.c")
    for name in ("initial", "advance", "output", "rate", "jacobian"):
        generator.add(getattr(loaded, name))
    source = (folder / generator.generate(f"{folder}/").rsplit("/", 1)[-1]).read_text()
    assert "casadi.hpp" not in source
    assert "int output(" in source


def test_a_name_is_read_as_its_drawing(lookup: Lookup) -> None:
    assert build_model("drive_1", lookup=lookup).drive == sm.load_drive("drive_1")
    with pytest.raises(sm.UnknownNameError, match="did you mean 'drive_1'"):
        build_model("drive1", lookup=lookup)


def test_models_and_joints_are_values(drive: sm.Drive, lookup: Lookup) -> None:
    one, same = (build_model(drive, {"backlash": {"clearance": 3e-6}}, lookup=lookup) for _ in range(2))
    other = one.with_parameters({"backlash.clearance": 4e-6})
    assert one == same
    assert hash(one) == hash(same)
    assert one != other
    assert one != build_model(drive, {"backlash": {"clearance": 3e-6}}, lookup=replace(lookup, seed=lookup.seed + 1))
    assert len({JointModel(model, Masses(1e-4, 1.0)) for model in (one, same, other)}) == 2
    assert len({*one.effects, *same.effects}) == 1
