"""From lookup and effects to the model's functions. See `reefmu.model` for what they are."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import casadi as ca

from stiffness_model.lookup.build_lookup import Lookup
from stiffness_model.rotation import Individual

from ..effects import Effect, IndependentVariable, Place, Signals
from .contact import element_function
from .individual import individual_function
from .tables import lookup_function

INPUT_NAMES = ("crank.phi", "crank.w", "output.phi", "output.w", "temperature")
OUTPUT_NAMES = (
    "output.tau",
    "crank.tau",
    "twist",
    "stiffness",
    "max_contact_force",
    "load_share",
    "in_range",
    "measured.tau",
)

NEWTON_STEPS = 8
"""Newton steps for the twist of the contacts in series with a compliance. The residual of eight is below 1e-12
of the twist for a compliance up to three times the contacts' own (a test holds it)."""
NEWTON_TOLERANCE = 1e-10
"""rad: after a Newton step of this size the next would be below 1e-15, that is below rounding."""

_PATHS = (IndependentVariable.TWIST, IndependentVariable.CRANK, IndependentVariable.OUTPUT)


def stored_angles(effects: Sequence[Effect]) -> tuple[IndependentVariable, ...]:
    """The paths whose last value must be remembered, because a state moves along them."""
    used = {state.independent_variable for effect in effects for state in effect.states}
    return tuple(path for path in _PATHS if path in used)


def assemble(lookup: Lookup, effects: Sequence[Effect], individual: Individual | None = None) -> dict[str, ca.Function]:
    """The functions initial, advance, rate, output and jacobian by name; of an individual instead of the mean."""
    return Assembly(lookup, effects, individual).functions()


class Assembly:
    """Symbols of one model and the expressions built on them."""

    def __init__(self, lookup: Lookup, effects: Sequence[Effect], individual: Individual | None) -> None:
        self.effects = effects
        self.table = lookup_function(lookup) if individual is None else individual_function(individual, lookup)
        places = {effect.place for effect in effects}
        self.modulus = lookup.modulus if Place.MODULUS in places else None
        self.element = element_function(lookup.element) if Place.ELEMENT in places and lookup.element else None
        self.paths = stored_angles(effects)
        n_own = sum(len(e.states) for e in effects)
        n_parameters = 2 + sum(len(e.parameters) for e in effects)
        self.x = ca.MX.sym("x", len(self.paths) + n_own)
        self.u = ca.MX.sym("u", len(INPUT_NAMES))
        self.p = ca.MX.sym("p", n_parameters)
        self.dt = ca.MX.sym("dt")
        self.ratio, self.band = self.p[0], self.p[1]
        self.place = self.band if individual is None else self.u[INPUT_NAMES.index("output.phi")]
        self.values: dict[str, dict[str, ca.MX]] = {}
        at = 2
        for effect in effects:
            self.values[effect.name] = {q.name: self.p[at + k] for k, q in enumerate(effect.parameters)}
            at += len(effect.parameters)

    # -- pieces along the drive -------------------------------------------------------------------------

    def signals(self) -> Signals:
        """Signals of the inputs alone; directions are those of the speeds."""
        crank, crank_w, output, output_w, temperature = (self.u[k] for k in range(len(INPUT_NAMES)))
        twist_rate = crank_w / self.ratio - output_w
        raw = Signals(
            crank,
            crank_w,
            output,
            output_w,
            temperature,
            crank / self.ratio - output,
            twist_rate,
            ca.sign(twist_rate),
            ca.sign(crank_w),
            ca.sign(output_w),
            None,
            self.ratio,
        )
        error = self.total(Place.KINEMATIC, raw, self.x)
        return raw._replace(twist=raw.twist - error)

    def total(self, place: Place, signals: Signals, x: ca.MX) -> Any:
        """Sum of the contributions at a place."""
        return sum(
            (e.contribution(signals, self.values[e.name], self.own(e, x)) for e in self.effects if e.place is place),
            start=ca.MX(0),
        )

    def own(self, effect: Effect, x: ca.MX) -> dict[str, ca.MX]:
        """The states of one effect by name."""
        at = len(self.paths)
        for other in self.effects:
            if other is effect:
                return {s.name: x[at + k] for k, s in enumerate(effect.states)}
            at += len(other.states)
        raise AssertionError(effect.name)

    def contacts(self, signals: Signals, x: ca.MX) -> tuple[ca.MX, ca.MX, list[ca.MX]]:
        """Elastic torque, stiffness with the series compliance, and the lookup's further outputs."""
        clearance = self.total(Place.CLEARANCE, signals, x)
        compliance, offset = self.series(signals, x)
        target = signals.twist - offset
        if compliance.is_zero():
            return self.contact(target, clearance, x)
        point, correction = target, ca.MX(1)
        for _ in range(NEWTON_STEPS):
            # A step that the last one leaves nothing to do is not taken: most are not.
            point, correction = self.newton(
                ca.fabs(correction) > NEWTON_TOLERANCE,
                point,
                correction,
                target,
                clearance,
                compliance,
                x,
                self.u,
                self.p,
            )
        torque, stiffness, others = self.contact(point, clearance, x)
        # What is left of the gap is far below rounding, but its derivatives are those of the settled twist.
        torque -= stiffness * (point + compliance * torque - target) / (1 + compliance * stiffness)
        return torque, stiffness / (1 + compliance * stiffness), others

    @cached_property
    def newton(self) -> ca.Function:
        """(whether, twist of the contacts, last correction, ...) -> the next of both, or the same again."""
        point, correction, target, clearance, compliance = (
            ca.MX.sym(name) for name in ("point", "correction", "target", "clearance", "compliance")
        )
        torque, stiffness, _ = self.contact(point, clearance, self.x)
        step = (target - point - compliance * torque) / (1 + compliance * stiffness)
        arguments = [point, correction, target, clearance, compliance, self.x, self.u, self.p]
        return ca.Function.if_else(
            "newton",
            ca.Function("step", arguments, [point + step, step]),
            ca.Function("stay", arguments, [point, correction]),
        )

    def contact(self, twist: ca.MX, clearance: ca.MX, x: ca.MX) -> tuple[ca.MX, ca.MX, list[ca.MX]]:
        """Torque, stiffness and the lookup's further outputs at a twist of the contacts themselves."""
        torque, stiffness, *others = self._contact(twist, clearance, x, self.u, self.p)
        return torque, stiffness, others

    @cached_property
    def _contact(self) -> ca.Function:
        """The same as a function, whose code then stands once."""
        twist, clearance, x, signals = ca.MX.sym("twist"), ca.MX.sym("clearance"), self.x, self.signals()
        torque, stiffness, force, share, in_range = self.table(twist, clearance, self.place)
        for effect in self.effects:
            if self.element is not None and effect.place is Place.ELEMENT:
                missing, position = effect.contribution(signals, self.values[effect.name], self.own(effect, x))
                lost, lost_stiffness = self.element(twist, clearance, position)
                torque, stiffness = torque - missing * lost, stiffness - missing * lost_stiffness
        if self.modulus is not None:
            scale = self.modulus.scale(self.total(Place.MODULUS, signals, x))
            torque, stiffness, force = scale * torque, scale * stiffness, scale * force
        return ca.Function(
            "contact", [twist, clearance, x, self.u, self.p], [torque, stiffness, force, share, in_range]
        )

    def series(self, signals: Signals, x: ca.MX) -> tuple[ca.MX, ca.MX]:
        """Compliance and offset in series with the contacts."""
        parts = [
            e.contribution(signals, self.values[e.name], self.own(e, x))
            for e in self.effects
            if e.place is Place.SERIES
        ]
        return sum((c for c, _ in parts), start=ca.MX(0)), sum((o for _, o in parts), start=ca.MX(0))

    # -- states -------------------------------------------------------------------------------------------

    def path_value(self, path: IndependentVariable, signals: Signals) -> ca.MX:
        return {
            IndependentVariable.TWIST: signals.twist,
            IndependentVariable.CRANK: signals.crank_angle,
            IndependentVariable.OUTPUT: signals.output_angle,
        }[path]

    @property
    def has_time_states(self) -> bool:
        """Whether a state follows the time."""
        return any(s.independent_variable is IndependentVariable.TIME for e in self.effects for s in e.states)

    def advance(self) -> ca.MX:
        """States after dt: first those along angles, then, under the torque that gives, those along time."""
        moved = self.advance_angles()
        if not self.has_time_states:
            return moved
        in_time = ca.Function("in_time", [self.x, self.u, self.dt, self.p], [self.advance_time()])
        return in_time.call([moved, self.u, self.dt, self.p], True, False)[0]

    def advance_angles(self) -> ca.MX:
        """States after the angles have moved to those of the inputs."""
        signals = self.signals()
        change = {path: self.path_value(path, signals) - self.x[k] for k, path in enumerate(self.paths)}
        signals = signals._replace(
            twist_direction=ca.sign(change.get(IndependentVariable.TWIST, ca.MX(0))),
            crank_direction=ca.sign(change.get(IndependentVariable.CRANK, ca.MX(0))),
            output_direction=ca.sign(change.get(IndependentVariable.OUTPUT, ca.MX(0))),
        )
        length = {path: ca.fabs(value) for path, value in change.items()}
        return self._stepped(signals, self.x, lambda along: length.get(along))

    def _stepped(self, signals: Signals, x: ca.MX, length: Callable[[IndependentVariable], Any]) -> ca.MX:
        memory = [self.path_value(path, signals) for path in self.paths]
        states = []
        for effect in self.effects:
            for state, value in zip(effect.states, self.own(effect, x).values(), strict=True):
                way = length(state.independent_variable)
                if way is None:
                    states.append(value)
                    continue
                a, b = state.equation(signals, self.values[effect.name])
                states.append(value + (a * value + b) * way * _exponential_mean(ca.MX(a) * way))
        return ca.vertcat(*memory, *states)

    def advance_time(self) -> ca.MX:
        """States after dt along time alone, the angles held.

        A twist that grows under the torque also lets go of it: with the contacts linearised, that is a part of
        dx/ds = a x + b (an exponential Rosenbrock step). So a long step ends where the state comes to rest and
        does not overshoot, and a short one is right to second order in the contacts' curvature.
        """
        signals = self.signals()
        elastic, stiffness, _ = self.contacts(signals, self.x)
        torque = ca.MX.sym("torque")
        _, offset = self.series(signals, self.x)
        states = []
        for effect in self.effects:
            for state, value in zip(effect.states, self.own(effect, self.x).values(), strict=True):
                if state.independent_variable is not IndependentVariable.TIME:
                    states.append(value)
                    continue
                a, b = state.equation(signals._replace(elastic_torque=torque), self.values[effect.name])
                speed = ca.MX(a * value + b)
                let_go = stiffness * (ca.jacobian(offset, self.x) @ ca.jacobian(value, self.x).T)
                a, speed = ca.graph_substitute([a - ca.jacobian(speed, torque) * let_go, speed], [torque], [elastic])
                states.append(value + speed * self.dt * _exponential_mean(a * self.dt))
        return ca.vertcat(*(self.x[k] for k in range(len(self.paths))), *states)

    def rates(self) -> ca.MX:
        """dx/dt: the equations along the paths times the speeds along them."""
        signals = self.signals()
        torque, *_ = self.contacts(signals, self.x)
        signals = signals._replace(elastic_torque=torque)
        # The corrected twist also turns with the crank through the kinematic error.
        twist_rate = self.twist_by_crank(signals) * signals.crank_speed - signals.output_speed
        signals = signals._replace(twist_direction=ca.sign(twist_rate))
        speed = {
            IndependentVariable.TIME: ca.MX(1),
            IndependentVariable.TWIST: ca.fabs(twist_rate),
            IndependentVariable.CRANK: ca.fabs(signals.crank_speed),
            IndependentVariable.OUTPUT: ca.fabs(signals.output_speed),
        }
        memory = [
            {
                IndependentVariable.TWIST: twist_rate,
                IndependentVariable.CRANK: signals.crank_speed,
                IndependentVariable.OUTPUT: signals.output_speed,
            }[p]
            for p in self.paths
        ]
        states = []
        for effect in self.effects:
            for state, value in zip(effect.states, self.own(effect, self.x).values(), strict=True):
                a, b = state.equation(signals, self.values[effect.name])
                states.append((a * value + b) * speed[state.independent_variable])
        return ca.vertcat(*memory, *states)

    def twist_by_crank(self, signals: Signals) -> ca.MX:
        """Derivative of the corrected twist by the crank's angle; that by the output's is -1."""
        return ca.jacobian(signals.twist, self.u)[0]

    # -- outputs ------------------------------------------------------------------------------------------

    def outputs(self) -> ca.MX:
        signals = self.signals()
        elastic, stiffness, (force, share, in_range) = self.contacts(signals, self.x)
        # The parallel torques see twist and elastic torque as symbols, for their share in the stiffness.
        twist, torque = ca.MX.sym("twist"), ca.MX.sym("torque")
        parallel = self.total(Place.PARALLEL, signals._replace(twist=twist, elastic_torque=torque), self.x)
        total = torque + parallel
        by_torque, by_twist = ca.jacobian(total, torque), ca.jacobian(total, twist)
        total, by_torque, by_twist = ca.graph_substitute(
            [total, by_torque, by_twist], [twist, torque], [signals.twist, elastic]
        )
        friction = self.total(Place.OUTPUT, signals._replace(elastic_torque=elastic), self.x)
        # Virtual work: the crank feels the inner torque through the twist's derivative by its angle.
        lever = self.twist_by_crank(signals)
        raw_twist = signals.crank_angle / self.ratio - signals.output_angle
        return ca.vertcat(
            total - friction,
            -total * lever,
            raw_twist,
            by_torque * stiffness + by_twist,
            force,
            share,
            in_range,
            total - friction + self.total(Place.SENSOR, signals, self.x),
        )

    def functions(self) -> dict[str, ca.Function]:
        x, u, p = self.x, self.u, self.p
        outputs = self.outputs()
        start = [self.path_value(path, self.signals()) for path in self.paths]
        own = ca.MX.zeros(x.numel() - len(start))
        return {
            "initial": ca.Function("initial", [u, p], [ca.vertcat(*start, own)], ["u", "p"], ["x"]),
            "advance": ca.Function("advance", [x, u, self.dt, p], [self.advance()], ["x", "u", "dt", "p"], ["x_next"]),
            "rate": ca.Function("rate", [x, u, p], [self.rates()], ["x", "u", "p"], ["dx"]),
            "output": ca.Function("output", [x, u, p], [outputs], ["x", "u", "p"], ["y"]),
            "jacobian": ca.Function("jacobian", [x, u, p], [ca.jacobian(outputs, u)], ["x", "u", "p"], ["dy_du"]),
        }


def _exponential_mean(z: ca.MX) -> ca.MX:
    """(exp(z) - 1)/z, 1 at z = 0: the mean of exp over a step."""
    small = ca.fabs(z) < 1e-9
    safe = ca.if_else(small, 1, z)
    return ca.if_else(small, 1 + z / 2, ca.expm1(safe) / safe)
