"""The functions of a component that become C: small ones in scalars, to run around the tables.

Those of `reefmu.model.stages`, on the component's own vectors x, u and p, and with them

    initial(u, p) -> x
    initial_jvp(u, p, d) -> dx            change of the first states for a change d of (u, x, p), x left out
    coefficients_jvp(p, d) -> dr
    contact_point_jvp(x, u, p, d) -> dq           change of the point
    result_jvp(x, u, p, d, c, dc) -> (dy, ddx)   change of outputs and rates with that of what the contacts give

and for a joint, which integrates itself,

    drift_angles(x, dt) -> x                        angles after dt at these speeds
    kick(x, u, dt, g, k, p, c) -> x          speeds after dt
    probe_states(p) -> (x, x)                       two motions that stretch every spring
    max_step(p, added) -> dt                     longest part of a step; added: slope that the states add, N.m/rad

and for an individual, not in scalars,

    individual(q) -> c                       what its own contacts give: `reefmu.model.stages`
    individual_jvp(q, dq) -> dc
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..model.component import Component

if TYPE_CHECKING:
    import casadi

    from reefmu.model.stages import Stages


@dataclass(frozen=True)
class GeneratedFunctions:
    """The functions by name; n_motion: how many states a joint has before the drive's own."""

    functions: dict[str, casadi.Function]
    stages: Stages
    n_motion: int


def make_functions(component: Component) -> GeneratedFunctions:
    """The pieces of a component of either kind."""
    import casadi as ca

    from reefmu.model.stages import CONTACT, make_stages, scalar_function

    model = component.model
    stages = make_stages(model.lookup, model.effects, model.individual)
    x, u, p = (
        ca.MX.sym(name, len(items))
        for name, items in (("x", component.states), ("u", component.inputs), ("p", component.parameters))
    )
    k, c, dt = ca.MX.sym("k", 2), ca.MX.sym("c", len(CONTACT)), ca.MX.sym("dt")
    functions = {"initial": scalar_function("initial", [u, p], component.initial(u, p))}
    if component.kind == "drive":
        drive = {
            "kinematics": stages.kinematics(u, p),
            "coefficients": stages.coefficients(p),
            "contact_point": stages.contact_point(x, u, k, p),
            "advance_angles": stages.advance_angles(x, u, k, p),
            "advance_time": stages.advance_time(x, u, k, dt, p, c),
            "rate": stages.rate(x, u, k, p, c),
            "output": stages.output(x, u, k, p, c),
        }
        n_motion = 0
    else:
        from ..model.joint_equations import JointStages

        joint = JointStages(component.model, stages, x, u, p, dt, k, c)
        drive, n_motion = joint.drive_stages(), 4
        functions |= joint.motion_stages()
    inside = {
        "kinematics": [x, u, p],
        "coefficients": [p],
        "contact_point": [x, u, k, p],
        "advance_angles": [x, u, k, p],
        "advance_time": [x, u, k, dt, p, c],
        "rate": [x, u, k, p, c],
        "output": [x, u, k, p, c],
    }
    functions |= {name: scalar_function(name, inside[name], drive[name]) for name in drive}

    d, dc = ca.MX.sym("d", u.numel() + x.numel() + p.numel()), ca.MX.sym("dc", len(CONTACT))
    du, dx, dp = ca.vertsplit(d, [0, u.numel(), u.numel() + x.numel(), d.numel()])
    at = ca.Function("at", [x, u, p], [functions["contact_point"](x, u, functions["kinematics"](x, u, p), p)])
    gives = ca.Function(
        "gives",
        [x, u, p, c],
        [ca.vertcat(*(functions[name](x, u, functions["kinematics"](x, u, p), p, c) for name in ("output", "rate")))],
    )
    of_point = at.forward(1)(x, u, p, ca.MX(len(stages.contact_point_names), 1), dx, du, dp)
    of_result = gives.forward(1)(x, u, p, c, ca.MX(*gives.size_out(0)), dx, du, dp, dc)
    for name, function, arguments, changes in (
        ("initial", functions["initial"], [u, p], [du, dp]),
        ("coefficients", functions["coefficients"], [p], [dp]),
    ):
        moved = function.forward(1)(*arguments, ca.MX(*function.size_out(0)), *changes)
        functions[f"{name}_jvp"] = scalar_function(f"{name}_jvp", [*arguments, d], moved)
    functions["contact_point_jvp"] = scalar_function("contact_point_jvp", [x, u, p, d], of_point)
    functions["result_jvp"] = scalar_function("result_jvp", [x, u, p, d, c, dc], of_result)
    if stages.contact is not None:
        q, dq = ca.MX.sym("q", 3), ca.MX.sym("dq", 3)
        of_contact = stages.contact.forward(1)(q, ca.MX(len(CONTACT), 1), dq)
        functions["individual_contacts"] = stages.contact
        functions["individual_jvp"] = ca.Function("individual_jvp", [q, dq], [ca.densify(of_contact)])
    return GeneratedFunctions(functions, stages, n_motion)
