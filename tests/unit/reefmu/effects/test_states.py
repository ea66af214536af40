"""States: steps of any length, rates in continuous time, and states that continue from run to run."""

from __future__ import annotations

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.effects import EFFECTS
from reefmu.model.drive_model import DriveModel
from reefmu.record import make_record
from reefmu.simulate import record_inputs, simulate_record, simulate_signal

from .conftest import Build, Trajectory

WITH_STATES = sorted(name for name, effect in EFFECTS.items() if effect.states)


def called(function, *arguments) -> np.ndarray:
    return np.array(function(*arguments)).ravel()


def moved(model: DriveModel, first: np.ndarray, last: np.ndarray, time: float, steps: int) -> np.ndarray:
    """States after a linear motion in that many steps."""
    p = model.parameter_vector()
    x = called(model.initial, first, p)
    for k in range(1, steps + 1):
        x = called(model.advance, x, first + (last - first) * k / steps, time / steps, p)
    return x


@pytest.mark.parametrize("name", [name for name in WITH_STATES if name != "creep"])
def test_one_step_equals_many(name: str, build: Build, typical, drive: sm.Drive) -> None:
    model = build({name: typical[name]})
    first, last = np.array([0.3, 0.1, -0.004, 0.02, 25.0]), np.array([0.5, 0.1, -0.0042, 0.02, 25.0])
    if any(state.depends_on_load for state in EFFECTS[name].states):
        last[2] = first[2] + (last[0] - first[0]) / drive.ratio  # the load of a step is that at its end
    one, many = (moved(model, first, last, 0.7, steps) for steps in (1, 1000))
    assert one == pytest.approx(many, rel=1e-9, abs=1e-15)
    assert np.abs(one).max() > 0


def test_long_steps_of_creep(build: Build, drive: sm.Drive) -> None:
    """With inputs held: exact for linear contacts; otherwise of second order, with the right equilibrium."""
    model = build(creep={"compliance": 1e-6, "time": 10.0})
    still = np.array([0.0, 0.0, -0.75 * drive.max_twist, 0.0, 20.0])
    for step, bound in ((0.1, 2e-7), (1.0, 2e-5), (10.0, 1e-3), (1e4, 4e-3)):
        one, many = (moved(model, still, still, step, steps) for steps in (1, 1000))
        assert one == pytest.approx(many, rel=bound), step
    stiff = build(creep={"compliance": 1e-4, "time": 10.0})  # hundreds of times softer than the contacts
    q = moved(stiff, still, still, 1e9, 30)[0]
    tau = called(stiff.output, [q], still, stiff.parameter_vector())[0]
    assert q == pytest.approx(1e-4 * tau, rel=1e-9), "long steps end at rest"


@pytest.mark.parametrize("names", [[name] for name in WITH_STATES] + [WITH_STATES], ids=lambda n: "+".join(n)[:20])
def test_rate_is_the_limit_of_short_steps(names: list[str], build: Build, typical, trajectory: Trajectory) -> None:
    model = build({name: typical[name] for name in names} | {"kinematic_error": {"amplitude_1": 1e-5}})
    p, dt = model.parameter_vector(), 1e-8
    states = simulate_signal(model, trajectory.time, trajectory.inputs).states
    for k in range(5, 395, 30):
        u = trajectory.inputs[k]
        moving = np.array([u[1], 0.0, u[3], 0.0, 0.0])
        x, ahead = states[k], called(model.advance, states[k], u + dt * moving, dt, p)
        rate = called(model.rate, x, u, p)
        assert (ahead - x) / dt == pytest.approx(rate, rel=5e-3, abs=1e-6 * np.abs(rate).max() + 1e-9)


def test_travel_and_drift_continue_from_run_to_run(build: Build, drive: sm.Drive) -> None:
    time = np.array([0.0, 1, 2, 3, 5, 6, 7, 0, 1, 2])
    run = np.array([1, 1, 1, 1, 2, 2, 2, 3, 3, 3])
    crank = np.array([0.0, 1, 2, 1, 11, 11, 12, 12, 12, 12])
    output = crank / drive.ratio - np.array([0, 1, 2, 1, 0, 1, 2, 0, 1, 2]) * 5e-4
    record = make_record(
        {"time": time, "run": run, "crank_angle": crank, "output_angle": output, "output_torque": np.zeros(10)}
    )
    model = build(wear={"rate": 1e-7}, torque_sensor_drift={"rate": 0.5}, hysteresis={"torque": 4.0})
    response = simulate_record(model, record)
    named = {s.name: response.states[:, k] for k, s in enumerate(model.states)}
    # The crank moves ten radians between the first two runs; the clock of the third starts again.
    assert named["wear.travel"] == pytest.approx([0, 1, 2, 3, 13, 13, 14, 14, 14, 14])
    assert named["torque_sensor_drift.grown"] == pytest.approx([0, 1, 2, 3, 5, 6, 7, 7, 8, 9])
    assert (named["hysteresis.deflection"][[0, 4, 7]] == 0).all(), "all else starts anew"
    assert np.abs(named["hysteresis.deflection"][[3, 6, 9]]).min() > 0.9
    extra = response["measured.tau"] - response["output.tau"]
    assert extra == pytest.approx(0.5 * named["torque_sensor_drift.grown"])


def test_runs_are_independent_without_such_states(build: Build, trajectory: Trajectory) -> None:
    model = build(hysteresis={"torque": 4.0}, creep={"compliance": 1e-6})
    assert model.resets.all()
    record = make_record(
        {
            "time": trajectory.time,
            "run": np.arange(400) // 100,
            "crank_angle": trajectory.crank,
            "output_angle": trajectory.output,
            "output_torque": trajectory.twist,
            "temperature": trajectory.inputs[:, 4],
        }
    )
    whole = simulate_record(model, record).outputs
    alone = simulate_signal(model, trajectory.time[100:200], record_inputs(record)[100:200]).outputs
    assert np.array_equal(whole[100:200], alone)
