"""Elasto-plastic presliding: dry friction with true stiction, in the angle of the crank or of the output.

The single-state model of Dupont, Hayward, Armstrong and Altpeter, Single State Elastoplastic Friction Models, IEEE
Transactions on Automatic Control 47(5), 787-792 (2002): a bristle of deflection z at the speed v gives

    friction = stiffness z + damping dz/dt,    dz/dt = v (1 - alpha z/z_ss sign v),    z_ss = limit/stiffness

with alpha = 0 up to the deflection z_ba = `ELASTIC_SHARE` z_ss and wherever z decreases. There dz/dt = v: a load below
the break-away torque moves the shaft by the elastic deflection alone, however often it alternates. The models of Dahl
and LuGre have alpha = 1 everywhere and drift. Between z_ba and z_ss alpha is chosen here such that

    dz/dt = |v| (z_ss sign v - z)/(z_ss - z_ba + time |v|),

which is linear in z and so advanced exactly over any path. `time` is damping/stiffness, the retardation time of the
bristle; it bounds the rate of z at high speed, which in the paper has no bound.

The friction dissipates at any speed and under any change of the limit: friction v - d(stiffness z^2/2)/dt >= 0, because
0 <= dz/dt/v <= 1 below z_ss, and beyond it, after the limit has fallen, damping |dz/dt| <= stiffness |z| - limit.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import casadi as ca

from ..base import Expression, IndependentVariable, Parameter, Signals, State, Values

ELASTIC_SHARE = 0.7
"""Break-away deflection over that of steady sliding, z_ba/z_ss: the share of the limit up to which friction is elastic.
Chosen by judgement."""
_TINY = 1e-12
"""rad: keeps the quotient finite where there is neither limit nor speed."""

STIFFNESS = Parameter("stiffness", "N.m/rad", 1e3, 1e-3, 1e9, 1e3, "Stiffness of the friction before it slides")
RETARDATION = Parameter(
    "retardation", "s", 5e-4, 1e-7, 1.0, 5e-4, "Damping over stiffness of the friction before it slides"
)
"""The default, chosen by judgement, damps a motor of 1e-4 kg.m2 on a bristle of 1000 N.m/rad to 80 % of the critical
damping."""

Limit = Callable[[Signals, Values], Expression]
"""(signals, parameters) -> torque of steady sliding, N.m, at least 0."""


@dataclass(frozen=True)
class Shaft:
    """One of the two shafts: the angle that the bristle follows, and how to read its speed and direction."""

    variable: IndependentVariable
    speed: Callable[[Signals], Expression]
    direction: Callable[[Signals], Expression]


CRANK = Shaft(IndependentVariable.CRANK, operator.attrgetter("crank_speed"), operator.attrgetter("crank_direction"))
OUTPUT = Shaft(IndependentVariable.OUTPUT, operator.attrgetter("output_speed"), operator.attrgetter("output_direction"))


def bristle_deflection(
    shaft: Shaft,
    limit: Limit,
    typical_limit: Callable[[Mapping[str, float], float], float],
    *,
    depends_on_load: bool = False,
) -> State:
    """The state `deflection`, rad, of a bristle on a shaft.

    typical_limit: (parameters, full torque) -> N.m. depends_on_load: whether the limit reads the elastic torque.
    """

    def equation(signals: Signals, p: Values) -> tuple[Expression, Expression]:
        sliding, length = _sliding(shaft, limit, signals, p)
        return -1 / length, shaft.direction(signals) * sliding / length

    def elastic_range(signals: Signals, p: Values) -> tuple[Expression, Expression]:
        direction = shaft.direction(signals)
        return direction, direction * ELASTIC_SHARE * limit(signals, p) / p["stiffness"]

    return State(
        "deflection",
        "rad",
        f"Elastic deflection of the friction at the {shaft.variable.value}",
        shaft.variable,
        equation,
        nominal=lambda p, full_torque: typical_limit(p, full_torque) / p["stiffness"],
        elastic_range=elastic_range,
        depends_on_load=depends_on_load,
    )


def friction_torque(shaft: Shaft, limit: Limit, signals: Signals, p: Values, deflection: Expression) -> Expression:
    """Torque against the motion, N.m.

    The damping falls with the speed, so that its torque stays below the limit: at high speed a reversal would otherwise
    cost any torque.
    """
    speed, greatest = shaft.speed(signals), limit(signals, p)
    direction = shaft.direction(signals)
    sliding, length = _sliding(shaft, limit, signals, p)
    is_elastic = direction * deflection <= ELASTIC_SHARE * sliding
    rate = ca.if_else(is_elastic, speed, (speed * sliding - ca.fabs(speed) * deflection) / length)
    damping = p["stiffness"] * p["retardation"]
    share = greatest / (greatest + damping * ca.fabs(speed) + _TINY)
    return p["stiffness"] * deflection + damping * share * rate


def _sliding(shaft: Shaft, limit: Limit, signals: Signals, p: Values) -> tuple[Expression, Expression]:
    """Deflection of steady sliding, and the length over which it is approached beyond the elastic range, rad."""
    sliding = limit(signals, p) / p["stiffness"]
    return sliding, (1 - ELASTIC_SHARE) * sliding + p["retardation"] * ca.fabs(shaft.speed(signals)) + _TINY


def stribeck_factor(speed: Expression, excess: Expression, characteristic: Expression) -> Expression:
    """Factor of the friction of fast sliding at a speed, rad/s.

    excess: of break-away over fast sliding, relative; characteristic: speed at which 37 % of it remain. Gaussian form:
    Armstrong-Helouvry, Dupont, Canudas de Wit, A Survey of Models ... for the Control of Machines with Friction (1994).
    """
    return 1 + excess * ca.exp(-((speed / characteristic) ** 2))
