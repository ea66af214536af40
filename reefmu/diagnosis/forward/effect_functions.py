"""The equations of one effect as functions over whole traces, with their derivatives.

The equations themselves stand in `reefmu.effects` and nowhere else; CasADi differentiates them here, and NumPy
evaluates them for all samples at once.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np

from ...effects import Effect, Signals, find_effect
from .vectorised import Number, Program

Tangent = dict[int, Number]
"""Derivatives by parameter index; what is missing is zero."""


@dataclass(frozen=True)
class Values:
    """Value of one expression and its derivatives that are not zero: by twist and elastic torque, by the effect's
    parameters and by its states, by their indices.
    """

    value: Number
    by_twist: Number
    by_elastic: Number
    by_parameters: Tangent
    by_states: Tangent


@dataclass(frozen=True)
class Kernel:
    """One effect: its contribution (one expression or two) and the equations (a, b) of each of its states."""

    effect: Effect
    contribution: Equations
    equations: tuple[Equations, ...]


class Equations:
    """Expressions of signals, parameters and states, over arrays."""

    def __init__(
        self, effect: Effect, build: Callable[[Signals, dict[str, Any], dict[str, Any]], Sequence[Any]]
    ) -> None:
        s = {name: ca.SX.sym(name) for name in Signals._fields}
        p = {q.name: ca.SX.sym(q.name) for q in effect.parameters}
        x = {q.name: ca.SX.sym(q.name) for q in effect.states}
        expressions = [ca.SX(e) for e in build(Signals(**s), p, x)]
        wanted: list[ca.SX] = []
        self._layout: list[tuple[int, str, int]] = []
        for row, expression in enumerate(expressions):
            by = [
                ("value", 0, expression),
                ("twist", 0, ca.gradient(expression, s["twist"])),
                ("elastic", 0, ca.gradient(expression, s["elastic_torque"])),
            ]
            by += [("parameter", k, ca.gradient(expression, symbol)) for k, symbol in enumerate(p.values())]
            by += [("state", k, ca.gradient(expression, symbol)) for k, symbol in enumerate(x.values())]
            for kind, index, slope in by:
                if not ca.SX(slope).is_zero():
                    self._layout.append((row, kind, index))
                    wanted.append(ca.SX(slope))
        self.size = len(expressions)
        self.feels_torque = any(ca.depends_on(e, s["elastic_torque"]) for e in expressions)
        self._program = Program([*s.values(), *p.values(), *x.values()], wanted)

    def __call__(
        self, signals: Mapping[str, Number], parameters: Sequence[float], states: Sequence[Number]
    ) -> list[Values]:
        """One `Values` for each expression; signals by name."""
        found = self._program(*(signals[name] for name in Signals._fields), *parameters, *states)
        rows: list[dict[str, Tangent]] = [
            {"value": {}, "twist": {}, "elastic": {}, "parameter": {}, "state": {}} for _ in range(self.size)
        ]
        for (row, kind, index), value in zip(self._layout, found, strict=True):
            rows[row][kind][index] = value
        return [
            Values(r["value"].get(0, 0.0), r["twist"].get(0, 0.0), r["elastic"].get(0, 0.0), r["parameter"], r["state"])
            for r in rows
        ]


@functools.cache
def kernel(name: str) -> Kernel:
    """The kernel of the effect of that name."""
    effect = find_effect(name)

    def contribution(signals: Signals, p: dict[str, Any], x: dict[str, Any]) -> Sequence[Any]:
        result = effect.contribution(signals, p, x)
        return result if isinstance(result, tuple) else (result,)

    equations = tuple(
        Equations(effect, lambda signals, p, x, state=state: state.equation(signals, p)) for state in effect.states
    )
    return Kernel(effect, Equations(effect, contribution), equations)


def accumulate(into: Tangent, other: Tangent, factor: Number = 1.0) -> None:
    """into += factor * other."""
    for k, value in other.items():
        product = factor * value
        into[k] = into[k] + product if k in into else product


def scaled(tangent: Tangent, factor: Number) -> Tangent:
    """factor * tangent."""
    return {k: factor * value for k, value in tangent.items()}


def is_zero(value: Number) -> bool:
    """Whether a number is the constant zero."""
    return not isinstance(value, np.ndarray) and value == 0.0
