"""A joint under a sampled controller, integrated as a whole: what co-simulation is held against."""

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

from .equations import JOINT_OUTPUTS, JointModel

Controller = Callable[[float, Array], tuple[float, float]]
"""(time s, [crank.phi, crank.w, output.phi, output.w]) -> (motor.tau, load.tau), N.m, held until the next sample.
The second torque is what the surroundings do to the load."""


@dataclass(frozen=True)
class Motion:
    """A joint's motion over n + 1 samples.

    time: (n + 1,) s. values: (n + 1, n_outputs) in the order of `names`, the masses' motion first; in a co-simulation
    the others are what the FMU said at that time. torques: (n, 2) motor.tau and load.tau, N.m, held from each sample
    on.
    """

    time: Array
    values: Array
    torques: Array
    names: tuple[str, ...] = JOINT_OUTPUTS

    def __getitem__(self, name: str) -> Array:
        """One output over time, (n + 1,), by its name ("output.phi")."""
        return self.values[:, self.names.index(name)]


def count_steps(duration: float, step: float) -> int:
    """How many steps fill the duration. Errors: `InputError` unless both are positive and it is a whole number."""
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
    """What the controller says, or `InputError` if that is not two finite torques."""
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
    """The joint with its controller called every `step`, s, its torques held in between.

    start: full state at time 0, as from `JointModel.equilibrium` or `JointModel.state`; default all 0.
    substeps: Runge-Kutta steps (4th order) per step; default such that one spans at most a tenth of a radian
    of the joint's stiffest oscillation within the lookup's range.
    Errors: `InputError`, also for a motion that leaves all bounds.
    """
    n = count_steps(duration, step)
    if substeps is None:
        substeps = max(1, math.ceil(10 * step * _highest_eigenfrequency(joint)))
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
    return Motion(step * np.arange(n + 1.0), np.asarray(values).T, torques)


def runge_kutta(joint: JointModel, substeps: int) -> ca.Function:
    """(x, u, dt, p) -> x after dt, s, with u held, in `substeps` steps of the classical method."""
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
