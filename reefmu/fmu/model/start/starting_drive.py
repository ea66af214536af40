"""Kind `drive` with its start: the drive sees the output's angle less the twist at the start."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Any

from reefmu.model.signals import INPUT_NAMES, Signal

from .start_parameters import START_TORQUE, START_TWIST, start_parameters
from .start_search import with_start

if TYPE_CHECKING:
    from reefmu.model.stages.scalar import ScalarStages

    from ..component import Component


def starting_drive(plain: Component) -> Component:
    """Kind `drive` with its start. plain: the same component without; its functions see the output's angle less the
    state `START_TWIST`, so that the twist exceeds that of the angles by it."""
    import casadi as ca

    model, n, m = plain.model, len(plain.states), len(plain.parameters)
    last, output = f"last.{INPUT_NAMES[2].partition('.')[0]}", INPUT_NAMES.index("output.phi")
    own = start_parameters(model, f"the twist counts from the angles at the start ({START_TWIST})")
    u, p = ca.MX.sym("u", len(plain.inputs)), ca.MX.sym("p", m + len(own))
    x, dt, offset = ca.MX.sym("x", n + 1), ca.MX.sym("dt"), ca.MX.sym("offset")
    moved, drive = shifted(u, output, x[n]), p[:m]

    def states_at(value: Any) -> Any:
        begin = ca.vertcat(ca.MX.zeros(n - len(own) + 1), p[m + 1 :])
        return ca.vertcat(plain.initial(shifted(u, output, value), drive) + begin, value)

    twist = Signal(START_TWIST, "rad", f"Twist at the start beyond crank.phi/ratio - output.phi, from {START_TORQUE}")
    component = replace(
        plain,
        outputs=tuple(
            s._replace(description=f"{s.description} + {START_TWIST}") if s.name == "twist" else s
            for s in plain.outputs
        ),
        states=(
            *(
                s._replace(description=f"{s.description}, less {START_TWIST}") if s.name == last else s
                for s in plain.states
            ),
            twist,
        ),
        parameters=(*plain.parameters, *own),
        advance=ca.Function(
            "advance",
            [x, u, dt, p],
            [ca.vertcat(plain.advance(x[:n], moved, dt, drive), x[n])],
            ["x", "u", "dt", "p"],
            ["x_next"],
        ),
        rate=ca.Function("rate", [x, u, p], [ca.vertcat(plain.rate(x[:n], moved, drive), 0)], ["x", "u", "p"], ["dx"]),
        output=ca.Function("output", [x, u, p], [plain.output(x[:n], moved, drive)], ["x", "u", "p"], ["y"]),
    )
    settle = ca.vertcat(model.settle(x[:n], moved, drive), x[n])
    return with_start(
        component,
        ca.Function("start_states", [u, p, offset], [states_at(offset)]),
        ca.Function("settle", [x, u, p], [settle]),
    )


def shifted(u: Any, output: int, offset: Any) -> Any:
    """The inputs `u` of a drive with the output's angle, at the position `output`, less the offset, rad."""
    import casadi as ca

    return ca.vertcat(u[:output], u[output] - offset, u[output + 1 :])


def drive_stages(component: Component, stages: ScalarStages, symbols: dict[str, Any]) -> dict[str, Any]:
    """The stages of kind `drive`, with or without its start, as expressions of the component's vectors `symbols`, by
    name."""
    import casadi as ca

    from reefmu.model.stages.scalar import SCALAR_STAGES

    if component.start is None:
        return {s.name: stages.functions[s.name](*(symbols[name] for name in s.reads)) for s in SCALAR_STAGES}
    n, m = len(component.model.states), len(component.model.parameters)
    x, u, p = (symbols[name] for name in ("x", "u", "p"))
    output = INPUT_NAMES.index("output.phi")
    values = {**symbols, "x": x[:n], "u": shifted(u, output, x[n]), "p": p[:m]}
    found = {s.name: stages.functions[s.name](*(values[name] for name in s.reads)) for s in SCALAR_STAGES}
    constant = {s.name: x[n] if s.writes == "x" else ca.MX(0) for s in SCALAR_STAGES if s.writes in ("x", "dx")}
    return {name: ca.vertcat(value, constant[name]) if name in constant else value for name, value in found.items()}
