"""Every variable of the FMU, declared once; the back ends and the XML read the declaration.

The value reference of a variable is its position, and the variables stand in four blocks: inputs, outputs,
parameters, states. A back end can therefore keep all of them in one array and take a vector of the model as a
slice of it.
"""

from __future__ import annotations

import hashlib
import math
import sys
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np
from numpy.typing import NDArray

from stiffness_model.errors import unknown_name

if TYPE_CHECKING:
    import casadi

    from reefmu.model import DriveModel

Causality = Literal["input", "output", "parameter", "local"]
Variability = Literal["continuous", "tunable", "fixed"]
BLOCKS: tuple[Causality, ...] = ("input", "output", "parameter", "local")
"""Order of the blocks; states are the `local` variables."""


@dataclass(frozen=True)
class Variable:
    """One Real variable (FMI 2.0.4, section 2.2.7). None: the attribute is left out.

    dependencies: of an output, the inputs it depends on in a step (section 2.2.8);
    initial_dependencies: of an output, the inputs and parameters it depends on at initialisation.
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

    @property
    def initial(self) -> str | None:
        """`initial` as section 2.2.7 allows it: a parameter's start is exact, a result is calculated."""
        return {"input": None, "parameter": "exact"}.get(self.causality, "calculated")

    @property
    def limits(self) -> tuple[float, float]:
        """The least and the greatest usable value: min and max where given, never an infinity."""
        return (-sys.float_info.max if self.minimum is None else self.minimum,
                sys.float_info.max if self.maximum is None else self.maximum)

    def refusal(self, value: float) -> str:
        """Why `value` cannot be used here, as one line."""
        if not math.isfinite(value):
            return f"{self.name}: expected a finite number [{self.unit}], got {value}"
        low, high = self.limits
        return f"{self.name}: expected a number from {low:g} to {high:g} [{self.unit}], got {value:g}"


@dataclass(frozen=True)
class Interface:
    """The variables of one FMU, in the order of their value references."""

    kind: Literal["drive"]
    name: str
    variables: tuple[Variable, ...]

    def block(self, causality: Causality) -> tuple[Variable, ...]:
        """The variables of one block, in the order of the model's vector."""
        return tuple(v for v in self.variables if v.causality == causality)

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
    from reefmu.model import INPUTS, OUTPUTS

    inputs = [signal.name for signal in INPUTS]
    parameters = [parameter.name for parameter in model.parameters]
    step, start_inputs, start_parameters = _dependencies(model)
    variables: list[Variable] = []
    for signal in INPUTS:
        variables.append(Variable(
            len(variables), signal.name, "input", "continuous", signal.unit, signal.description,
            float(signal.start), *_limits(signal.minimum, signal.maximum, signal.nominal)))
    for row, signal in enumerate(OUTPUTS):
        variables.append(Variable(
            len(variables), signal.name, "output", "continuous", signal.unit, signal.description, None,
            *_limits(signal.minimum, signal.maximum, signal.nominal),
            _chosen(inputs, step[row]),
            _chosen(inputs, start_inputs[row]) + _chosen(parameters, start_parameters[row])))
    for parameter in model.parameters:
        variables.append(Variable(
            len(variables), parameter.name, "parameter", "tunable" if parameter.tunable else "fixed",
            parameter.unit, parameter.description, float(parameter.value),
            *_limits(parameter.minimum, parameter.maximum, parameter.nominal)))
    for signal in model.states:
        variables.append(Variable(
            len(variables), signal.name, "local", "continuous", signal.unit, signal.description, None,
            *_limits(signal.minimum, signal.maximum, signal.nominal)))
    return Interface("drive", model.name, tuple(variables))


def _limits(minimum: float | None, maximum: float | None,
            nominal: float | None) -> tuple[float | None, float | None, float | None]:
    """min, max and nominal as FMI may write them: no infinities, a nominal above zero."""
    low, high, size = (float(value) if value is not None and math.isfinite(value) else None
                       for value in (minimum, maximum, nominal))
    return low, high, size if size is not None and size > 0 else None


def _chosen(names: Sequence[str], row: Iterable[bool]) -> tuple[str, ...]:
    return tuple(name for name, used in zip(names, row, strict=True) if used)


def _dependencies(model: DriveModel) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """Which outputs depend on which inputs in a step, and on which inputs and parameters at the start.

    An output sees an input directly and through the states, which follow the input within the step. Shapes
    (n_outputs, n_inputs) twice, then (n_outputs, n_parameters).
    """
    of_x, of_u, of_p = (_pattern(model.output, argument) for argument in range(3))
    step = of_u | (of_x @ _pattern(model.advance, 1))
    return step, of_u | (of_x @ _pattern(model.initial, 0)), of_p | (of_x @ _pattern(model.initial, 1))


def _pattern(function: casadi.Function, argument: int) -> NDArray[np.bool_]:
    """True where the only result of `function` can change with `argument`, shape (n_result, n_argument)."""
    pattern = np.zeros((function.size1_out(0), function.size1_in(argument)), dtype=np.bool_)
    rows, columns = function.jac_sparsity(0, argument).get_triplet()
    pattern[rows, columns] = True
    return pattern
