"""What each effect means, and its sign, against plain NumPy written from the contract's words."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import stiffness_model as sm
from reefmu.simulate import Response, simulate_signal
from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.numerics.arrays import Array

from .conftest import Build, Ride

NM = 1e-8
"""Agreement asked for, N.m; full torque is some 280 N.m."""


def response(build: Build, ride: Ride, **effects: dict[str, float]) -> Response:
    return simulate_signal(build(effects), ride.time, ride.inputs)


def built_up(path: Array, presliding: float) -> Array:
    """Share of a friction that is built up along a path, sample by sample."""
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
def test_clearances(name: str, values: dict[str, float], clearance, build: Build, ride: Ride, lookup: Lookup) -> None:
    found = response(build, ride, **{name: values})["output.tau"]
    assert found == pytest.approx(lookup.torque(ride.twist, clearance(ride)), abs=NM)


def test_more_clearance_means_less_torque(build: Build, ride: Ride) -> None:
    plain = np.abs(response(build, ride)["output.tau"])
    loaded = plain > 20
    assert (np.abs(response(build, ride, backlash={"clearance": 5e-6})["output.tau"]) < plain)[loaded].all()
    assert (np.abs(response(build, ride, preload={"clearance": 5e-6})["output.tau"]) > plain)[loaded].all()


def test_series_compliance_adds_twist(build: Build, ride: Ride, lookup: Lookup) -> None:
    tau = response(build, ride, structural_compliance={"compliance": 4e-6})["output.tau"]
    assert lookup.torque(ride.twist - 4e-6 * tau) == pytest.approx(tau, abs=1e-6)


def test_kinematic_error_is_taken_from_the_twist(build: Build, ride: Ride, lookup: Lookup) -> None:
    values = {"amplitude_1": 1e-4, "phase_1": 0.3, "amplitude_4": 4e-5}
    tau = response(build, ride, kinematic_error=values)["output.tau"]
    contact = ride.twist - 1e-4 * np.sin(ride.crank + 0.3) - 4e-5 * np.sin(4 * ride.crank)
    assert tau == pytest.approx(lookup.torque(contact), abs=NM)


def test_hystereses_follow_the_twists_direction(build: Build, ride: Ride, lookup: Lookup) -> None:
    elastic, z = lookup.torque(ride.twist), built_up(ride.twist, 6e-5)
    fixed = response(build, ride, hysteresis={"torque": 5.0, "presliding": 6e-5})["output.tau"]
    assert fixed == pytest.approx(elastic + 5.0 * z, abs=NM)
    growing = np.gradient(ride.twist) > 3e-4
    assert (z[growing] > 0.9).all(), "positive while the twist grows"
    loaded = response(build, ride, load_dependent_hysteresis={"fraction": 0.04, "presliding": 6e-5})["output.tau"]
    assert loaded == pytest.approx(elastic + 0.04 * np.abs(elastic) * z, abs=NM)


def test_damping_acts_with_the_twists_rate(build: Build, ride: Ride, lookup: Lookup, drive: sm.Drive) -> None:
    tau = response(build, ride, damping={"coefficient": 70.0})["output.tau"]
    rate = ride.inputs[:, 1] / drive.ratio - ride.inputs[:, 3]
    assert tau == pytest.approx(lookup.torque(ride.twist) + 70.0 * rate, abs=NM)


def test_frictions_are_taken_off_in_the_outputs_direction(build: Build, ride: Ride, lookup: Lookup) -> None:
    elastic, z, speed = lookup.torque(ride.twist), built_up(ride.output, 3e-5), ride.inputs[:, 3]
    dry = response(build, ride, coulomb_friction={"torque": 3.0, "presliding": 3e-5})["output.tau"]
    assert dry == pytest.approx(elastic - 3.0 * z, abs=NM)
    wet = response(build, ride, viscous_friction={"coefficient": 8.0})["output.tau"]
    assert wet == pytest.approx(elastic - 8.0 * speed, abs=NM)
    values = {"torque": 3.0, "speed": 0.04, "presliding": 3e-5}
    falling = response(build, ride, stribeck_friction=values)["output.tau"]
    assert falling == pytest.approx(elastic - 3.0 * np.exp(-((speed / 0.04) ** 2)) * z, abs=NM)


def test_friction_at_the_output_does_not_reach_the_crank(build: Build, ride: Ride) -> None:
    plain = response(build, ride)["crank.tau"]
    assert np.array_equal(response(build, ride, coulomb_friction={"torque": 3.0})["crank.tau"], plain)
    assert not np.array_equal(response(build, ride, hysteresis={"torque": 3.0})["crank.tau"], plain)


def test_the_sensor_reads_what_is_not_there(build: Build, ride: Ride, lookup: Lookup) -> None:
    torque = lookup.torque(ride.twist)
    offset = response(build, ride, torque_sensor_offset={"torque": -2.5})
    assert offset["measured.tau"] == pytest.approx(torque - 2.5, abs=NM)
    assert offset["output.tau"] == pytest.approx(torque, abs=NM)
    drift = response(build, ride, torque_sensor_drift={"rate": 0.02})
    assert drift["measured.tau"] == pytest.approx(torque + 0.02 * (ride.time - ride.time[0]), abs=NM)
    assert drift["output.tau"] == pytest.approx(torque, abs=NM)
    since = ride.time - ride.time[0]
    settled = response(build, ride, torque_sensor_drift={"rate": 0.02, "settling": 5.0})
    assert settled["measured.tau"] == pytest.approx(torque + 0.1 * (1 - np.exp(-since / 5.0)), abs=NM)


def test_creep_follows_the_torque_with_a_delay(build: Build, ride: Ride, lookup: Lookup) -> None:
    compliance, delay = 1e-6, 8.0
    tau = response(build, ride, creep={"compliance": compliance, "time": delay})["output.tau"]
    q, expected = 0.0, [lookup.torque(ride.twist[0])]
    for k in range(1, len(ride.time)):
        steps = 20
        for _ in range(steps):  # Euler, far finer than the record
            q += (compliance * lookup.torque(ride.twist[k] - q) - q) / delay * (ride.time[k] - ride.time[k - 1]) / steps
        expected.append(lookup.torque(ride.twist[k] - q))
    change = np.abs(np.array(expected) - lookup.torque(ride.twist)).max()
    assert np.abs(tau - expected).max() < 2e-3 * change


def test_creep_relaxes_and_comes_to_rest(build: Build, lookup: Lookup, drive: sm.Drive) -> None:
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
    # With the contacts taken as linear about the end: delay/(1 + compliance * stiffness).
    stiffness = float(lookup.stiffness(twist - rest))
    e_fold = np.interp(np.exp(-1), (tau / tau[-1] - 1)[::-1] / (tau[0] / tau[-1] - 1), time[::-1])
    assert e_fold == pytest.approx(20.0 / (1 + compliance * stiffness), rel=0.05)
