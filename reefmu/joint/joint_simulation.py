"""A joint under a sampled controller, integrated as a whole: the reference for co-simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from reefmu.model.buffered import Buffered
from stiffness_model.errors import InputError, expect, expect_number
from stiffness_model.numerics.arrays import Array

from .equations import JointModel

Controller = Callable[[float, Array], tuple[float, float]]
"""(time s, [crank.phi, crank.w, output.phi, output.w]) -> (motor.tau, load.tau), N.m, held until the next sample.
The second is the external torque on the load."""


@dataclass(frozen=True)
class Motion:
    """A joint's motion over n + 1 samples.

    time: (n + 1,) s. values: (n + 1, n_outputs) in the order of `names`, the motion of motor and load first; in a
    co-simulation the others are the FMU's outputs. torques: (n, 2) motor.tau and load.tau, N.m, held from each sample
    to the next.
    """

    time: Array
    values: Array
    torques: Array
    names: tuple[str, ...]

    def __getitem__(self, name: str) -> Array:
        """One output over time, (n + 1,), by its name ("output.phi")."""
        return self.values[:, self.names.index(name)]


def count_steps(duration: float, step: float) -> int:
    """Number of steps in the duration. Raises `InputError` unless both, s, are positive and it is an integer."""
    expect_number(step, "a positive step, s", "step", low=0.0)
    expect_number(duration, "a positive duration, s", "duration", low=0.0)
    n = round(duration / step)
    expect(
        n > 0 and math.isclose(n * step, duration, rel_tol=1e-6),
        f"a multiple of the step, {step:g} s",
        duration,
        "duration",
    )
    return n


def commanded_torques(controller: Controller, time: float, motion: Array) -> tuple[float, float]:
    """The controller's torques, N.m. Raises `InputError` if they are not two finite numbers."""
    torques = controller(time, motion)
    try:
        motor, load = (float(torque) for torque in torques)
    except (TypeError, ValueError):
        motor = load = math.nan
    if not (math.isfinite(motor) and math.isfinite(load)):
        raise InputError(
            f"controller at {time:g} s: expected two finite torques, motor.tau and load.tau, got {torques!r}"
        )
    return motor, load


def simulate_joint(
    joint: JointModel,
    controller: Controller,
    *,
    step: float,
    duration: float,
    start: ArrayLike | None = None,
    substeps: int | None = None,
) -> Motion:
    """The joint under a controller that is called every `step`, s; its torques are held in between.

    duration: s, a multiple of the step. start: full state (n_states,) at time 0, as of `JointModel.equilibrium` or
    `JointModel.state`; default 0. substeps: Runge-Kutta steps (4th order) per step; by default one covers at most a
    tenth of a radian of the joint's fastest oscillation within the lookup's range, and at most the time constant of a
    motor that friction holds.

    Raises `InputError`, also for a motion that diverges.
    """
    n = count_steps(duration, step)
    if substeps is None:
        substeps = max(1, math.ceil(step * max(10 * _highest_eigenfrequency(joint), _friction_rate(joint))))
    x = joint.state() if start is None else np.asarray(start, float)
    size = len(joint.equations.states)
    expect(x.shape == (size,) and bool(np.isfinite(x).all()), f"a state of {size} finite numbers", start, "start")
    advance = Buffered(runge_kutta(joint, substeps))
    p = np.array(list(joint.equations.parameters.values()))
    states, torques = np.empty((n + 1, len(x))), np.empty((n, 2))
    states[0] = x
    for k in range(n):
        torques[k] = commanded_torques(controller, k * step, states[k, :4])
        states[k + 1] = advance(states[k], torques[k], step, p)
        if not np.isfinite(states[k + 1]).all():
            raise InputError(
                f"joint at {(k + 1) * step:g} s: expected a bounded motion, got one without bounds; "
                "the loop is unstable or needs more substeps"
            )
    held = np.vstack([torques, torques[-1]])
    values = joint.equations.output.map(n + 1)(states.T, held.T, ca.repmat(ca.DM(p), 1, n + 1))
    return Motion(step * np.arange(n + 1.0), np.asarray(values).T, torques, joint.equations.outputs)


def runge_kutta(joint: JointModel, substeps: int) -> ca.Function:
    """(x, u, dt, p) -> x after dt, s, with u held, in `substeps` steps of the classical fourth-order method."""
    rate = joint.equations.rate
    x, u, p = (ca.MX.sym(rate.name_in(k), rate.size1_in(k)) for k in range(3))
    dt = ca.MX.sym("dt")
    h = dt / substeps
    k1 = rate(x, u, p)
    k2 = rate(x + h / 2 * k1, u, p)
    k3 = rate(x + h / 2 * k2, u, p)
    k4 = rate(x + h * k3, u, p)
    one = ca.Function("one", [x, u, dt, p], [x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
    held = (ca.repmat(value, 1, substeps) for value in (u, dt, p))
    return one if substeps == 1 else ca.Function("steps", [x, u, dt, p], [one.fold(substeps)(x, *held)])


def _highest_eigenfrequency(joint: JointModel) -> float:
    """Highest eigenfrequency, rad/s, at the end of the lookup's range."""
    stiffness = float(joint.drive.lookup.stiffness(joint.drive.lookup.twist.stop))
    return math.sqrt(stiffness / joint.masses.reduced_inertia(joint.ratio))


def _friction_rate(joint: JointModel) -> float:
    """Greatest magnitude of an eigenvalue, 1/s, of the joint at rest at the lookup's end, held by friction that sticks;
    0 without such friction."""
    if not any(state.elastic_range for effect in joint.drive.effects for state in effect.states):
        return 0.0
    end = joint.state(np.array([0.0, 0.0, -joint.drive.lookup.twist.stop, 0.0]))
    p = np.array(list(joint.equations.parameters.values()))
    a, *_ = joint.equations.linear(end, np.zeros(2), p)
    return float(np.abs(np.linalg.eigvals(a)).max())
