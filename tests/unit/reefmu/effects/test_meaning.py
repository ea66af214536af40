"""The meaning and sign of each effect, against plain NumPy written from the contract."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import stiffness_model as sm
from reefmu.simulate import Response, simulate_signal
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.numerics.arrays import Array

from .conftest import Build, Trajectory

NM = 1e-8
"""Tolerance, N.m; full torque is some 280 N.m."""


def response(build: Build, trajectory: Trajectory, **effects: dict[str, float]) -> Response:
    return simulate_signal(build(effects), trajectory.time, trajectory.inputs)


def presliding_deflection(path: Array, presliding: float) -> Array:
    """Normalised presliding deflection along a path, sample by sample."""
    z = np.zeros(len(path))
    for k in range(1, len(path)):
        way = path[k] - path[k - 1]
        z[k] = np.sign(way) + (z[k - 1] - np.sign(way)) * np.exp(-abs(way) / presliding)
    return z


@pytest.mark.parametrize(
    ("name", "values", "clearance"),
    [
        ("backlash", {"clearance": 6e-6}, lambda r: 6e-6 + 0 * r.time),
        ("preload", {"clearance": 6e-6}, lambda r: -6e-6 + 0 * r.time),
        ("thermal_clearance", {"rate": 4e-7}, lambda r: 4e-7 * (r.inputs[:, 4] - 20)),
        ("thermal_clearance", {"rate": -4e-7}, lambda r: -4e-7 * (r.inputs[:, 4] - 20)),
        ("wear", {"rate": 3e-7}, lambda r: 3e-7 * np.concatenate([[0], np.cumsum(np.abs(np.diff(r.crank)))])),
    ],
)
def test_clearances(
    name: str, values: dict[str, float], clearance, build: Build, trajectory: Trajectory, lookup: Lookup
) -> None:
    found = response(build, trajectory, **{name: values})["output.tau"]
    assert found == pytest.approx(lookup.torque(trajectory.twist, clearance(trajectory)), abs=NM)


def test_more_clearance_means_less_torque(build: Build, trajectory: Trajectory) -> None:
    plain = np.abs(response(build, trajectory)["output.tau"])
    loaded = plain > 20
    assert (np.abs(response(build, trajectory, backlash={"clearance": 5e-6})["output.tau"]) < plain)[loaded].all()
    assert (np.abs(response(build, trajectory, preload={"clearance": 5e-6})["output.tau"]) > plain)[loaded].all()


def test_series_compliance_adds_twist(build: Build, trajectory: Trajectory, lookup: Lookup) -> None:
    tau = response(build, trajectory, structural_compliance={"compliance": 4e-6})["output.tau"]
    assert lookup.torque(trajectory.twist - 4e-6 * tau) == pytest.approx(tau, abs=1e-6)


def test_kinematic_error_is_subtracted_from_the_twist(build: Build, trajectory: Trajectory, lookup: Lookup) -> None:
    values = {"amplitude_1": 1e-4, "phase_1": 0.3, "amplitude_4": 4e-5}
    tau = response(build, trajectory, kinematic_error=values)["output.tau"]
    contact = trajectory.twist - 1e-4 * np.sin(trajectory.crank + 0.3) - 4e-5 * np.sin(4 * trajectory.crank)
    assert tau == pytest.approx(lookup.torque(contact), abs=NM)


def test_hysteresis_follows_the_direction_of_the_twist(build: Build, trajectory: Trajectory, lookup: Lookup) -> None:
    elastic, z = lookup.torque(trajectory.twist), presliding_deflection(trajectory.twist, 6e-5)
    fixed = response(build, trajectory, hysteresis={"torque": 5.0, "presliding": 6e-5})["output.tau"]
    assert fixed == pytest.approx(elastic + 5.0 * z, abs=NM)
    growing = np.gradient(trajectory.twist) > 3e-4
    assert (z[growing] > 0.9).all(), "positive while the twist grows"
    loaded = response(build, trajectory, load_dependent_hysteresis={"fraction": 0.04, "presliding": 6e-5})["output.tau"]
    assert loaded == pytest.approx(elastic + 0.04 * np.abs(elastic) * z, abs=NM)


def test_damping_follows_the_rate_of_the_twist(
    build: Build, trajectory: Trajectory, lookup: Lookup, drive: sm.Drive
) -> None:
    tau = response(build, trajectory, damping={"coefficient": 70.0})["output.tau"]
    rate = trajectory.inputs[:, 1] / drive.ratio - trajectory.inputs[:, 3]
    assert tau == pytest.approx(lookup.torque(trajectory.twist) + 70.0 * rate, abs=NM)


def test_friction_inside_the_drive_follows_the_twist_with_its_kinematic_error(
    build: Build, trajectory: Trajectory, lookup: Lookup, drive: sm.Drive
) -> None:
    contact = trajectory.twist - 1e-3 * np.sin(trajectory.crank)
    z = presliding_deflection(trajectory.twist, 6e-5)
    assert np.abs(z - presliding_deflection(contact, 6e-5)).max() > 1
    rate = trajectory.inputs[:, 1] / drive.ratio - trajectory.inputs[:, 3]
    tau = response(
        build,
        trajectory,
        kinematic_error={"amplitude_1": 1e-3},
        hysteresis={"torque": 5.0, "presliding": 6e-5},
        damping={"coefficient": 70.0},
    )["output.tau"]
    assert tau == pytest.approx(lookup.torque(contact) + 5.0 * z + 70.0 * rate, abs=NM)


def test_friction_opposes_the_motion_of_the_output(build: Build, trajectory: Trajectory, lookup: Lookup) -> None:
    elastic, z, speed = (
        lookup.torque(trajectory.twist),
        presliding_deflection(trajectory.output, 3e-5),
        trajectory.inputs[:, 3],
    )
    dry = response(build, trajectory, coulomb_friction={"torque": 3.0, "presliding": 3e-5})["output.tau"]
    assert dry == pytest.approx(elastic - 3.0 * z, abs=NM)
    wet = response(build, trajectory, viscous_friction={"coefficient": 8.0})["output.tau"]
    assert wet == pytest.approx(elastic - 8.0 * speed, abs=NM)
    values = {"torque": 3.0, "speed": 0.04, "presliding": 3e-5}
    for given, exponent in (({}, 2.0), ({"exponent": 0.7}, 0.7)):
        falling = response(build, trajectory, stribeck_friction=values | given)["output.tau"]
        assert falling == pytest.approx(elastic - 3.0 * np.exp(-(np.abs(speed / 0.04) ** exponent)) * z, abs=NM)


def test_friction_at_the_output_does_not_reach_the_crank(build: Build, trajectory: Trajectory) -> None:
    plain = response(build, trajectory)["crank.tau"]
    assert np.array_equal(response(build, trajectory, coulomb_friction={"torque": 3.0})["crank.tau"], plain)
    assert not np.array_equal(response(build, trajectory, hysteresis={"torque": 3.0})["crank.tau"], plain)


def test_sensor_errors_change_the_measured_torque_only(build: Build, trajectory: Trajectory, lookup: Lookup) -> None:
    torque = lookup.torque(trajectory.twist)
    offset = response(build, trajectory, torque_sensor_offset={"torque": -2.5})
    assert offset["measured.tau"] == pytest.approx(torque - 2.5, abs=NM)
    assert offset["output.tau"] == pytest.approx(torque, abs=NM)
    drift = response(build, trajectory, torque_sensor_drift={"rate": 0.02})
    assert drift["measured.tau"] == pytest.approx(torque + 0.02 * (trajectory.time - trajectory.time[0]), abs=NM)
    assert drift["output.tau"] == pytest.approx(torque, abs=NM)
    since = trajectory.time - trajectory.time[0]
    settled = response(build, trajectory, torque_sensor_drift={"rate": 0.02, "settling": 5.0})
    assert settled["measured.tau"] == pytest.approx(torque + 0.1 * (1 - np.exp(-since / 5.0)), abs=NM)


def test_creep_follows_the_torque_with_a_delay(build: Build, trajectory: Trajectory, lookup: Lookup) -> None:
    compliance, delay = 1e-6, 8.0
    tau = response(build, trajectory, creep={"compliance": compliance, "time": delay})["output.tau"]
    q, expected = 0.0, [lookup.torque(trajectory.twist[0])]
    for k in range(1, len(trajectory.time)):
        steps = 20
        for _ in range(steps):  # Euler, far finer than the record
            q += (
                (compliance * lookup.torque(trajectory.twist[k] - q) - q)
                / delay
                * (trajectory.time[k] - trajectory.time[k - 1])
                / steps
            )
        expected.append(lookup.torque(trajectory.twist[k] - q))
    change = np.abs(np.array(expected) - lookup.torque(trajectory.twist)).max()
    assert np.abs(tau - expected).max() < 2e-3 * change


def test_creep_relaxes_to_an_equilibrium(build: Build, lookup: Lookup, drive: sm.Drive) -> None:
    twist, compliance = 0.8 * drive.max_twist, 1e-6
    time = np.linspace(0, 400, 4001)
    still = np.array([0.0, 0.0, -twist, 0.0, 20.0])
    tau = simulate_signal(build(creep={"compliance": compliance, "time": 20.0}), time, np.tile(still, (len(time), 1)))[
        "output.tau"
    ]
    assert tau[0] == pytest.approx(float(lookup.torque(twist)), abs=NM)
    assert (np.diff(tau) <= 1e-12).all(), "at a held twist the torque falls"
    rest = brentq(lambda q: compliance * float(lookup.torque(twist - q)) - q, 0, twist)
    assert tau[-1] == pytest.approx(float(lookup.torque(twist - rest)), rel=1e-6)
    # With the contacts linearised at the end: time/(1 + compliance * stiffness).
    stiffness = float(lookup.stiffness(twist - rest))
    e_fold = np.interp(np.exp(-1), (tau / tau[-1] - 1)[::-1] / (tau[0] / tau[-1] - 1), time[::-1])
    assert e_fold == pytest.approx(20.0 / (1 + compliance * stiffness), rel=0.05)
