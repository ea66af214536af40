"""Friction that sticks: no drift below break-away, break-away at its torque, Coulomb and Stribeck beyond, passive."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest

import stiffness_model as sm
from reefmu.effects.friction.elastoplastic import ELASTIC_SHARE
from reefmu.model.drive_model import DriveModel
from reefmu.simulate import simulate_signal
from stiffness_model.numerics.arrays import Array

from .conftest import Build

TORQUE, STIFFNESS, RETARDATION = 20.0, 1e5, 5e-4
INERTIA = 1.0
"""kg.m2 on the output; with the stiffness it oscillates with a period of 20 ms."""
LOOSE = {"backlash": {"clearance": 2e-5}}
"""Play beyond the motions of these tests, so that friction alone holds the load."""


def sticking(build: Build, **values: float) -> DriveModel:
    friction = {"torque": TORQUE, "stiffness": STIFFNESS, "retardation": RETARDATION, **values}
    return build({**LOOSE, "elastoplastic_friction": friction})


def held(model: DriveModel, load: Array, step: float) -> Array:
    """Angle of the output, (n,) rad, of an inertia under a load, (n,) N.m, with the crank locked; at rest at first."""
    p, n_x = model.parameter_vector(), len(model.states)
    z, torque = ca.MX.sym("z", 2 + n_x), ca.MX.sym("torque")
    angle, speed, x = z[0], z[1], z[2:]
    moved = angle + step * speed
    u = ca.vertcat(0, 0, moved, speed, 20)
    after = model.advance(x, u, step, p)
    faster = speed + step / INERTIA * (torque + model.output(after, u, p)[0])
    advance = ca.Function("advance", [z, torque], [ca.vertcat(moved, faster, after)])
    start = np.concatenate([[0.0, 0.0], np.array(model.initial(np.array([0.0, 0, 0, 0, 20]), p)).ravel()])
    return np.array(advance.mapaccum(len(load))(start, load[None]))[0]


@pytest.mark.slow
def test_a_load_below_break_away_does_not_creep(build: Build) -> None:
    """100 s of a load that alternates within the elastic share; by the model of Dahl it slides through the play."""
    step = 1e-3
    time = step * np.arange(100_000)
    load = np.minimum(time, 1) * (10 + 3.5 * np.sin(2 * np.pi * 7 * time))
    angle = held(sticking(build), load, step)
    elastic = 10 / STIFFNESS
    assert np.abs(angle).max() < 1.5 * elastic
    assert np.abs(angle[-1000:].mean() - angle[2000:3000].mean()) < 1e-3 * elastic
    presliding = TORQUE / STIFFNESS
    creeping = held(build({**LOOSE, "coulomb_friction": {"torque": TORQUE, "presliding": presliding}}), load, step)
    assert creeping[-1] > 10 * elastic


@pytest.mark.parametrize("excess", [0.0, 0.4])
def test_the_output_breaks_away_at_its_torque(excess: float, build: Build) -> None:
    step = 5e-4
    model = sticking(build, stribeck=excess, speed=0.05)
    limit = TORQUE * (1 + excess)
    angles = {share: held(model, np.linspace(0, share * limit, 2000), step)[-1] for share in (0.6, 0.97, 1.05)}
    assert angles[0.6] == pytest.approx(0.6 * limit / STIFFNESS, rel=0.05)
    assert angles[0.97] < 1.5 * limit / STIFFNESS, "presliding"
    assert angles[1.05] > 3 * limit / STIFFNESS, "sliding"


@pytest.mark.parametrize("speed", [1e-3, 0.05, 2.0])
def test_sliding_is_coulomb_and_stribeck(speed: float, build: Build) -> None:
    model = sticking(build, stribeck=0.4, speed=0.05)
    time = np.linspace(0, 1, 400)
    for sense in (1, -1):
        output = sense * speed * time
        inputs = np.stack([-29 * output, 0 * time, output, np.full_like(time, sense * speed), 0 * time + 20], axis=1)
        torque = simulate_signal(model, time, inputs)["output.tau"]
        assert torque[-1] == pytest.approx(-sense * TORQUE * (1 + 0.4 * np.exp(-((speed / 0.05) ** 2))), rel=1e-4)


@pytest.mark.parametrize("seed", [0, 1])
def test_friction_never_gives_energy(seed: int, build: Build, drive: sm.Drive) -> None:
    """At both shafts, under random motion with reversals, speeds around Stribeck's, and a load that changes."""
    rng = np.random.default_rng(seed)
    step, n = 4e-5, 4000
    time = step * np.arange(n)

    def wandering(size: float, fastest: float) -> tuple[Array, Array]:
        waves = [(rng.uniform(0.1, fastest), rng.uniform(0, 7), rng.normal()) for _ in range(8)]
        value = sum(a * np.sin(w * time + phase) for w, phase, a in waves)
        slope = sum(a * w * np.cos(w * time + phase) for w, phase, a in waves)
        scale = size / np.abs(value).max()
        return scale * value, scale * slope

    crank, crank_speed = wandering(0.02, 300)
    twist, twist_rate = wandering(1.2 * drive.max_twist, 100)
    output, output_speed = crank / drive.ratio - twist, crank_speed / drive.ratio - twist_rate
    inputs = np.stack([crank, crank_speed, output, output_speed, 0 * time + 20], axis=1)
    at_crank = {"torque": 0.05, "fraction": 0.2, "exponent": 2.0, "stribeck": 0.5, "speed": 2.0, "stiffness": 800.0}
    model = build(
        crank_friction=at_crank,
        elastoplastic_friction={"torque": TORQUE, "stribeck": 0.5, "speed": 0.1, "stiffness": STIFFNESS},
    )
    found, plain = simulate_signal(model, time, inputs), simulate_signal(build(), time, inputs)
    names = [state.name for state in model.states]
    for name, tau, speed, stiffness in (
        ("crank_friction", "crank.tau", crank_speed, 800.0),
        ("elastoplastic_friction", "output.tau", output_speed, STIFFNESS),
    ):
        power = (plain[tau] - found[tau]) * speed
        stored = 0.5 * stiffness * found.states[:, names.index(f"{name}.deflection")] ** 2
        lost = np.cumsum((power[1:] + power[:-1]) / 2 * step) - (stored[1:] - stored[0])
        assert lost[-1] > 0
        # The trapezoidal rule makes errors at reversals.
        assert np.diff(lost).min() > -1e-4 * lost[-1], name
        assert power.min() < -1e-3 * power.max(), "the elastic part gives its energy back"


def test_the_elastic_range_is_a_share_of_the_limit(build: Build) -> None:
    """Forth and back within it, deflection is the path; beyond it, it approaches the limit."""
    model = sticking(build)
    sliding = TORQUE / STIFFNESS
    p = model.parameter_vector()

    def deflection(*path: float) -> float:
        x = np.array(model.initial(np.array([0.0, 0, 0, 0, 20]), p)).ravel()
        for angle in path:
            x = np.array(model.advance(x, np.array([0.0, 0, angle, 0, 20]), 0.1, p)).ravel()
        return float(x[-1])

    inside = 0.99 * ELASTIC_SHARE * sliding
    assert deflection(inside) == pytest.approx(inside, rel=1e-12)
    assert deflection(inside, -0.5 * inside, inside, 0.0) == pytest.approx(0.0, abs=1e-18)
    beyond = 1.5 * sliding
    expected = 1 - (1 - ELASTIC_SHARE) * np.exp(-(1.5 - ELASTIC_SHARE) / (1 - ELASTIC_SHARE))
    assert deflection(beyond) == pytest.approx(expected * sliding, rel=1e-6)
    assert deflection(100 * sliding) == pytest.approx(sliding, rel=1e-12)
    assert deflection(100 * sliding, 99 * sliding) == pytest.approx(0.0, abs=1e-12)
