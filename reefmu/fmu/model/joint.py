"""Kind `joint`: the drive between motor and load, torques in and angles out, which integrates itself.

Equations as in `reefmu.joint.equations`. A step is symplectic, of fourth order, with positive parts only, so that
it serves the dissipating effects as well: Chin's scheme 4A (Physics Letters A 226, 1997, 344),

    kick h/6, drift h/2, kick 2h/3 with the force F + h^2/24 dF/dq M^-1 F, drift h/2, kick h/6.

A drift moves the angles and with them the drive's states, exactly; a kick changes the speeds, implicitly in them
(trapezoidal rule), so that no damping is too strong. Parts of a communication step are `max_step` long or shorter.
"""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any

from .component import Component

if TYPE_CHECKING:
    from reefmu.model.drive_model import DriveModel
    from reefmu.model.masses import Masses
    from reefmu.model.stages import Stages

SUBSTEP_PHASE = 0.1
"""rad of the joint's fastest oscillation in one part of a step: energy then holds to 1e-6."""


def joint_component(model: DriveModel, masses: Masses) -> Component:
    """The joint of a drive and two masses. Values of `masses` are what the parameters start from."""
    import casadi as ca

    from reefmu.model.assembly import stored_angles
    from reefmu.model.drive_model import OUTPUTS, ModelParameter, Signal

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
        Signal(name, signal.unit, f"{signal.description}: the state behind {signal.name}")
        for name, signal in zip(("motor.phi", "motor.w", "load.phi", "load.w"), motion, strict=True)
    )
    start = tuple(
        ModelParameter(f"start.{s.name}", 0.0, None, None, s.unit, f"{s.description} at the start", False, 1.0)
        for s in motion
    )
    parameters = (*model.parameters[:2], *_mass_parameters(masses), *start, *model.parameters[2:])
    system = JointEquations(model)
    n_indicators = len(stored_angles(model.effects))
    x, u, p, dt = system.x, system.u, system.p, system.dt
    return Component(
        "joint",
        model.name,
        inputs,
        (*motion, *OUTPUTS),
        (*states, *model.states),
        parameters,
        ca.Function("initial", [u, p], [system.initial()], ["u", "p"], ["x"]),
        ca.Function("advance", [x, u, dt, p], [system.advance()], ["x", "u", "dt", "p"], ["x_next"]),
        ca.Function("rate", [x, u, p], [system.rate()], ["x", "u", "p"], ["dx"]),
        ca.Function("output", [x, u, p], [ca.vertcat(x[:4], system.drive(x))], ["x", "u", "p"], ["y"]),
        model.full_torque,
        model,
        ca.Function("max_step", [p], [system.max_step()], ["p"], ["dt"]),
        4,
        n_indicators,
    )


def _mass_parameters(masses: Masses) -> tuple[Any, ...]:
    from reefmu.model.drive_model import ModelParameter
    from reefmu.model.masses import DAMPINGS, INERTIAS, Masses

    texts = {
        "motor_inertia": "Inertia that turns with the crank",
        "load_inertia": "Inertia that turns with the output",
        "motor_damping": "Viscous damping of the crank",
        "load_damping": "Viscous damping of the output",
    }
    made = []
    for field in fields(Masses):
        inertia = field.name.endswith("inertia")
        made.append(
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
    return (*made, ModelParameter("temperature", 20.0, -273.15, 1000.0, "degC", "Temperature of the drive", True, 20.0))


class JointEquations:
    """Symbols and expressions. x: the four of the motion, then the drive's; p: ratio, band, masses, start, effects."""

    def __init__(self, model: DriveModel) -> None:
        import casadi as ca

        self.ca, self.model = ca, model
        self.x = ca.MX.sym("x", 4 + len(model.states))
        self.u, self.dt = ca.MX.sym("u", 2), ca.MX.sym("dt")
        self.set_parameters(ca.MX.sym("p", len(model.parameters) + 9))

    def set_parameters(self, p: Any) -> None:
        """The vector of parameters, and what is in it."""
        self.p, self.ratio = p, p[0]
        self.motor_inertia, self.load_inertia, self.motor_damping, self.load_damping, self.temperature = (
            p[k] for k in range(2, 7)
        )
        self.p_drive = self.ca.vertcat(p[:2], p[11:])

    def inputs(self, x: Any) -> Any:
        """The drive's inputs."""
        return self.ca.vertcat(x[:4], self.temperature)

    def drive(self, x: Any) -> Any:
        """The drive's outputs."""
        # Inlined, so that a derivative by the speeds does not pass through the contacts.
        return self.model.output.call([x[4:], self.inputs(x), self.p_drive], True, False)[0]

    def initial(self) -> Any:
        motion = self.p[7:11]
        inputs = self.ca.vertcat(motion, self.temperature)
        return self.ca.vertcat(motion, self.model.initial(inputs, self.p_drive))

    def acceleration(self, x: Any) -> tuple[Any, Any]:
        """Of crank and output, (2,), and the drive's stiffness."""
        y = self.drive(x)  # output.tau, crank.tau, twist, stiffness, ...
        return self.ca.vertcat(
            (self.u[0] - self.motor_damping * x[1] + y[1]) / self.motor_inertia,
            (self.u[1] - self.load_damping * x[3] + y[0]) / self.load_inertia,
        ), y[3]

    def drive_rate(self, x: Any) -> Any:
        """Rates of the drive's states."""
        return self.model.rate(x[4:], self.inputs(x), self.p_drive)

    def rate(self) -> Any:
        x, (a, _) = self.x, self.acceleration(self.x)
        return self.ca.vertcat(x[1], a[0], x[3], a[1], self.drive_rate(x))

    def kick(self, x: Any, h: Any, gradient: Any) -> Any:
        """Speeds after h; gradient: factor of dF/dq M^-1 F."""
        ca = self.ca
        inner = ca.MX.sym("inner", x.numel())
        a, stiffness = self.acceleration(inner)
        by_speed = self._by_speed(inner)
        lever = ca.vertcat(1 / self.ratio, -1)
        response = ca.vertcat(1 / (self.ratio * self.motor_inertia), -1 / self.load_inertia)
        a = a - gradient * stiffness * ca.dot(lever, a) * response
        g = -h / 2 * by_speed
        m00, m01, m10, m11 = 1 + g[0, 0], g[0, 1], g[1, 0], 1 + g[1, 1]
        change = h / (m00 * m11 - m01 * m10) * ca.vertcat(m11 * a[0] - m01 * a[1], m00 * a[1] - m10 * a[0])
        (change,) = ca.graph_substitute([change], [inner], [x])
        return ca.vertcat(x[0], x[1] + change[0], x[2], x[3] + change[1], x[4:])

    def _by_speed(self, x: Any) -> Any:
        """Derivatives of the accelerations by the two speeds, (2, 2)."""
        ca = self.ca
        speeds = ca.MX.sym("speeds", 2)
        moved = ca.vertcat(x[0], speeds[0], x[2], speeds[1], x[4:])
        a, _ = self.acceleration(moved)
        (matrix,) = ca.graph_substitute([ca.densify(ca.jacobian(a, speeds))], [speeds], [ca.vertcat(x[1], x[3])])
        return matrix

    def drift_angles(self, x: Any, h: Any) -> Any:
        """Angles after h."""
        return self.ca.vertcat(x[0] + h * x[1], x[1], x[2] + h * x[3], x[3], x[4:])

    def drift(self, x: Any, h: Any) -> Any:
        """Angles after h, and the drive's states, which follow them and the time."""
        moved = self.drift_angles(x, h)
        if not self.model.states:
            return moved
        states = self.model.advance(moved[4:], self.inputs(moved), h, self.p_drive)
        return self.ca.vertcat(moved[:4], states)

    def advance(self) -> Any:
        h, ca = self.dt, self.ca
        x = ca.MX.sym("x", self.x.numel())
        c = ca.MX.sym("c")
        # As functions, so that each stands once in the generated code.
        kick = ca.Function("kick", [x, self.u, h, self.p, c], [self.kick(x, h, c)])
        drift = ca.Function("drift", [x, h, self.p], [self.drift(x, h)])
        after = kick(self.x, self.u, h / 6, self.p, 0)
        after = kick(drift(after, h / 2, self.p), self.u, 2 * h / 3, self.p, h**2 / 24)
        return kick(drift(after, h / 2, self.p), self.u, h / 6, self.p, 0)

    def max_step(self) -> Any:
        """Longest part of a step: `SUBSTEP_PHASE` of the oscillation on the stiffest spring there is.

        That is the contacts' greatest stiffness and what the states add to it: as they follow the twist or the
        output, they too resist, twice as much after a reversal.
        """
        ca = self.ca
        added = ca.MX(0)
        if self.model.states:
            state = ca.MX.sym("state", len(self.model.states))
            for x in self.probe_states():
                at = self.inputs(x)
                torque = self.model.output.call([state, at, self.p_drive], True, False)[0][0]
                follow = ca.jacobian(torque, state).T * self.model.rate(state, at, self.p_drive)
                (part,) = ca.graph_substitute([ca.sum1(ca.fabs(follow))], [state], [ca.MX.zeros(state.numel())])
                added = added + 2 * part
        return self.max_step_for(added)

    def probe_states(self) -> list[Any]:
        """States of two motions that wind the drive up to the end of its lookup, without and with the output."""
        ca, own = self.ca, self.x.numel() - 4
        return [ca.vertcat(0, self.ratio, -self.model.lookup.twist.stop, speed, ca.MX.zeros(own)) for speed in (0, 1)]

    def max_step_for(self, added: Any) -> Any:
        """The same, from what the states add to the slope, N.m/rad."""
        softness = 1 / (self.motor_inertia * self.ratio**2) + 1 / self.load_inertia
        return SUBSTEP_PHASE / self.ca.sqrt((maximum_stiffness(self.model) + added) * softness)


class JointStages(JointEquations):
    """The same around tables that other code reads: see `pieces`. k, c: what `reefmu.model.stages` calls so."""

    def __init__(self, model: DriveModel, stages: Stages, x: Any, u: Any, p: Any, dt: Any, k: Any, c: Any) -> None:
        super().__init__(model)
        self.stages, self.x, self.u, self.dt, self.k, self.c = stages, x, u, dt, k, c
        self.set_parameters(p)

    def drive(self, x: Any) -> Any:
        return self.stages.output.call([x[4:], self.inputs(x), self.k, self.p_drive, self.c], True, False)[0]

    def drive_rate(self, x: Any) -> Any:
        return self.stages.rate(x[4:], self.inputs(x), self.k, self.p_drive, self.c)

    def drive_stages(self) -> dict[str, Any]:
        """Expressions of the drive's stages on the joint's vectors."""
        x, k, p, c, s, vertcat = self.x, self.k, self.p_drive, self.c, self.stages, self.ca.vertcat
        u, own = self.inputs(x), x[4:]
        return {
            "kinematics": s.kinematics(u, p),
            "coefficients": s.coefficients(p),
            "contact_point": s.contact_point(own, u, k, p),
            "advance_angles": vertcat(x[:4], s.advance_angles(own, u, k, p)),
            "advance_time": vertcat(x[:4], s.advance_time(own, u, k, self.dt, p, c)),
            "rate": self.rate(),
            "output": vertcat(x[:4], self.drive(x)),
        }

    def motion_stages(self) -> dict[str, Any]:
        """The functions that move the masses."""
        from reefmu.model.stages import scalar_function

        x, u, dt, p, ca = self.x, self.u, self.dt, self.p, self.ca
        g, added = ca.MX.sym("g"), ca.MX.sym("added")
        bodies = {
            "drift_angles": ([x, dt], self.drift_angles(x, dt)),
            "kick": ([x, u, dt, g, self.k, p, self.c], self.kick(x, dt, g)),
            "probe_states": ([p], ca.vertcat(*self.probe_states())),
            "max_step": ([p, added], self.max_step_for(added)),
        }
        return {name: scalar_function(name, arguments, result) for name, (arguments, result) in bodies.items()}


def maximum_stiffness(model: DriveModel) -> float:
    """The greatest slope of the torque over twist, N.m/rad, of an individual or of mean and percentiles alike."""
    import numpy as np

    lookup = model.lookup
    if model.individual is not None:
        from reefmu.model import individual

        return individual.maximum_stiffness(model.individual, lookup)
    # The spline's slope is a mean of the differences of its coefficients.
    return float(np.abs(np.diff(lookup.coefficients[:3], axis=1)).max() / lookup.twist.step)
