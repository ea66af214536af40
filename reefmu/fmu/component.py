"""What an FMU computes: signals, parameters and functions, whatever stands behind them.

Both back ends run these functions, so both give the same numbers:

    initial(u, p) -> x          states that fit the first inputs
    advance(x, u, dt, p) -> x   states after dt seconds with the inputs held
    rate(x, u, p) -> dx/dt
    output(x, u, p) -> y
    partial(x, u, p) -> d(y, dx/dt)/d(u, x)
    pace(p) -> dt               longest step that `advance` takes at once; None: any
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    import casadi

    from reefmu.model import DriveModel, ModelParameter, Signal

Kind = Literal["drive", "joint"]
KINDS: tuple[Kind, ...] = ("drive", "joint")


@dataclass(frozen=True)
class Component:
    """Signals and parameters in the order of the vectors u, y, x and p, and the functions on them.

    switches: how many states, from `first_switch` on, remember the path that others move along; the sign of
    such a state's rate is what switches.
    """

    kind: Kind
    name: str
    inputs: tuple[Signal, ...]
    outputs: tuple[Signal, ...]
    states: tuple[Signal, ...]
    parameters: tuple[ModelParameter, ...]
    initial: casadi.Function
    advance: casadi.Function
    rate: casadi.Function
    output: casadi.Function
    pace: casadi.Function | None = None
    first_switch: int = 0
    switches: int = 0

    @cached_property
    def partial(self) -> casadi.Function:
        """(x, u, p) -> derivatives of outputs and rates (rows) by inputs and states (columns), dense."""
        import casadi as ca

        x, u, p = (ca.MX.sym(name, len(items)) for name, items in
                   (("x", self.states), ("u", self.inputs), ("p", self.parameters)))
        results = ca.vertcat(self.output(x, u, p), self.rate(x, u, p))
        matrix = ca.densify(ca.horzcat(ca.jacobian(results, u), ca.jacobian(results, x)))
        return ca.Function("partial", [x, u, p], [matrix], ["x", "u", "p"], ["d"])


def drive_component(model: DriveModel) -> Component:
    """Kind `drive`: angles and speeds in, torques out; the model itself."""
    from reefmu.assembly import carried
    from reefmu.model import INPUTS, OUTPUTS

    return Component("drive", model.name, INPUTS, OUTPUTS, model.states, model.parameters, model.initial,
                     model.advance, model.rate, model.output, switches=len(carried(model.effects)))
