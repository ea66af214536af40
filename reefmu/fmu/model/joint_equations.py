"""Equations of kind `joint` and their integrator: the drive between the inertias of motor and load.

Equations of motion as in `reefmu.joint.equations`. The integrator is a symplectic splitting method of fourth order
with positive coefficients only, so that it also serves the dissipative effects: Chin's scheme 4A (S. A. Chin, Physics
Letters A 226, 1997, 344),

    kick h/6, drift h/2, kick 2h/3 with the force F + h^2/24 dF/dq M^-1 F, drift h/2, kick h/6.

A drift advances the angles at constant speed, and with them the drive's states, exactly. A kick advances the speeds by
the trapezoidal rule, implicit in the speeds, so that it is stable for any damping. A communication step is divided
into equal substeps no longer than `max_step`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from reefmu.model.drive_model import DriveModel
    from reefmu.model.stages.scalar import ScalarStages

SUBSTEP_PHASE = 0.1
"""Phase, rad, of the joint's fastest oscillation in one substep: the energy is then conserved to 1e-6."""


class JointEquations:
    """Symbols and expressions of a joint.

    x: motor angle, motor speed, load angle, load speed, then the drive's states. u: motor and load torque.
    p: ratio, band, two inertias, two dampings, temperature, four start values, the parameters of the effects, those of
    `start_parameters`.
    """

    def __init__(self, model: DriveModel) -> None:
        import casadi as ca

        self.ca, self.model = ca, model
        self.x = ca.MX.sym("x", 4 + len(model.states))
        self.u, self.dt = ca.MX.sym("u", 2), ca.MX.sym("dt")
        self.n_own = sum(len(effect.states) for effect in model.effects)
        self.set_parameters(ca.MX.sym("p", len(model.parameters) + 10 + self.n_own))

    def set_parameters(self, p: Any) -> None:
        """Take `p`, shape (n_parameters,), as the vector of parameters."""
        self.p, self.ratio = p, p[0]
        self.motor_inertia, self.load_inertia, self.motor_damping, self.load_damping, self.temperature = (
            p[k] for k in range(2, 7)
        )
        end = 9 + len(self.model.parameters)
        self.p_drive, self.own_states = self.ca.vertcat(p[:2], p[11:end]), p[end + 1 :]

    def inputs(self, x: Any) -> Any:
        """The drive's inputs: the angles and speeds of the joint, and the temperature."""
        return self.ca.vertcat(x[:4], self.temperature)

    def drive(self, x: Any) -> Any:
        """The drive's outputs."""
        # Inlined, so that a derivative with respect to the speeds does not differentiate the contacts.
        return self.model.output.call([x[4:], self.inputs(x), self.p_drive], True, False)[0]

    def initial(self, offset: Any) -> Any:
        """Initial states from the start values among the parameters; their twist is exceeded by `offset`, rad."""
        ca = self.ca
        motion = ca.vertcat(self.p[7:9], self.p[9] - offset, self.p[10])
        inputs = ca.vertcat(motion, self.temperature)
        own = ca.vertcat(ca.MX.zeros(len(self.model.states) - self.n_own), self.own_states)
        return ca.vertcat(motion, self.model.initial(inputs, self.p_drive) + own)

    def settle(self) -> Any:
        """States after the torque has been held for long."""
        return self.ca.vertcat(self.x[:4], self.model.settle(self.x[4:], self.inputs(self.x), self.p_drive))

    def acceleration(self, x: Any) -> tuple[Any, Any]:
        """Angular accelerations of motor and load, shape (2,), and the drive's stiffness, N.m/rad."""
        y = self.drive(x)  # output.tau, crank.tau, twist, stiffness, ...
        return self.ca.vertcat(
            (self.u[0] - self.motor_damping * x[1] + y[1]) / self.motor_inertia,
            (self.u[1] - self.load_damping * x[3] + y[0]) / self.load_inertia,
        ), y[3]

    def drive_rate(self, x: Any) -> Any:
        """Time derivatives of the drive's states."""
        return self.model.rate(x[4:], self.inputs(x), self.p_drive)

    def rate(self) -> Any:
        """Time derivatives of all states."""
        x, (a, _) = self.x, self.acceleration(self.x)
        return self.ca.vertcat(x[1], a[0], x[3], a[1], self.drive_rate(x))

    def kick(self, x: Any, h: Any, gradient: Any) -> Any:
        """States after a kick of h seconds. gradient: factor of the term dF/dq M^-1 F, s2."""
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
        """Jacobian of the accelerations with respect to the two speeds, shape (2, 2)."""
        ca = self.ca
        speeds = ca.MX.sym("speeds", 2)
        moved = ca.vertcat(x[0], speeds[0], x[2], speeds[1], x[4:])
        a, _ = self.acceleration(moved)
        (matrix,) = ca.graph_substitute([ca.densify(ca.jacobian(a, speeds))], [speeds], [ca.vertcat(x[1], x[3])])
        return matrix

    def drift_angles(self, x: Any, h: Any) -> Any:
        """States after h seconds in which only the angles move."""
        return self.ca.vertcat(x[0] + h * x[1], x[1], x[2] + h * x[3], x[3], x[4:])

    def drift(self, x: Any, h: Any) -> Any:
        """States after a drift of h seconds: the angles, and the drive's states, which follow angles and time."""
        moved = self.drift_angles(x, h)
        if not self.model.states:
            return moved
        states = self.model.advance(moved[4:], self.inputs(moved), h, self.p_drive)
        return self.ca.vertcat(moved[:4], states)

    def advance(self) -> Any:
        """States after one substep of `dt` seconds."""
        h, ca = self.dt, self.ca
        x = ca.MX.sym("x", self.x.numel())
        c = ca.MX.sym("c")
        # As functions, so that each occurs only once in the generated code.
        kick = ca.Function("kick", [x, self.u, h, self.p, c], [self.kick(x, h, c)])
        drift = ca.Function("drift", [x, h, self.p], [self.drift(x, h)])
        after = kick(self.x, self.u, h / 6, self.p, 0)
        after = kick(drift(after, h / 2, self.p), self.u, 2 * h / 3, self.p, h**2 / 24)
        return kick(drift(after, h / 2, self.p), self.u, h / 6, self.p, 0)

    def max_step(self) -> Any:
        """Longest substep, s: `SUBSTEP_PHASE` of the oscillation at the greatest stiffness.

        The states of the effects (friction in its presliding range) add to the stiffness of the contacts while they
        follow the twist, the crank or the output, and add twice as much after a reversal.
        """
        ca = self.ca
        added = ca.MX(0)
        if self.model.states:
            state = ca.MX.sym("state", len(self.model.states))
            for x in self.probe_states():
                at = self.inputs(x)
                torques = self.model.output.call([state, at, self.p_drive], True, False)[0][:2]
                # A torque at the crank acts with the square of the ratio: once here, once in the crank's speed.
                weights = ca.horzcat(1, ca.fabs(self.ratio))
                torques_by_state = ca.fabs(ca.jacobian(torques, state))
                follow = (weights @ torques_by_state).T * self.model.rate(state, at, self.p_drive)
                (part,) = ca.graph_substitute([ca.sum1(ca.fabs(follow))], [state], [ca.MX.zeros(state.numel())])
                added = added + 2 * part
        return self.max_step_for(added)

    def probe_states(self) -> list[Any]:
        """Two states at the greatest twist of the lookup: turning at the crank only, and at crank and output."""
        ca, own = self.ca, self.x.numel() - 4
        return [ca.vertcat(0, self.ratio, -self.model.lookup.twist.stop, speed, ca.MX.zeros(own)) for speed in (0, 1)]

    def max_step_for(self, added: Any) -> Any:
        """Longest substep, s, where the states add the stiffness `added`, N.m/rad."""
        softness = 1 / (self.motor_inertia * self.ratio**2) + 1 / self.load_inertia
        return SUBSTEP_PHASE / self.ca.sqrt((maximum_stiffness(self.model) + added) * softness)


class JointStages(JointEquations):
    """The same equations around contacts that are evaluated in C. k, c: as in `reefmu.model.stages.order`."""

    def __init__(
        self, model: DriveModel, stages: ScalarStages, x: Any, u: Any, p: Any, dt: Any, k: Any, c: Any
    ) -> None:
        super().__init__(model)
        self.stages, self.x, self.u, self.dt, self.k, self.c = stages, x, u, dt, k, c
        self.set_parameters(p)

    def drive(self, x: Any) -> Any:
        return self.stages.functions["output"].call([x[4:], self.inputs(x), self.k, self.p_drive, self.c], True, False)[
            0
        ]

    def drive_rate(self, x: Any) -> Any:
        return self.stages.functions["rate"](x[4:], self.inputs(x), self.k, self.p_drive, self.c)

    def drive_stages(self) -> dict[str, Any]:
        """The drive's stages as expressions of the joint's vectors, by name."""
        from reefmu.model.stages.scalar import SCALAR_STAGES

        x, vertcat = self.x, self.ca.vertcat
        values = {
            "x": x[4:],
            "u": self.inputs(x),
            "p": self.p_drive,
            "dt": self.dt,
            "k": self.k,
            "c": self.c,
        }
        found = {
            stage.name: self.stages.functions[stage.name](*(values[name] for name in stage.reads))
            for stage in SCALAR_STAGES
            if stage.name not in ("rate", "output")
        }
        return {
            **found,
            "advance_angles": vertcat(x[:4], found["advance_angles"]),
            "advance_loaded": vertcat(x[:4], found["advance_loaded"]),
            "advance_time": vertcat(x[:4], found["advance_time"]),
            "settle": vertcat(x[:4], found["settle"]),
            "rate": self.rate(),
            "output": vertcat(x[:4], self.drive(x)),
        }

    def motion_stages(self) -> dict[str, Any]:
        """The functions that advance the inertias, by name."""
        from reefmu.model.stages.scalar import scalar_function

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
    """The greatest torsional stiffness, N.m/rad: of an individual, of a curve, or of mean and percentiles of the
    population."""
    import numpy as np

    from reefmu.effects import Place
    from stiffness_model.lookup.curve_lookup import CurveLookup

    lookup = model.lookup
    if model.individual is not None:
        from reefmu.model.contacts import individual

        return individual.maximum_stiffness(model.individual, lookup)
    if isinstance(lookup, CurveLookup):
        # An interference, which an effect on the clearance may be, loads both flanks.
        return lookup.maximum_stiffness * (2 if any(e.place is Place.CLEARANCE for e in model.effects) else 1)
    # The slope of a cubic B-spline is a weighted mean of the differences of its coefficients, so these bound it.
    return float(np.abs(np.diff(lookup.coefficients[:3], axis=1)).max() / lookup.twist.step)
