"""The functions of a component for which C is generated: scalar expressions around the contacts.

These are the stages of `reefmu.model.stages.order` on the component's own vectors x, u and p, and with them

    initial(u, p) -> x
    initial_jvp(u, p, d) -> dx                     directional derivatives along d, a change of (u, x, p)
    coefficients_jvp(p, d) -> dr
    contact_point_jvp(x, u, p, d) -> dq
    result_jvp(x, u, p, d, c, dc) -> (dy, ddx)     of outputs and rates, dc: change of the outputs of the contacts

for a joint, which integrates its own motion,

    drift_angles(x, dt) -> x                       angles after dt at constant speeds
    kick(x, u, dt, g, k, p, c) -> x                speeds after dt
    probe_states(p) -> (x, x)                      the states at which `max_step` is evaluated
    max_step(p, added) -> dt                       longest substep; added: stiffness that the states add, N.m/rad

and for an individual or a curve, not expanded to scalars,

    contact_function(q) -> c                    see `reefmu.model.stages.scalar`
    contact_function_jvp(q, dq) -> dc
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from ..model.component import Component

if TYPE_CHECKING:
    import casadi

    from reefmu.model.stages.order import Stage
    from reefmu.model.stages.scalar import ScalarStages


@dataclass(frozen=True)
class GeneratedFunctions:
    """The functions of one component.

    functions: by name. stages: those of the drive. reads: by name of a stage, the arguments of its function in C.
    drift_angles: of a joint, the stages that move the angles before the drive's states follow them. n_motion: number of
    a joint's states that precede those of the drive.
    """

    functions: dict[str, casadi.Function]
    stages: ScalarStages
    reads: dict[str, tuple[str, ...]]
    drift_angles: tuple[Stage, ...]
    n_motion: int


def make_functions(component: Component) -> GeneratedFunctions:
    """The functions of a component of either kind."""
    import casadi as ca

    from reefmu.model.stages.order import CONTACT_OUTPUTS, CONTACTS, KINEMATICS, Stage
    from reefmu.model.stages.scalar import SCALAR_STAGES, make_scalar_stages, scalar_function

    model = component.model
    stages = make_scalar_stages(model.lookup, model.effects, model.individual)
    x, u, p = (
        ca.MX.sym(name, len(items))
        for name, items in (("x", component.states), ("u", component.inputs), ("p", component.parameters))
    )
    k, c, dt = ca.MX.sym("k", 2), ca.MX.sym("c", len(CONTACT_OUTPUTS)), ca.MX.sym("dt")
    symbols = {"x": x, "u": u, "p": p, "dt": dt, "k": k, "c": c}
    # The states of a joint contain the drive's angles and speeds, from which its kinematics are computed.
    reads = {s.name: ("x", *s.reads) if s is KINEMATICS else s.reads for s in (*SCALAR_STAGES, CONTACTS)}
    functions = {"initial": scalar_function("initial", [u, p], component.initial(u, p))}
    drift_angles: tuple[Stage, ...] = ()
    if component.kind == "drive":
        drive = {s.name: stages.functions[s.name](*(symbols[name] for name in s.reads)) for s in SCALAR_STAGES}
        n_motion = 0
    else:
        from ..model.joint_equations import JointStages

        joint = JointStages(component.model, stages, x, u, p, dt, k, c)
        drive, n_motion = joint.drive_stages(), 4
        functions |= joint.motion_stages()
        drift_angles = (Stage("drift_angles", ("x", "dt"), "x"), KINEMATICS)
        reads["drift_angles"] = ("x", "dt")
    functions |= {
        name: scalar_function(name, [symbols[n] for n in reads[name]], expression) for name, expression in drive.items()
    }

    d, dc = ca.MX.sym("d", u.numel() + x.numel() + p.numel()), ca.MX.sym("dc", len(CONTACT_OUTPUTS))
    du, dx, dp = ca.vertsplit(d, [0, u.numel(), u.numel() + x.numel(), d.numel()])
    at = ca.Function("at", [x, u, p], [functions["contact_point"](x, u, functions["kinematics"](x, u, p), p)])
    results = ca.Function(
        "results",
        [x, u, p, c],
        [ca.vertcat(*(functions[name](x, u, functions["kinematics"](x, u, p), p, c) for name in ("output", "rate")))],
    )
    point_jvp = at.forward(1)(x, u, p, ca.MX(len(stages.point_names), 1), dx, du, dp)
    result_jvp = results.forward(1)(x, u, p, c, ca.MX(*results.size_out(0)), dx, du, dp, dc)
    for name, function, arguments, changes in (
        ("initial", functions["initial"], [u, p], [du, dp]),
        ("coefficients", functions["coefficients"], [p], [dp]),
    ):
        jvp = function.forward(1)(*arguments, ca.MX(*function.size_out(0)), *changes)
        functions[f"{name}_jvp"] = scalar_function(f"{name}_jvp", [*arguments, d], jvp)
    functions["contact_point_jvp"] = scalar_function("contact_point_jvp", [x, u, p, d], point_jvp)
    functions["result_jvp"] = scalar_function("result_jvp", [x, u, p, d, c, dc], result_jvp)
    if stages.contact_function is not None:
        q, dq = ca.MX.sym("q", 3), ca.MX.sym("dq", 3)
        contacts_jvp = stages.contact_function.forward(1)(q, ca.MX(len(CONTACT_OUTPUTS), 1), dq)
        functions["contact_function"] = stages.contact_function
        functions["contact_function_jvp"] = ca.Function("contact_function_jvp", [q, dq], [ca.densify(contacts_jvp)])
    return GeneratedFunctions(functions, stages, reads, drift_angles, n_motion)
