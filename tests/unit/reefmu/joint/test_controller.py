"""The LQR of the joint: optimal where it is designed, unstable in the soft beginning of the curve."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.joint import JointModel, Masses
from reefmu.joint.controller import Design, Weights, design_lqr, discretize, feedback, minimum_damping_ratio
from reefmu.joint.plots import linear_response, run
from reefmu.model.drive_model import DriveModel

MASSES = Masses(motor_inertia=1e-4, load_inertia=2.0, motor_damping=1e-3, load_damping=0.5)
SAMPLE = 5e-4


@pytest.fixture(scope="module")
def joint(model: DriveModel) -> JointModel:
    return JointModel(model, MASSES)


@pytest.fixture(scope="module")
def stiff(joint: JointModel) -> Design:
    return design_lqr(joint, 100.0, SAMPLE, "at 100 N.m")


@pytest.fixture(scope="module")
def soft(joint: JointModel) -> Design:
    return design_lqr(joint, 0.0, SAMPLE, "at rest")


def test_designs_use_the_stiffness_of_the_lookup(joint: JointModel, stiff: Design, soft: Design) -> None:
    lookup = joint.drive.lookup
    assert stiff.stiffness == pytest.approx(float(lookup.stiffness(lookup.twist_at(100.0))), rel=1e-6)
    assert soft.stiffness == pytest.approx(float(lookup.stiffness(0.0)), rel=1e-6)
    assert soft.stiffness < stiff.stiffness / 3


def test_gains_are_optimal(joint: JointModel, stiff: Design) -> None:
    """Bellman: no neighbouring gain has a lower cost over a long simulation of the linear loop."""
    a, b, _ = discretize(joint, 100.0, SAMPLE)
    w = Weights()
    rate = np.array([0.0, 1 / joint.ratio, 0.0, -1.0, 0.0])
    q = np.diag([0.0, 0.0, w.output_angle, 0.0, w.integral]) + w.twist_rate * np.outer(rate, rate)

    def cost(gains: np.ndarray) -> float:
        x, total = np.array([0.0, 0.0, 0.01, 0.0, 0.0]), 0.0
        for _ in range(8000):
            u = float(-gains @ x)
            total += x @ q @ x + w.motor_torque * u * u
            x = a @ x + b[:, 0] * u
        return total

    best = cost(stiff.gains)
    for k in range(5):
        for change in (0.97, 1.03):
            other = stiff.gains.copy()
            other[k] *= change
            assert cost(other) > best


def test_stable_at_the_design_torque_and_unstable_near_zero(joint: JointModel, stiff: Design, soft: Design) -> None:
    assert minimum_damping_ratio(joint, stiff, 100.0) > 0.2
    assert minimum_damping_ratio(joint, stiff, 0.0) < 0
    for torque in (0.0, 10.0, 100.0, 200.0):
        assert minimum_damping_ratio(joint, soft, torque) > 0.2


def test_small_step_oscillates_on_the_real_curve_only(joint: JointModel, stiff: Design, soft: Design) -> None:
    target = 0.2e-3
    real, other = (run(joint, design, target, 0.0, 0.5)["output.phi"] for design in (stiff, soft))
    ideal = linear_response(joint, stiff, target, 0.0, 0.5)
    late = slice(800, None)
    assert np.ptp(real[late]) > 0.2 * target
    assert np.ptp(other[late]) < 0.02 * target
    assert np.ptp(ideal[late]) < 0.02 * target


def test_the_integral_removes_the_error_under_load(joint: JointModel, soft: Design) -> None:
    motion = run(joint, soft, 0.0, 50.0, 1.5)
    assert np.abs(motion["output.phi"]).max() > 1e-3
    assert abs(motion["output.phi"][-1]) < 2e-5
    assert motion["output.tau"][-1] == pytest.approx(-50.0, rel=1e-2)


def test_a_new_callback_has_a_new_integral(soft: Design) -> None:
    first = feedback(soft, -29.0, target=0.01)
    motion = np.array([0.1, 0.0, 0.0, 0.0])
    start = first(0.0, motion)
    assert first(SAMPLE, motion) != start
    assert feedback(soft, -29.0, target=0.01)(0.0, motion) == start
    assert start[1] == 0.0
