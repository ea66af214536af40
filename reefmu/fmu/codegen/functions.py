"""The functions of a component for which C is generated: scalar expressions around the contacts.

These are the stages of `reefmu.model.stages.order` on the component's own vectors x, u and p, and with them

    initial(u, p) -> x                             of a component without `start`
    initial_jvp(u, p, d) -> dx                     directional derivatives along d, a change of (u, x, p)
    start_states(u, p, offset) -> x                of one with it
    start_states_jvp(u, p, offset, d, doffset) -> dx
    settle_jvp(x, u, p, d, c, dc) -> dx            dc: change of the outputs of the contacts
    coefficients_jvp(p, d) -> dr
    contact_point_jvp(x, u, p, d) -> dq
    result_jvp(x, u, p, d, c, dc) -> (dy, ddx)     of outputs and rates

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
from typing import TYPE_CHECKING, Any

from ..model.component import Component
from ..model.start.starting_drive import drive_stages

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

    from reefmu.model.stages.order import CONTACT_OUTPUTS, CONTACTS, KINEMATICS, SETTLE, Stage
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
    functions: dict[str, casadi.Function] = {}
    drift_angles: tuple[Stage, ...] = ()
    if component.kind == "drive":
        drive, n_motion = drive_stages(component, stages, symbols), 0
    else:
        from ..model.joint_equations import JointStages

        joint = JointStages(component.model, stages, x, u, p, dt, k, c)
        drive, n_motion = joint.drive_stages(), 4
        functions |= joint.motion_stages()
        drift_angles = (Stage("drift_angles", ("x", "dt"), "x"), KINEMATICS)
        reads["drift_angles"] = ("x", "dt")
    functions |= {
        name: scalar_function(name, [symbols[n] for n in reads[name]], expression)
        for name, expression in drive.items()
        if component.start is not None or name != SETTLE.name
    }

    functions |= _derivatives(component, functions, symbols, len(stages.point_names))
    if stages.contact_function is not None:
        q, dq = ca.MX.sym("q", 3), ca.MX.sym("dq", 3)
        contacts_jvp = stages.contact_function.forward(1)(q, ca.MX(len(CONTACT_OUTPUTS), 1), dq)
        functions["contact_function"] = stages.contact_function
        functions["contact_function_jvp"] = ca.Function("contact_function_jvp", [q, dq], [ca.densify(contacts_jvp)])
    return GeneratedFunctions(functions, stages, reads, drift_angles, n_motion)


def _derivatives(
    component: Component, functions: dict[str, casadi.Function], symbols: dict[str, Any], n_point: int
) -> dict[str, casadi.Function]:
    """The states at the start, and all directional derivatives but that of `contact_function`. n_point: length of q."""
    import casadi as ca

    from reefmu.model.stages.order import CONTACT_OUTPUTS
    from reefmu.model.stages.scalar import scalar_function

    x, u, p, c = (symbols[name] for name in ("x", "u", "p", "c"))
    d, dc = ca.MX.sym("d", u.numel() + x.numel() + p.numel()), ca.MX.sym("dc", len(CONTACT_OUTPUTS))
    du, dx, dp = ca.vertsplit(d, [0, u.numel(), u.numel() + x.numel(), d.numel()])
    at = ca.Function("at", [x, u, p], [functions["contact_point"](x, u, functions["kinematics"](x, u, p), p)])
    point_jvp = at.forward(1)(x, u, p, ca.MX(n_point, 1), dx, du, dp)
    found = {"contact_point_jvp": scalar_function("contact_point_jvp", [x, u, p, d], point_jvp)}
    offset, doffset = ca.MX.sym("offset"), ca.MX.sym("doffset")
    if (start := component.start) is None:
        first = scalar_function("initial", [u, p], component.initial(u, p))
        rows = [(first, [u, p], [du, dp], [d])]
        behind_contacts = {"result_jvp": ("output", "rate")}
    else:
        first = scalar_function("start_states", [u, p, offset], start.search.states(u, p, offset))
        rows = [(first, [u, p, offset], [du, dp, doffset], [d, doffset])]
        behind_contacts = {"result_jvp": ("output", "rate"), "settle_jvp": ("settle",)}
    found[first.name()] = first
    rows.append((functions["coefficients"], [p], [dp], [d]))
    for function, arguments, changes, directions in rows:
        name, jvp = f"{function.name()}_jvp", function.forward(1)(*arguments, ca.MX(*function.size_out(0)), *changes)
        found[name] = scalar_function(name, [*arguments, *directions], jvp)
    for name, parts in behind_contacts.items():
        values = [functions[part](x, u, functions["kinematics"](x, u, p), p, c) for part in parts]
        together = ca.Function("together", [x, u, p, c], [ca.vertcat(*values)])
        jvp = together.forward(1)(x, u, p, c, ca.MX(*together.size_out(0)), dx, du, dp, dc)
        found[name] = scalar_function(name, [x, u, p, d, c, dc], jvp)
    return found
