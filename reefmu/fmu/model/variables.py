"""Every variable of the FMU, declared once; the back ends and the XML read the declaration.

The value reference of a variable is its position, and the variables stand in blocks: inputs, outputs,
parameters, states, and for model exchange the states' derivatives. A back end can therefore keep all of them in
one array and take a vector of the model as a slice of it.
"""

from __future__ import annotations

import hashlib
import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from stiffness_model.errors import unknown_name

if TYPE_CHECKING:
    import casadi

    from reefmu.model.drive_model import DriveModel

    from .component import Component

Causality = Literal["input", "output", "parameter", "local"]
Variability = Literal["continuous", "discrete", "tunable", "fixed"]
BLOCKS: tuple[Causality, ...] = ("input", "output", "parameter", "local")
"""Order of the blocks; states are the `local` variables that are no derivatives."""


@dataclass(frozen=True)
class FmiVersion:
    """A version of FMI. first_reference: the value reference of the first variable that is declared."""

    version: str
    first_reference: int


FMI2, FMI3 = FmiVersion("2.0", 0), FmiVersion("3.0", 1)
"""From 1 in FMI 3.0, because OMSimulator takes the references there for places in the list, counted from one."""
INDICATOR_PREFIX = "indicator."
"""How the names of event indicators begin in FMI 3."""
FMI_VERSIONS = {standard.version: standard for standard in (FMI2, FMI3)}


@dataclass(frozen=True)
class Variable:
    """One Real variable (FMI 2.0.4, section 2.2.7). None: the attribute is left out.

    dependencies: of an output, the inputs it depends on in a step (section 2.2.8);
    initial_dependencies: of an output, the inputs and parameters it depends on at initialisation;
    derivative_of: of a derivative, its state; reinit: of a state, whether it may jump at an event.
    """

    reference: int
    name: str
    causality: Causality
    variability: Variability
    unit: str
    description: str
    start: float | None = None
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    dependencies: tuple[str, ...] = ()
    initial_dependencies: tuple[str, ...] = ()
    derivative_of: str = ""
    reinit: bool = False

    @property
    def initial(self) -> str | None:
        """`initial` as section 2.2.7 allows it: a parameter's start is exact, a result is calculated."""
        return {"input": None, "parameter": "exact"}.get(self.causality, "calculated")

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the greatest usable value: min and max where given, never an infinity."""
        return (
            -sys.float_info.max if self.minimum is None else self.minimum,
            sys.float_info.max if self.maximum is None else self.maximum,
        )

    def range_error(self, value: float) -> str:
        """Why `value` cannot be used here, as one line."""
        if not math.isfinite(value):
            return f"{self.name}: expected a finite number [{self.unit}], got {value}"
        low, high = self.limits
        return f"{self.name}: expected a number from {low:g} to {high:g} [{self.unit}], got {value:g}"


@dataclass(frozen=True)
class Interface:
    """The variables of one FMU, in the order of their value references."""

    kind: str
    name: str
    variables: tuple[Variable, ...]

    def block(self, causality: Causality) -> tuple[Variable, ...]:
        """The variables of one block, in the order of the model's vector."""
        return tuple(v for v in self.variables if v.causality == causality and not v.derivative_of)

    @property
    def derivatives(self) -> tuple[Variable, ...]:
        """The states' derivatives, which an FMU for model exchange has."""
        return tuple(v for v in self.variables if v.derivative_of)

    def span(self, causality: Causality) -> slice:
        """Where that block lies among all value references."""
        references = [v.reference for v in self.block(causality)]
        return slice(references[0], references[-1] + 1) if references else slice(0, 0)

    def __getitem__(self, name: str) -> Variable:
        for variable in self.variables:
            if variable.name == name:
                return variable
        raise unknown_name("FMU variable", name, (v.name for v in self.variables))

    @property
    def digest(self) -> str:
        """Hash of what a host relies on: an FMU and the package that runs it must agree on this."""
        layout = [(v.reference, v.name, v.causality, v.unit) for v in self.variables]
        return hashlib.sha256(repr((self.kind, layout)).encode()).hexdigest()[:16]


def declare_drive(model: DriveModel) -> Interface:
    """The interface of kind `drive`: the model's inputs, outputs, parameters and states."""
    from .component import drive_component

    return declare(drive_component(model))


def declare(component: Component) -> Interface:
    """The interface of a component: its inputs, outputs, parameters and states."""
    inputs = [signal.name for signal in component.inputs]
    parameters = [parameter.name for parameter in component.parameters]
    step, start_inputs, start_parameters = _dependencies(component)
    variables: list[Variable] = []
    for signal in component.inputs:
        variables.append(
            Variable(
                len(variables),
                signal.name,
                "input",
                "continuous",
                signal.unit,
                signal.description,
                float(signal.start),
                *_limits(signal.minimum, signal.maximum, signal.nominal),
            )
        )
    for row, signal in enumerate(component.outputs):
        variables.append(
            Variable(
                len(variables),
                signal.name,
                "output",
                "discrete" if signal.discrete else "continuous",
                signal.unit,
                signal.description,
                None,
                *_limits(signal.minimum, signal.maximum, signal.nominal),
                _selected(inputs, step[row]),
                _selected(inputs, start_inputs[row]) + _selected(parameters, start_parameters[row]),
            )
        )
    for parameter in component.parameters:
        variables.append(
            Variable(
                len(variables),
                parameter.name,
                "parameter",
                "tunable" if parameter.tunable else "fixed",
                parameter.unit,
                parameter.description,
                float(parameter.value),
                *_limits(parameter.minimum, parameter.maximum, parameter.nominal),
            )
        )
    for signal in component.states:
        variables.append(
            Variable(
                len(variables),
                signal.name,
                "local",
                "continuous",
                signal.unit,
                signal.description,
                None,
                *_limits(signal.minimum, signal.maximum, signal.nominal),
            )
        )
    return Interface(component.kind, component.name, tuple(variables))


def declare_with_derivatives(component: Component) -> Interface:
    """The same for an FMU that also serves model exchange: with the derivatives, and states among what an output
    depends on (FMI 2.0.4, section 2.2.8)."""
    interface = declare(component)
    states, inputs = ([v.name for v in interface.block(b)] for b in ("local", "input"))
    parameters = [p.name for p in component.parameters]
    outputs_of_x = _pattern(component.output, 0)
    variables = [
        replace(v, dependencies=v.dependencies + _selected(states, outputs_of_x[v.reference - len(inputs)]))
        if v.causality == "output"
        else v
        for v in interface.variables
    ]
    of_x, of_u, of_p = (_pattern(component.rate, argument) for argument in range(3))
    initial_u, initial_p = (_pattern(component.initial, argument) for argument in range(2))
    jumping = _reinit_states(component)
    for row, state in enumerate(interface.block("local")):
        variables[state.reference] = replace(
            state,
            reinit=state.name in jumping,
            initial_dependencies=_selected(inputs, initial_u[row]) + _selected(parameters, initial_p[row]),
        )
        variables.append(
            Variable(
                len(variables),
                f"der({state.name})",
                "local",
                "continuous",
                _per_second(state.unit),
                f"Derivative of {state.name}",
                dependencies=_selected(inputs, of_u[row]) + _selected(states, of_x[row]),
                initial_dependencies=_selected(inputs, (of_u | (of_x @ initial_u))[row])
                + _selected(parameters, (of_p | (of_x @ initial_p))[row]),
                derivative_of=state.name,
            )
        )
    return replace(interface, variables=tuple(variables))


def _reinit_states(component: Component) -> set[str]:
    """States that catch up with an angle at an event where a host has connected the angle without its speed."""
    from reefmu.effects import IndependentVariable

    if component.max_step is not None:  # the speeds are its own
        return set()
    remembered = {
        s.name for s in component.states[component.first_indicator : component.first_indicator + component.n_indicators]
    }
    return remembered | {
        f"{effect.name}.{state.name}"
        for effect in component.model.effects
        for state in effect.states
        if state.independent_variable is not IndependentVariable.TIME
    }


def _per_second(unit: str) -> str:
    """The unit of a derivative by time."""
    if "/" not in unit:
        return f"{unit}/s"
    above, _, below = unit.partition("/")
    return f"{above}/s2" if below == "s" else f"{above}/({below.strip('()')}.s)"


def _limits(
    minimum: float | None, maximum: float | None, nominal: float | None
) -> tuple[float | None, float | None, float | None]:
    """min, max and nominal as FMI may write them: no infinities, a nominal above zero."""
    low, high, size = (
        float(value) if value is not None and math.isfinite(value) else None for value in (minimum, maximum, nominal)
    )
    return low, high, size if size is not None and size > 0 else None


def _selected(names: Sequence[str], row: Iterable[bool]) -> tuple[str, ...]:
    return tuple(name for name, used in zip(names, row, strict=True) if used)


def _dependencies(component: Component) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Which outputs depend on which inputs in a step, and on which inputs and parameters at the start.

    An output sees an input directly and through the states that follow it in no time, as friction follows an angle.
    What integrates itself has none of those: there is no loop from an angle to the torque that moves it. Shapes
    (n_outputs, n_inputs) twice, then (n_outputs, n_parameters).
    """
    of_x, of_u, of_p = (_pattern(component.output, argument) for argument in range(3))
    step = of_u | (of_x @ _pattern(component.advance, 1)) if component.max_step is None else of_u
    return step, of_u | (of_x @ _pattern(component.initial, 0)), of_p | (of_x @ _pattern(component.initial, 1))


def _pattern(function: casadi.Function, argument: int) -> NDArray[np.bool_]:
    """True where the only result of `function` can change with `argument`, shape (n_result, n_argument)."""
    pattern = np.zeros((function.size1_out(0), function.size1_in(argument)), dtype=np.bool_)
    rows, columns = function.jac_sparsity(0, argument).get_triplet()
    pattern[rows, columns] = True
    return pattern
