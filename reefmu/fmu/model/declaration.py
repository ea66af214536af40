"""The interface of an FMU, declared from its component: variables, what they depend on, and derivatives."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from .variables import Interface, Variable

if TYPE_CHECKING:
    import casadi

    from reefmu.model.parameters import ModelParameter
    from reefmu.model.signals import Signal

    from .component import Component


def declare(component: Component) -> Interface:
    """The interface of a component for co-simulation: inputs, outputs, parameters and states."""
    inputs = [signal.name for signal in component.inputs]
    parameters = [parameter.name for parameter in component.parameters]
    step, start_inputs, start_parameters = _output_dependencies(component)
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
                *_bounds_and_nominal(signal),
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
                *_bounds_and_nominal(signal),
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
                *_bounds_and_nominal(parameter),
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
                *_bounds_and_nominal(signal),
            )
        )
    return Interface(component.kind, component.name, tuple(variables))


def declare_with_derivatives(component: Component) -> Interface:
    """The interface of a component that also serves model exchange.

    The derivatives of the states are added, and states are listed among the dependencies of an output (FMI 2.0.4,
    section 2.2.8).
    """
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
    initial_u, initial_p = (_initial_pattern(component, argument) for argument in range(2))
    reinit = _reinit_states(component)
    for row, state in enumerate(interface.block("local")):
        variables[state.reference] = replace(
            state,
            reinit=state.name in reinit,
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
    """Names of the states that an event may set anew: those that follow an angle of kind `drive`.

    They jump where the host connects an angle without its speed, or lets the angle jump. A joint integrates its
    speeds itself, so angle and speed agree.
    """
    from reefmu.effects import IndependentVariable

    if component.max_step is not None:
        return set()
    first = component.first_indicator
    return {s.name for s in component.states[first : first + component.n_indicators]} | {
        f"{effect.name}.{state.name}"
        for effect in component.model.effects
        for state in effect.states
        if state.independent_variable is not IndependentVariable.TIME
    }


def _per_second(unit: str) -> str:
    """The unit of the time derivative of a quantity with this unit."""
    if "/" not in unit:
        return f"{unit}/s"
    numerator, _, denominator = unit.partition("/")
    return f"{numerator}/s2" if denominator == "s" else f"{numerator}/({denominator.strip('()')}.s)"


def _bounds_and_nominal(item: Signal | ModelParameter) -> tuple[float | None, float | None, float | None]:
    """min, max and nominal as FMI allows them: finite, and a nominal value above zero."""
    low, high, nominal = (
        float(value) if value is not None and math.isfinite(value) else None
        for value in (item.minimum, item.maximum, item.nominal)
    )
    return low, high, nominal if nominal is not None and nominal > 0 else None


def _selected(names: Sequence[str], row: Iterable[bool]) -> tuple[str, ...]:
    return tuple(name for name, used in zip(names, row, strict=True) if used)


def _output_dependencies(component: Component) -> tuple[NDArray[np.bool_], NDArray[np.bool_], NDArray[np.bool_]]:
    """On which inputs the outputs depend in a step, and on which inputs and parameters at initialisation.

    An output of kind `drive` depends on an input directly and through the states that follow that input within the
    step, such as friction that follows an angle. In a joint the angles are integrated, so an output depends on no
    input through a state, and there is no algebraic loop. Shapes: (n_outputs, n_inputs) twice, then
    (n_outputs, n_parameters).
    """
    of_x, of_u, of_p = (_pattern(component.output, argument) for argument in range(3))
    step = of_u | (of_x @ _pattern(component.advance, 1)) if component.max_step is None else of_u
    initial_u, initial_p = (_initial_pattern(component, argument) for argument in range(2))
    return step, of_u | (of_x @ initial_u), of_p | (of_x @ initial_p)


def _initial_pattern(component: Component, argument: int) -> NDArray[np.bool_]:
    """As `_pattern`, of the states at the start: without a torque or with it."""
    if component.start is None:
        return _pattern(component.initial, argument)
    return _pattern(component.start.search.states, argument) | _pattern(component.start.loaded, argument)


def _pattern(function: casadi.Function, argument: int) -> NDArray[np.bool_]:
    """Sparsity of the Jacobian of the first result of `function` by one argument, shape (n_result, n_argument)."""
    pattern = np.zeros((function.size1_out(0), function.size1_in(argument)), dtype=np.bool_)
    rows, columns = function.jac_sparsity(0, argument).get_triplet()
    pattern[rows, columns] = True
    return pattern
