"""Nominal values of an FMU's variables and the experiment it proposes, from the drive twisted to its full torque."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from reefmu.model.masses import TYPICAL_MASSES, Masses
from stiffness_model.numerics.arrays import Array

from .start.start_parameters import START_TWIST

if TYPE_CHECKING:
    from reefmu.model.signals import Signal

    from .component import Component

TOLERANCE = 1e-6
"""Proposed relative tolerance of an integrator: the accuracy to which a joint's own steps conserve its energy."""
MAX_GROWTH_RATE = 1.0
"""Greatest growth rate, 1/s, of an oscillation that the proposed step may cause; chosen by judgement."""
PERIODS = 10
"""Periods of the joint's oscillation in the proposed experiment; chosen by judgement."""


class Experiment(NamedTuple):
    """The content of DefaultExperiment: stop time and step size, s, and relative tolerance."""

    stop_time: float
    step_size: float
    tolerance: float


def twist_at_full_torque(component: Component) -> float:
    """Smallest twist (rad) at which the drive at rest has its full torque; 0.01 rad if there is none below 1 rad."""
    torque = [signal.name for signal in component.outputs].index("output.tau")
    parameters = component.parameter_vector()
    for twist in np.geomspace(1e-5, 1.0, 200):
        inputs = _inputs_at(component, float(twist))
        states = component.initial(inputs, parameters)
        if float(np.asarray(component.output(states, inputs, parameters)).ravel()[torque]) >= component.full_torque:
            return float(twist)
    return 0.01


def stiffness_at_full_torque(component: Component) -> float:
    """The output `stiffness` (N.m/rad) of the drive at rest at full torque, where the contacts are stiffest."""
    return _outputs_at(component, twist_at_full_torque(component))["stiffness"]


def with_nominals(component: Component) -> Component:
    """The component with nominal values of outputs and states: their magnitude in the drive at full torque.

    The nominal value of an angle is the twist, on the side of the motor times the ratio; that of a joint's speed is the
    greatest speed of its free oscillation with this amplitude.
    """
    from .component import drive_component

    drive = component if component.kind == "drive" else drive_component(component.model)
    twist = twist_at_full_torque(drive)
    ratio = abs(_value(component, "ratio"))
    nominals = {name: abs(value) for name, value in _outputs_at(drive, twist).items()} | {"twist": twist}
    angles = {"crank": ratio * twist, "output": twist}
    frequency = eigenfrequency(component, joint_masses(component))
    for side, inertia in (("crank", "motor"), ("output", "load")):
        angle, speed = angles[side], angles[side] * frequency
        nominals |= {
            f"last.{side}": angle,
            f"{side}.phi": angle,
            f"{inertia}.phi": angle,
            f"{side}.w": speed,
            f"{inertia}.w": speed,
        }
    nominals |= dict.fromkeys(("last.twist", START_TWIST), twist)
    for effect in component.model.effects:
        values = {q.name: _value(component, f"{effect.name}.{q.name}") or q.nominal for q in effect.parameters}
        nominals |= {f"{effect.name}.{s.name}": s.nominal(values, component.full_torque) for s in effect.states}

    def of(signals: tuple[Signal, ...]) -> tuple[Signal, ...]:
        return tuple(s._replace(nominal=nominals.get(s.name) or s.nominal) for s in signals)

    return replace(component, outputs=of(component.outputs), states=of(component.states))


def propose_experiment(component: Component) -> Experiment:
    """Stop time and step size for which explicit integration and a zero-order hold of the torque remain stable enough.

    With the eigenfrequency omega of the drive between its inertias (`TYPICAL_MASSES` for kind `drive`), a master that
    holds the torque over a step h makes an oscillation grow at the rate 3/4 omega^2 h (`reefmu.joint.step`), the
    explicit Euler method at 1/2 omega^2 h. The step keeps the growth below `MAX_GROWTH_RATE`, and keeps Euler's method
    from overshooting the fastest state at the greatest speed of the oscillation. The experiment lasts `PERIODS` of the
    oscillation. Both times are rounded down to 1, 2 or 5 times a power of ten.
    """
    frequency = eigenfrequency(component, joint_masses(component))
    step = min(4 * MAX_GROWTH_RATE / (3 * frequency**2), 1 / max(_fastest_rate(component, frequency), frequency))
    return Experiment(rounded_down(PERIODS * math.tau / frequency), rounded_down(step), TOLERANCE)


def joint_masses(component: Component) -> Masses:
    """Motor and load of a joint, `TYPICAL_MASSES` around a drive."""
    if component.kind == "drive":
        return TYPICAL_MASSES
    return Masses(_value(component, "motor.inertia"), _value(component, "load.inertia"))


def eigenfrequency(component: Component, masses: Masses) -> float:
    """Eigenfrequency, rad/s, of the drive between these inertias at its greatest stiffness."""
    from .joint_equations import maximum_stiffness

    return math.sqrt(maximum_stiffness(component.model) / masses.reduced_inertia(_value(component, "ratio")))


def _fastest_rate(component: Component, frequency: float) -> float:
    """Greatest decay rate of a state, 1/s, at the greatest speed of the oscillation."""
    from .component import drive_component

    drive = component if component.kind == "drive" else drive_component(component.model)
    names = [s.name for s in component.inputs] + [s.name for s in component.states]
    at, p = np.zeros(len(names)), component.parameter_vector()
    at[: len(component.inputs)] = [s.start for s in component.inputs]
    at[names.index("output.w" if component.kind == "drive" else "load.w")] = -twist_at_full_torque(drive) * frequency
    n = len(component.inputs)

    def rates(z: Array) -> Array:
        return np.asarray(component.rate(z[n:], z[:n], p)).ravel()

    steps = 1e-6 * np.eye(len(names))[n:]
    return max((abs(float((rates(at + h) - rates(at))[k])) / 1e-6 for k, h in enumerate(steps)), default=0.0)


def rounded_down(value: float) -> float:
    """The greatest number of the form 1, 2 or 5 times a power of ten that is not above `value`."""
    power = 10.0 ** math.floor(math.log10(value))
    return float(f"{max(m for m in (1, 2, 5) if m * power <= value * (1 + 1e-12)) * power:.0e}")


def _value(component: Component, name: str) -> float:
    return next(q.value for q in component.parameters if q.name == name)


def _inputs_at(component: Component, twist: float) -> Array:
    inputs = np.array([signal.start for signal in component.inputs], dtype=float)
    inputs[[signal.name for signal in component.inputs].index("output.phi")] = -twist
    return inputs


def _outputs_at(component: Component, twist: float) -> dict[str, float]:
    """Outputs, by name, of a drive at rest at a twist, rad."""
    inputs, p = _inputs_at(component, twist), component.parameter_vector()
    outputs = np.asarray(component.output(component.initial(inputs, p), inputs, p)).ravel()
    return dict(zip((signal.name for signal in component.outputs), outputs.tolist(), strict=True))
