"""The equations of the joint in CasADi: motor and load inertia with a `DriveModel` between them.

    inertia_m d(crank.w)/dt  = motor.tau - damping_m crank.w  + crank.tau
    inertia_l d(output.w)/dt = load.tau  - damping_l output.w + output.tau

crank.tau and output.tau are the drive's; their virtual work on a twist is the same, so that a drive without dissipation
conserves energy. The states of the drive follow its `rate` in continuous time.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np

from reefmu.fmu.model.component import Component, drive_component
from reefmu.model.drive_model import DriveModel
from reefmu.model.masses import STATES, Masses
from reefmu.model.signals import INPUTS
from stiffness_model.errors import InputError, expect_number
from stiffness_model.numerics.arrays import Array

JOINT_INPUTS = ("motor.tau", "load.tau")
DRIVE_INPUTS = tuple(signal.name for signal in INPUTS)
_SMALL_SPEED = 1e-9
"""rad/s: a speed that has a sign and no other influence; far below those of a joint, chosen by judgement."""
MOST_DOUBLINGS = 20
"""Times that the twist within which an equilibrium is searched, at first that of an FMU's start, is doubled at most;
chosen by judgement."""


@dataclass(frozen=True)
class SystemEquations:
    """A system dx/dt = rate(x, u, p), y = output(x, u, p) as CasADi functions, with the names of its signals.

    motion_direction: (n_x + n_u,) small speeds, rad/s, by which twist, crank and output move in the same direction.
    parameters: names and values of p.
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    outputs: tuple[str, ...]
    parameters: dict[str, float]
    rate: ca.Function
    output: ca.Function
    motion_direction: Array

    @cached_property
    def _jacobians(self) -> ca.Function:
        x, u, p = (
            ca.MX.sym(name, n)
            for name, n in (("x", len(self.states)), ("u", len(self.inputs)), ("p", len(self.parameters)))
        )
        rate, output = self.rate(x, u, p), self.output(x, u, p)
        return ca.Function(
            "jacobians",
            [x, u, p],
            [ca.jacobian(rate, x), ca.jacobian(rate, u), ca.jacobian(output, x), ca.jacobian(output, u)],
        )

    def linear(self, x: Array, u: Array, p: Array) -> tuple[Array, Array, Array, Array]:
        """Exact A, B, C, D at a point: state x, inputs u, parameters p.

        Friction depends on |speed|, which has no derivative at rest; the mean of the derivatives in both directions is
        taken there. Otherwise a hysteresis at rest would have no stiffness.
        """
        n = len(self.states)
        both = [
            self._jacobians(x + s * self.motion_direction[:n], u + s * self.motion_direction[n:], p)
            for s in (-1.0, 1.0)
        ]
        a, b, c, d = (np.array((low + high) / 2).reshape(low.shape) for low, high in zip(*both, strict=True))
        return a, b, c, d


def drive_equations(model: DriveModel) -> SystemEquations:
    """The drive alone: inputs and outputs of the model, and the states of its effects.

    The model's stored angles, which serve discrete steps, are not states of the continuous system.
    """
    x, u, p = (
        ca.MX.sym(name, n)
        for name, n in (("x", count_effect_states(model)), ("u", len(DRIVE_INPUTS)), ("p", len(model.parameters)))
    )
    full = ca.vertcat(ca.MX.zeros(len(model.states) - count_effect_states(model)), x)
    motion_direction = np.zeros(count_effect_states(model) + len(DRIVE_INPUTS))
    # The crank moves twice as fast, so that twist, crank and output all move in the same direction.
    motion_direction[count_effect_states(model) + DRIVE_INPUTS.index("crank.w")] = 2 * _ratio(model) * _SMALL_SPEED
    motion_direction[count_effect_states(model) + DRIVE_INPUTS.index("output.w")] = _SMALL_SPEED
    return SystemEquations(
        tuple(s.name for s in model.states[len(model.states) - count_effect_states(model) :]),
        DRIVE_INPUTS,
        tuple(signal.name for signal in model.outputs),
        {q.name: q.value for q in model.parameters},
        ca.Function("rate", [x, u, p], [model.rate(full, u, p)[full.numel() - x.numel() :]]),
        ca.Function("output", [x, u, p], [model.output(full, u, p)]),
        motion_direction,
    )


def count_effect_states(model: DriveModel) -> int:
    """Number of the effects' own states."""
    return sum(len(effect.states) for effect in model.effects)


def _ratio(model: DriveModel) -> float:
    return {q.name: q.value for q in model.parameters}["ratio"]


@dataclass(frozen=True)
class JointModel:
    """A drive between the `masses` of motor and load, at a constant temperature, degC."""

    drive: DriveModel
    masses: Masses
    temperature: float = 20.0

    @property
    def ratio(self) -> float:
        """Transmission ratio, crank to output, signed."""
        return _ratio(self.drive)

    @cached_property
    def equations(self) -> SystemEquations:
        """States: crank.phi, crank.w, output.phi, output.w, then the drive's. p: inertias and dampings, temperature,
        then the drive's parameters.
        """
        inner = drive_equations(self.drive)
        x, u = ca.MX.sym("x", len(STATES) + len(inner.states)), ca.MX.sym("u", len(JOINT_INPUTS))
        own = {
            "motor.inertia": self.masses.motor_inertia,
            "load.inertia": self.masses.load_inertia,
            "motor.damping": self.masses.motor_damping,
            "load.damping": self.masses.load_damping,
            "temperature": self.temperature,
        }
        p = ca.MX.sym("p", len(own) + len(inner.parameters))
        motor_inertia, load_inertia, motor_damping, load_damping, temperature = (p[k] for k in range(len(own)))
        rest = p[len(own) :]
        drive_inputs = ca.vertcat(x[:4], temperature)
        outputs = inner.output(x[4:], drive_inputs, rest)
        drive = dict(zip(inner.outputs, ca.vertsplit(outputs), strict=True))
        rate = ca.vertcat(
            x[1],
            (u[0] - motor_damping * x[1] + drive["crank.tau"]) / motor_inertia,
            x[3],
            (u[1] - load_damping * x[3] + drive["output.tau"]) / load_inertia,
            inner.rate(x[4:], drive_inputs, rest),
        )
        motion_direction = np.zeros(x.numel() + u.numel())
        motion_direction[1], motion_direction[3] = 2 * self.ratio * _SMALL_SPEED, _SMALL_SPEED
        return SystemEquations(
            (*STATES, *inner.states),
            JOINT_INPUTS,
            (*STATES, *inner.outputs),
            own | inner.parameters,
            ca.Function("rate", [x, u, p], [rate]),
            ca.Function("output", [x, u, p], [ca.vertcat(x[:4], outputs)]),
            motion_direction,
        )

    def state(self, motion: Array | None = None) -> Array:
        """A full state (n_states,) from the motion, with the effects' states at 0.

        motion: (4,) crank.phi, rad, crank.w, rad/s, output.phi, rad, and output.w, rad/s; 0 by default.
        """
        x = np.zeros(len(STATES) + count_effect_states(self.drive))
        if motion is not None:
            x[:4] = motion
        return x

    @cached_property
    def _component(self) -> Component:
        """The drive as in an FMU, with the search for its states under a torque."""
        return drive_component(self.drive)

    def equilibrium(self, load_torque: float = 0.0, crank_angle: float = 0.0) -> tuple[Array, Array]:
        """State x and input u of the joint at rest under `load_torque`, N.m on the output (load.tau).

        crank_angle: of the crank, rad. States that evolve in time, such as creep, have what the torque adds to them
        once it has been held for long; the effects' other states are 0. In a play without a load any twist is an
        equilibrium, and zero is chosen where its torque is exactly zero. Raises `InputError` for a torque that the
        drive cannot carry.
        """
        expect_number(load_torque, "a finite torque, N.m", "load_torque")
        expect_number(crank_angle, "a finite angle, rad", "crank_angle")
        start, p = self._component.start, self._component.parameter_vector()
        assert start is not None
        p[start.search.torque] = -load_torque
        u = np.array([crank_angle, 0.0, crank_angle / self.ratio, 0.0, self.temperature])
        for doublings in range(MOST_DOUBLINGS + 1):
            states = np.asarray(start.loaded(u, p, start.search.reach * 2.0**doublings)).ravel()
            if np.isfinite(states).all():
                break
        else:
            raise InputError(f"load_torque: expected a torque the drive can carry, got {load_torque:g} N.m")
        # The component's last state is the twist, which counts from the angles.
        u[2] -= states[-1]
        x = self.state(u[:4])
        x[len(STATES) :] = states[len(self.drive.states) - count_effect_states(self.drive) : -1]
        y = np.asarray(self.drive.output(states[:-1], u, self.drive.parameter_vector())).ravel()
        return x, np.array([-y[1], load_torque])
