"""The stages that advance the states, as CasADi expressions, and the states' rates in continuous time.

A state obeys dx/ds = a x + b, and is advanced exactly by the exponential over a change of s of any length; through its
elastic range, if it has one, by that length itself.
"""

from __future__ import annotations

from collections.abc import Callable

import casadi as ca

from ...effects import Effect, IndependentVariable, Signals, State
from .expressions import DriveExpressions
from .order import angles_under_load


def advance_angles(drive: DriveExpressions) -> ca.MX:
    """States after the angles have moved to those of the inputs; those that depend on the load, and the last values of
    the angles that they follow, wait for `advance_loaded`."""
    return _advance_along_angles(drive, drive.signals, under_load=False)


def advance_loaded(drive: DriveExpressions) -> ca.MX:
    """The remaining states along angles, once the elastic torque is known."""
    return _advance_along_angles(drive, drive.signals._replace(elastic_torque=drive.c[0]), under_load=True)


def _advance_along_angles(drive: DriveExpressions, signals: Signals, *, under_load: bool) -> ca.MX:
    waiting = angles_under_load(drive.effects)
    change = {variable: drive.angle(variable) - drive.x[k] for k, variable in enumerate(drive.angles)}
    signals = signals._replace(
        twist_direction=ca.sign(change.get(IndependentVariable.TWIST, ca.MX(0))),
        crank_direction=ca.sign(change.get(IndependentVariable.CRANK, ca.MX(0))),
        output_direction=ca.sign(change.get(IndependentVariable.OUTPUT, ca.MX(0))),
    )

    def advance(effect: Effect, state: State, value: ca.MX) -> ca.MX:
        if state.independent_variable not in change or state.depends_on_load is not under_load:
            return value
        p = drive.values[effect.name]
        a, b = state.equation(signals, p)
        length = ca.fabs(change[state.independent_variable])
        if state.elastic_range is not None:
            direction, end = state.elastic_range(signals, p)
            elastic = ca.fmin(ca.fmax(direction * (end - value), 0), length)
            value, length = value + direction * elastic, length - elastic
        return value + (a * value + b) * length * _exponential_mean(ca.MX(a) * length)

    angles = (drive.angle(v) if (v in waiting) is under_load else drive.x[k] for k, v in enumerate(drive.angles))
    return ca.vertcat(*angles, *_of_effects(drive, advance))


def advance_time(drive: DriveExpressions) -> ca.MX:
    """States after dt, the angles held.

    A twist that grows under the torque also reduces it: with the contacts linearised, that is a part of
    dx/ds = a x + b (an exponential Rosenbrock step). So a long step ends where the state comes to rest without
    overshooting, and a short one is right to second order in the contacts' curvature.
    """
    signals, elastic, stiffness = drive.signals, drive.c[0], drive.c[1]
    torque = ca.MX.sym("torque")
    _, offset = drive.series()

    def advance(effect: Effect, state: State, value: ca.MX) -> ca.MX:
        if state.independent_variable is not IndependentVariable.TIME:
            return value
        a, b = state.equation(signals._replace(elastic_torque=torque), drive.values[effect.name])
        speed = ca.MX(a * value + b)
        relief = stiffness * (ca.jacobian(offset, drive.x) @ ca.jacobian(value, drive.x).T)
        a, speed = ca.graph_substitute([a - ca.jacobian(speed, torque) * relief, speed], [torque], [elastic])
        return value + speed * drive.dt * _exponential_mean(a * drive.dt)

    return ca.vertcat(*(drive.x[k] for k in range(len(drive.angles))), *_of_effects(drive, advance))


def settle(drive: DriveExpressions) -> ca.MX:
    """States at rest under the torque: those that evolve in time are moved by what the torque adds to their equilibrium
    -b/a; what grows with time alone stays."""
    torque = ca.MX.sym("torque")
    signals = drive.signals._replace(elastic_torque=torque)

    def move(effect: Effect, state: State, value: ca.MX) -> ca.MX:
        if state.independent_variable is not IndependentVariable.TIME:
            return value
        a, b = (ca.MX(part) for part in state.equation(signals, drive.values[effect.name]))
        if not ca.depends_on(ca.vertcat(a, b), torque):
            return value
        loaded, unloaded = (ca.graph_substitute([-b / a], [torque], [t])[0] for t in (drive.c[0], ca.MX(0)))
        return value + loaded - unloaded

    return ca.vertcat(*(drive.x[k] for k in range(len(drive.angles))), *_of_effects(drive, move))


def rate(drive: DriveExpressions) -> ca.MX:
    """dx/dt: the equations along the independent variables times the speeds along them."""
    signals = drive.signals._replace(elastic_torque=drive.c[0])
    rates = {
        IndependentVariable.TWIST: signals.twist_rate,
        IndependentVariable.CRANK: signals.crank_speed,
        IndependentVariable.OUTPUT: signals.output_speed,
    }
    speeds = {IndependentVariable.TIME: ca.MX(1), **{v: ca.fabs(value) for v, value in rates.items()}}

    def change(effect: Effect, state: State, value: ca.MX) -> ca.MX:
        p = drive.values[effect.name]
        a, b = state.equation(signals, p)
        slope = a * value + b
        if state.elastic_range is not None:
            direction, end = state.elastic_range(signals, p)
            slope = ca.if_else(direction * (end - value) > 0, direction, slope)
        return slope * speeds[state.independent_variable]

    return ca.vertcat(*(rates[v] for v in drive.angles), *_of_effects(drive, change))


def _of_effects(drive: DriveExpressions, change: Callable[[Effect, State, ca.MX], ca.MX]) -> list[ca.MX]:
    """`change` of every effect's own states, in their order."""
    return [
        change(effect, state, value)
        for effect in drive.effects
        for state, value in zip(effect.states, drive.states_of(effect).values(), strict=True)
    ]


def _exponential_mean(z: ca.MX) -> ca.MX:
    """(exp(z) - 1)/z, 1 at z = 0: the mean of exp over a step."""
    small = ca.fabs(z) < 1e-9
    safe = ca.if_else(small, 1, z)
    return ca.if_else(small, 1 + z / 2, ca.expm1(safe) / safe)
