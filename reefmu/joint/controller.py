"""A discrete LQR with integral action for a joint, designed for the drive linearised at one torque."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from .equations import JointModel
from .systems import linearize

N_MECHANICAL_STATES = 4
"""Mechanical states of a joint, which precede the effects' states: the signals that the controller measures."""


@dataclass(frozen=True)
class Weights:
    """Weights of the quadratic cost of output angle and its integral, twist rate and motor torque, in SI units."""

    output_angle: float = 1e4
    integral: float = 1e6
    twist_rate: float = 10.0
    motor_torque: float = 1.0


@dataclass(frozen=True)
class Design:
    """Gains (5,) on crank.phi, crank.w, output.phi, output.w and the integral of the output's error.

    stiffness: of the drive at the linearisation, N.m/rad; sample: sampling time of the controller, s.
    """

    name: str
    stiffness: float
    gains: Array
    sample: float


def discretize(joint: JointModel, torque: float, sample: float) -> tuple[Array, Array, float]:
    """Discrete A (5, 5) and B (5, 1) with the integral of output.phi, and the stiffness, N.m/rad.

    The joint is linearised at the torque `torque`, N.m, of the drive, with the effects' states held. sample: sampling
    time, s.
    """
    import control as ct

    x, u = joint.equilibrium(-torque)
    linear = linearize(joint, x, u)
    n = N_MECHANICAL_STATES
    full_a, full_b = np.asarray(linear.A), np.asarray(linear.B)
    discrete = ct.sample_system(ct.ss(full_a[:n, :n], full_b[:n, :1], np.eye(n), 0), sample)
    a, b = np.zeros((n + 1, n + 1)), np.zeros((n + 1, 1))
    a[:n, :n], b[:n] = discrete.A, discrete.B
    a[n, [2, n]] = sample, 1.0
    values = list(joint.equations.parameters.values())
    outputs = np.asarray(joint.equations.output(x, u, values)).ravel()
    return a, b, float(outputs[joint.equations.outputs.index("stiffness")])


def design_lqr(joint: JointModel, torque: float, sample: float, name: str, weights: Weights | None = None) -> Design:
    """LQR for the joint linearised at a torque of the drive, N.m (Anderson, Moore, Optimal Control, 1990).

    sample: sampling time, s; name: of the design, for pictures; weights: default `Weights()`.
    """
    import control as ct

    w = Weights() if weights is None else weights
    a, b, stiffness = discretize(joint, torque, sample)
    twist_rate = np.array([0.0, 1 / joint.ratio, 0.0, -1.0, 0.0])
    state_cost = np.diag([0.0, 0.0, w.output_angle, 0.0, w.integral]) + w.twist_rate * np.outer(twist_rate, twist_rate)
    gains, _, _ = ct.dlqr(a, b, state_cost, np.array([[w.motor_torque]]))
    return Design(name, stiffness, np.asarray(gains).ravel(), sample)


def minimum_damping_ratio(joint: JointModel, design: Design, torque: float) -> float:
    """Smallest damping ratio of the closed loop of joint and design; negative if the loop is unstable.

    torque: of the drive, N.m, at which the joint is linearised.
    """
    a, b, _ = discretize(joint, torque, design.sample)
    poles = np.log(np.linalg.eigvals(a - b @ design.gains[None, :]).astype(complex)) / design.sample
    return float((-poles.real / np.abs(poles)).min())


def feedback(
    design: Design, ratio: float, target: float = 0.0, load: float = 0.0
) -> Callable[[float, Array], tuple[float, float]]:
    """The controller as a callback (time, motion) -> (motor.tau, load.tau), which holds its integral.

    design: from `design_lqr`; ratio: of the joint; target: set point of the output, rad; load: torque on the output,
    N.m; both from time 0 on. It serves one run.
    """
    wanted = np.array([ratio * target, 0.0, target, 0.0])
    integral = 0.0

    def controller(_time: float, motion: Array) -> tuple[float, float]:
        nonlocal integral
        torque = -float(design.gains[:4] @ (motion[:4] - wanted) + design.gains[4] * integral)
        integral += design.sample * (motion[2] - target)
        return torque, load

    return controller
