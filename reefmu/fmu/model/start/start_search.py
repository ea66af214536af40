"""The search for the states under a torque, for the start of an FMU and for `JointModel.equilibrium`;
`native/model/start.c` is the same in C."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from ..nominals import twist_at_full_torque
from .start_parameters import START_TORQUE

if TYPE_CHECKING:
    import casadi

    from ..component import Component

REACH = 2.0
"""Greatest twist of a start, relative to the twist at full torque; chosen by judgement."""
HALVINGS = 60
"""Halvings of the bracket of the twist: to rounding."""
STIFFNESS_FLOOR = 1e-6
"""Least stiffness, relative to full torque over the greatest twist, by which the last step of the search divides."""


@dataclass(frozen=True)
class StartSearch:
    """What the states at the start are searched with.

    states: (u, p, offset) -> x, the states at a twist that exceeds that of the angles by the offset, rad. settle:
    (x, u, p) -> x, see `reefmu.model.stages.order.SETTLE`; settles: whether it changes any. torque: position of
    `START_TORQUE` in p. reach: greatest magnitude of the twist, rad. stiffness_floor: N.m/rad.
    """

    states: casadi.Function
    settle: casadi.Function
    settles: bool
    torque: int
    reach: float
    stiffness_floor: float


@dataclass(frozen=True)
class StartFunctions:
    """The start of a component.

    loaded: (u, p, reach) -> x, the states under the torque of p, also of zero; NaN where the drive does not exert it
    within `reach`, rad, of the twist at which the search begins. limits: (u, p) -> the least and the greatest torque
    within the reach of `search`, N.m, shape (2,).
    """

    search: StartSearch
    loaded: casadi.Function
    limits: casadi.Function


def with_start(component: Component, states: casadi.Function, settle: casadi.Function) -> Component:
    """The component with `start`, and `initial` from it. states, settle: as of `StartSearch`."""
    import casadi as ca

    from ..component import drive_component

    greatest = REACH * twist_at_full_torque(drive_component(component.model, start=False))
    search = StartSearch(
        states,
        settle,
        # Of the model's states none but those that settle depends on the inputs.
        component.model.settle.jac_sparsity(0, 1).nnz() > 0,
        [p.name for p in component.parameters].index(START_TORQUE),
        greatest,
        STIFFNESS_FLOOR * component.full_torque / greatest,
    )
    u, p = ca.MX.sym("u", len(component.inputs)), ca.MX.sym("p", len(component.parameters))
    at, reach = _evaluation(component, search), ca.MX.sym("reach")
    unmoved = ca.MX.zeros(len(component.states))
    limits = _ends(at, _bracket(-at(0, u, p, unmoved)[2], greatest), u, p, unmoved) + p[search.torque]
    loaded = ca.Function("loaded", [u, p, reach], [_loaded(at, search, reach, u, p, unmoved)])
    chosen = ca.if_else(p[search.torque] == 0, states(u, p, 0), loaded(u, p, greatest), True)
    return replace(
        component,
        initial=ca.Function("initial", [u, p], [chosen], ["u", "p"], ["x"]),
        start=StartFunctions(search, loaded, ca.Function("limits", [u, p], [limits])),
    )


def _evaluation(component: Component, search: StartSearch) -> casadi.Function:
    """(offset, u, p, rest) -> excess of the torque over that of p, stiffness and twist, shape (3,); rest: added to the
    states."""
    import casadi as ca

    names = [signal.name for signal in component.outputs]
    torque, stiffness, twist = (names.index(name) for name in ("output.tau", "stiffness", "twist"))
    offset, u, p, rest = (
        ca.MX.sym(name, size)
        for name, size in (
            ("offset", 1),
            ("u", len(component.inputs)),
            ("p", len(component.parameters)),
            ("rest", len(component.states)),
        )
    )
    y = component.output(search.states(u, p, offset) + rest, u, p)
    return ca.Function("at", [offset, u, p, rest], [ca.vertcat(y[torque] - p[search.torque], y[stiffness], y[twist])])


def _bracket(center: Any, reach: Any) -> Any:
    """The least and the greatest offset of a search around `center`, rad."""
    import casadi as ca

    return center + ca.vertcat(-reach, reach)


def _ends(at: casadi.Function, bracket: Any, *given: Any) -> Any:
    """The excess of the torque at both ends of the bracket."""
    import casadi as ca

    return ca.vertcat(*(at(bracket[k], *given)[0] for k in range(2)))


def _loaded(at: casadi.Function, search: StartSearch, reach: Any, u: Any, p: Any, unmoved: Any) -> Any:
    """States in equilibrium under the torque of p: the twist, then the states that settle, then the twist again."""
    offset = _offset(at, search, _bracket(-at(0, u, p, unmoved)[2], reach), u, p, unmoved)
    states = search.states(u, p, offset)
    if not search.settles:
        return states
    rest = search.settle(states, u, p) - states
    return search.states(u, p, _offset(at, search, _bracket(offset, reach), u, p, rest)) + rest


def _offset(at: casadi.Function, search: StartSearch, first: Any, *values: Any) -> Any:
    """The offset, rad, at which the drive exerts the torque, in the bracket `first`; NaN where there is none.

    A middle at which it does so exactly is kept; in a play without a torque that is a twist of zero. values: u, p and
    rest, as of `_evaluation`.
    """
    import casadi as ca

    bracket, given = ca.MX.sym("bracket", 2), [ca.MX.sym(v.name(), v.numel()) for v in at.mx_in()[1:]]
    middle = (bracket[0] + bracket[1]) / 2
    excess = at(middle, *given)[0]
    half = ca.vertcat(ca.if_else(excess <= 0, middle, bracket[0]), ca.if_else(excess >= 0, middle, bracket[1]))
    halve = ca.Function("halve", [bracket, *given], [half]).fold(HALVINGS)
    last = halve(first, *(ca.repmat(v, 1, HALVINGS) for v in values))
    found = (last[0] + last[1]) / 2
    there = at(found, *values)
    # Newton's last step changes rounding errors only; by it the offset has derivatives.
    found = found - there[0] / ca.fmax(there[1], search.stiffness_floor)
    ends = _ends(at, first, *values)
    return found + ca.if_else(ca.logic_and(ends[0] <= 0, ends[1] >= 0), 0, np.nan)
