"""Kind `joint`: the drive between the inertias of motor and load, with torques as inputs and angles as outputs.

An FMU of this kind integrates its own motion; `joint_equations` holds the equations and the integrator.
"""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from .component import Component
from .joint_equations import JointEquations
from .start.start_parameters import PREFIX, start_parameters
from .start.start_search import with_start

if TYPE_CHECKING:
    from reefmu.model.drive_model import DriveModel
    from reefmu.model.masses import Masses


def joint_component(model: DriveModel, masses: Masses) -> Component:
    """The joint of a drive and two inertias. `masses` gives the start values of inertias and dampings."""
    import casadi as ca

    from reefmu.model.parameters import ModelParameter
    from reefmu.model.signals import Signal
    from reefmu.model.stages.order import stored_angles

    motion = (
        Signal("crank.phi", "rad", "Angle of the crank and the motor"),
        Signal("crank.w", "rad/s", "Speed of the crank and the motor"),
        Signal("output.phi", "rad", "Angle of the output and the load"),
        Signal("output.w", "rad/s", "Speed of the output and the load"),
    )
    inputs = (
        Signal("motor.tau", "N.m", "Torque of the motor on the crank"),
        Signal("load.tau", "N.m", "Torque of the load on the output"),
    )
    states = tuple(
        Signal(name, signal.unit, f"{signal.description} (state)")
        for name, signal in zip(("motor.phi", "motor.w", "load.phi", "load.w"), motion, strict=True)
    )
    motion_start = tuple(
        ModelParameter(f"{PREFIX}{s.name}", 0.0, None, None, s.unit, f"{s.description} at the start", False, 1.0)
        for s in motion
    )
    parameters = (
        *model.parameters[:2],
        *_mass_parameters(masses),
        *motion_start,
        *model.parameters[2:],
        *start_parameters(model, f"{PREFIX}output.phi follows from it"),
    )
    system = JointEquations(model)
    n_indicators = len(stored_angles(model.effects))
    x, u, p, dt, offset = system.x, system.u, system.p, system.dt, ca.MX.sym("offset")
    component = Component(
        "joint",
        model.name,
        inputs,
        (*motion, *model.outputs),
        (*states, *model.states),
        parameters,
        ca.Function("initial", [u, p], [system.initial(0)], ["u", "p"], ["x"]),
        ca.Function("advance", [x, u, dt, p], [system.advance()], ["x", "u", "dt", "p"], ["x_next"]),
        ca.Function("rate", [x, u, p], [system.rate()], ["x", "u", "p"], ["dx"]),
        ca.Function("output", [x, u, p], [ca.vertcat(x[:4], system.drive(x))], ["x", "u", "p"], ["y"]),
        model.full_torque,
        model,
        ca.Function("max_step", [p], [system.max_step()], ["p"], ["dt"]),
        4,
        n_indicators,
    )
    states = ca.Function("start_states", [u, p, offset], [system.initial(offset)])
    return with_start(component, states, ca.Function("settle", [x, u, p], [system.settle()]))


def _mass_parameters(masses: Masses) -> tuple[Any, ...]:
    from reefmu.model.masses import DAMPINGS, INERTIAS, Masses
    from reefmu.model.parameters import ModelParameter

    texts = {
        "motor_inertia": "Inertia that turns with the crank",
        "load_inertia": "Inertia that turns with the output",
        "motor_damping": "Viscous damping of the crank",
        "load_damping": "Viscous damping of the output",
    }
    parameters = []
    for field in fields(Masses):
        inertia = field.name.endswith("inertia")
        parameters.append(
            ModelParameter(
                field.name.replace("_", "."),
                float(getattr(masses, field.name)),
                *(INERTIAS if inertia else DAMPINGS),
                "kg.m2" if inertia else "N.m.s/rad",
                texts[field.name],
                True,
                1.0,
            )
        )
    return (
        *parameters,
        ModelParameter("temperature", 20.0, -273.15, 1000.0, "degC", "Temperature of the drive", True, 20.0),
    )
