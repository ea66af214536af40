"""A co-simulation loop around an FMU of the drive: the master integrates motor and load.

FMI 2.0 gives outputs only after a step, so the master never knows the torque at its present twist. The scheme that
couples both decides how long its steps may be (`reefmu.joint.step`):

parallel      At t the FMU gets the angles of t and steps to t + h, while the inertias move under the torque of its last
              step. That torque is one step old and is held for another, which adds energy. The default of simulation
              tools (Jacobi). Order 1.
sequential    The inertias move first, then the FMU gets the angles of t + h (Gauss-Seidel), and its torque completes
              the speeds: velocity Verlet. No energy is added below h = 2/eigenfrequency, at large amplitudes either.
              Order 2.
extrapolated  In the order of `parallel`; the torque is extrapolated by the FMU's outputs `stiffness` and `twist`, and
              the inertias are integrated exactly with that spring. A small oscillation does not grow at any step.
              Order 2 for an elastic drive; friction inside it remains delayed, order 1. Where the stiffness changes
              within a step, large oscillations lose energy: through the soft zone of drive_1, from 150 N.m, 3 % of
              the amplitude in 0.1 s at h = 0.1 ms; above h = 2/eigenfrequency they may grow.

References: Hairer, Lubich, Wanner, Geometric Numerical Integration (2006), I.1.4 (Verlet); FMI 2.0.4, section 4.2.1.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from typing import get_args

import numpy as np
from numpy.typing import ArrayLike

from reefmu.fmu.importer.instance import FmuDrive
from reefmu.model.masses import STATES, Masses, Scheme
from stiffness_model.errors import InputError, expect, unknown_name
from stiffness_model.numerics.arrays import Array

from .joint_simulation import Controller, Motion, commanded_torques, count_steps

COUPLING_OUTPUTS = ("crank.tau", "output.tau", "twist", "stiffness")
"""Outputs of the FMU that the loop uses, in the order of its arrays."""


def cosimulate(
    path: str | os.PathLike[str],
    masses: Masses,
    controller: Controller,
    *,
    step: float,
    duration: float,
    start: ArrayLike | None = None,
    scheme: Scheme = "sequential",
    parameters: Mapping[str, float] | None = None,
    temperature: float = 20.0,
) -> Motion:
    """Run the FMU of a drive between motor and load under a controller.

    path: FMU of kind drive. step: communication step, s, at which the controller is called too. start: crank.phi,
    crank.w, output.phi, output.w at time 0, default 0. parameters: the FMU's, by name. temperature: degC.
    Raises `InputError` for an FMU of another kind, an unknown scheme, or a motion that diverges.
    """
    if scheme not in get_args(Scheme):
        raise unknown_name("scheme", scheme, get_args(Scheme), "cosimulate")
    n = count_steps(duration, step)
    motion = np.zeros(4) if start is None else np.asarray(start, float)
    expect(
        motion.shape == (4,) and bool(np.isfinite(motion).all()),
        "four finite numbers, crank.phi crank.w output.phi output.w",
        start,
        "start",
    )
    with FmuDrive(path, parameters=parameters) as fmu:
        ratio = drive_ratio(fmu, path)
        output_names = (*COUPLING_OUTPUTS, *(name for name in fmu.outputs if name not in COUPLING_OUTPUTS))
        motions, outputs, torques = np.empty((n + 1, 4)), np.empty((n + 1, len(output_names))), np.empty((n, 2))

        def step_drive(k: int, motion: Array) -> Array:
            inputs = {**dict(zip(STATES, motion.tolist(), strict=True)), "temperature": temperature}
            values = fmu.initialize(inputs) if k == 0 else fmu.step(step, inputs)
            return np.array([values[name] for name in output_names])

        advance = _ADVANCES[scheme](masses, ratio, step)
        motions[0], outputs[0] = motion, step_drive(0, motion)
        for k in range(n):
            torques[k] = commanded_torques(controller, k * step, motions[k])
            motions[k + 1], outputs[k + 1] = advance(
                motions[k], torques[k], outputs[k], lambda moved, k=k: step_drive(k + 1, moved)
            )
            if not np.isfinite(motions[k + 1]).all() or np.abs(motions[k + 1]).max() > 1e9:
                raise InputError(
                    f"cosimulate at {(k + 1) * step:g} s: expected a bounded motion, got one without "
                    f"bounds; a step of {step:g} s is too long for the scheme {scheme!r}, or the loop is "
                    "unstable"
                )
    return Motion(step * np.arange(n + 1.0), np.hstack([motions, outputs]), torques, (*STATES, *output_names))


def drive_ratio(fmu: FmuDrive, path: str | os.PathLike[str]) -> float:
    """The FMU's transmission ratio. Raises `InputError` if the FMU lacks variables of a drive."""
    for names, kind, present in (
        (STATES, "input", fmu.inputs),
        (COUPLING_OUTPUTS, "output", fmu.outputs),
        (("ratio",), "parameter", fmu.parameters),
    ):
        for name in names:
            expect(name in present, f"an FMU of kind drive with the {kind} {name!r}", ", ".join(present), str(path))
    return fmu.set_values["ratio"]


StepDrive = Callable[[Array], Array]
Advance = Callable[[Array, Array, Array, StepDrive], tuple[Array, Array]]
"""(motion, commanded torques, last outputs, function that steps the FMU) -> (next motion, next outputs)."""


def _parallel(masses: Masses, ratio: float, step: float) -> Advance:
    phi, gamma = masses.step_matrices(step, ratio)

    def advance(motion: Array, commands: Array, outputs: Array, step_drive: StepDrive) -> tuple[Array, Array]:
        return phi @ motion + gamma @ (commands + outputs[:2]), step_drive(motion)

    return advance


def _extrapolated(masses: Masses, ratio: float, step: float) -> Advance:
    def advance(motion: Array, commands: Array, outputs: Array, step_drive: StepDrive) -> tuple[Array, Array]:
        return extrapolate(masses, ratio, step, motion, commands, outputs), step_drive(motion)

    return advance


def extrapolate(masses: Masses, ratio: float, step: float, motion: Array, commands: Array, outputs: Array) -> Array:
    """Motion (4,) after a step, with the drive's torques extrapolated along the twist by its stiffness.

    outputs: in the order of `COUPLING_OUTPUTS`. The crank's torque is extrapolated with the derivative 1/ratio of the
    twist by the crank's angle; a kinematic error changes that by its own slope only.
    """
    twist, stiffness = outputs[2:4]
    phi, gamma = masses.step_matrices(step, ratio, stiffness)
    return phi @ motion + gamma @ (commands + outputs[:2] + stiffness * twist * np.array([1 / ratio, -1.0]))


def _sequential(masses: Masses, ratio: float, step: float) -> Advance:
    inertia = np.array([masses.motor_inertia, masses.load_inertia])
    damping = np.array([masses.motor_damping, masses.load_damping])

    def advance(motion: Array, commands: Array, outputs: Array, step_drive: StepDrive) -> tuple[Array, Array]:
        angles, speeds = motion[[0, 2]], motion[[1, 3]]
        # Damping is implicit, by the trapezoidal rule, so that it does not limit the step.
        rise = step / 2 * (commands + outputs[:2] - damping * speeds) / inertia
        halfway = speeds + rise
        reached = angles + step * halfway
        new = step_drive(np.array([reached[0], halfway[0] + rise[0], reached[1], halfway[1] + rise[1]]))
        final = (halfway + step / 2 * (commands + new[:2]) / inertia) / (1 + step / 2 * damping / inertia)
        return np.array([reached[0], final[0], reached[1], final[1]]), new

    return advance


_ADVANCES: dict[str, Callable[[Masses, float, float], Advance]] = {
    "parallel": _parallel,
    "sequential": _sequential,
    "extrapolated": _extrapolated,
}
