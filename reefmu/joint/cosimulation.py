"""A co-simulation loop around an FMU of the drive: motor and load are integrated outside, by the master.

FMI 2.0 gives outputs only after a step, so a master never has the torque that belongs to its present twist. How
it deals with that is its scheme, and decides on the step it may take (`reefmu.joint.step`):

parallel      At t the FMU gets the angles of t and steps to t + h, while the masses move on with the torque of its
              last step. That torque is one step old and is held for a further one: energy flows in. What simulation
              tools do by default (Jacobi). Order 1.
sequential    The masses move first, then the FMU gets the angles of t + h (Gauss-Seidel), and the speeds are
              completed with its answer: velocity Verlet. No energy flows in below h = 2/eigenfrequency, for large
              swings too. Order 2.
extrapolated  In the order of `parallel`; the torque is continued from the FMU's answer by its `stiffness` output
              and twist, and the masses are integrated exactly with that spring. A small oscillation does not grow
              at any step. Order 2 for an elastic drive; friction inside it stays late, order 1. Where the stiffness
              changes within a step, large swings lose energy: through the soft zone of drive 1, from 150 N.m,
              3 % of the amplitude in 0.1 s at h = 0.1 ms; above h = 2/eigenfrequency they may grow.

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

from .simulate import Controller, Motion, commanded_torques, count_steps

COUPLING_OUTPUTS = ("crank.tau", "output.tau", "twist", "stiffness")
"""Outputs of the FMU that the loop uses; they lead its answers."""


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
    """Run the FMU of a drive between two masses under a controller.

    path: FMU of kind drive. step: communication step, s, at which the controller is called too. start: crank.phi,
    crank.w, output.phi, output.w at time 0, default 0. parameters: the FMU's, by name. temperature: degC.
    Errors: `InputError` for an FMU that is no drive, a scheme that does not exist, a motion that leaves all bounds.
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
        motions, answers, torques = np.empty((n + 1, 4)), np.empty((n + 1, len(output_names))), np.empty((n, 2))

        def ask(k: int, angles: Array) -> Array:
            inputs = {**dict(zip(STATES, angles.tolist(), strict=True)), "temperature": temperature}
            outputs = fmu.initialize(inputs) if k == 0 else fmu.step(step, inputs)
            return np.array([outputs[name] for name in output_names])

        advance = _ADVANCES[scheme](masses, ratio, step)
        motions[0], answers[0] = motion, ask(0, motion)
        for k in range(n):
            torques[k] = commanded_torques(controller, k * step, motions[k])
            motions[k + 1], answers[k + 1] = advance(
                motions[k], torques[k], answers[k], lambda angles, k=k: ask(k + 1, angles)
            )
            if not np.isfinite(motions[k + 1]).all() or np.abs(motions[k + 1]).max() > 1e9:
                raise InputError(
                    f"cosimulate at {(k + 1) * step:g} s: expected a bounded motion, got one without "
                    f"bounds; a step of {step:g} s is too long for the scheme {scheme!r}, or the loop is "
                    "unstable"
                )
    return Motion(step * np.arange(n + 1.0), np.hstack([motions, answers]), torques, (*STATES, *output_names))


def drive_ratio(fmu: FmuDrive, path: str | os.PathLike[str]) -> float:
    """The FMU's transmission ratio. Errors: `InputError` if the FMU has not the variables of a drive."""
    for names, kind, present in (
        (STATES, "input", fmu.inputs),
        (COUPLING_OUTPUTS, "output", fmu.outputs),
        (("ratio",), "parameter", fmu.parameters),
    ):
        for name in names:
            expect(name in present, f"an FMU of kind drive with the {kind} {name!r}", ", ".join(present), str(path))
    return fmu.set_values["ratio"]


Ask = Callable[[Array], Array]
Advance = Callable[[Array, Array, Array, Ask], tuple[Array, Array]]
"""(motion, commanded torques, the FMU's last answer, step the FMU with these angles and speeds) -> the next both."""


def _parallel(masses: Masses, ratio: float, step: float) -> Advance:
    phi, gamma = masses.step_matrices(step, ratio)

    def advance(motion: Array, commands: Array, answer: Array, ask: Ask) -> tuple[Array, Array]:
        return phi @ motion + gamma @ (commands + answer[:2]), ask(motion)

    return advance


def _extrapolated(masses: Masses, ratio: float, step: float) -> Advance:
    def advance(motion: Array, commands: Array, answer: Array, ask: Ask) -> tuple[Array, Array]:
        return extrapolate(masses, ratio, step, motion, commands, answer), ask(motion)

    return advance


def extrapolate(masses: Masses, ratio: float, step: float, motion: Array, commands: Array, answer: Array) -> Array:
    """Motion (4,) after a step, with the drive's torques continued along twist by its stiffness.

    answer: in the order of `COUPLING_OUTPUTS`, at its own twist. The crank's torque is continued with the lever
    1/ratio; a kinematic error changes that by its own slope only.
    """
    twist, stiffness = answer[2:4]
    phi, gamma = masses.step_matrices(step, ratio, stiffness)
    return phi @ motion + gamma @ (commands + answer[:2] + stiffness * twist * np.array([1 / ratio, -1.0]))


def _sequential(masses: Masses, ratio: float, step: float) -> Advance:
    inertia = np.array([masses.motor_inertia, masses.load_inertia])
    damping = np.array([masses.motor_damping, masses.load_damping])

    def advance(motion: Array, commands: Array, answer: Array, ask: Ask) -> tuple[Array, Array]:
        angles, speeds = motion[[0, 2]], motion[[1, 3]]
        # Damping enters implicitly, by the trapezium rule: it sets no bound on the step.
        rise = step / 2 * (commands + answer[:2] - damping * speeds) / inertia
        halfway = speeds + rise
        reached = angles + step * halfway
        new = ask(np.array([reached[0], halfway[0] + rise[0], reached[1], halfway[1] + rise[1]]))
        final = (halfway + step / 2 * (commands + new[:2]) / inertia) / (1 + step / 2 * damping / inertia)
        return np.array([reached[0], final[0], reached[1], final[1]]), new

    return advance


_ADVANCES: dict[str, Callable[[Masses, float, float], Advance]] = {
    "parallel": _parallel,
    "sequential": _sequential,
    "extrapolated": _extrapolated,
}
