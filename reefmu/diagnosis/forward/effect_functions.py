"""The equations of an effect as functions over whole traces, with their derivatives.

The equations themselves are written in `reefmu.effects` alone; CasADi differentiates them here, and NumPy evaluates
them for all samples at once.
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
"""Derivatives, a number or (n,), by parameter index; missing ones are zero."""


@dataclass(frozen=True)
class Partials:
    """Value of one expression and its partial derivatives by twist, by elastic torque, and by the indices of the
    effect's parameters and states; numbers or (n,).
    """

    value: Number
    by_twist: Number
    by_elastic: Number
    by_parameters: Tangent
    by_states: Tangent


@dataclass(frozen=True)
class EffectFunctions:
    """Functions of one effect: its contribution (one or two expressions), and for each state x the coefficients (a, b)
    of dx/ds = a x + b over its independent variable s."""

    effect: Effect
    contribution: Equations
    equations: tuple[Equations, ...]


class Equations:
    """Expressions of signals, parameters and states as a function of arrays.

    size: number of expressions; depends_on_torque: whether any depends on the elastic torque.
    """

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
        self.depends_on_torque = any(ca.depends_on(e, s["elastic_torque"]) for e in expressions)
        self._program = Program([*s.values(), *p.values(), *x.values()], wanted)

    def __call__(
        self, signals: Mapping[str, Number], parameters: Sequence[float], states: Sequence[Number]
    ) -> list[Partials]:
        """The partials of every expression; signals: by name, numbers or (n,); states: numbers or (n,)."""
        found = self._program(*(signals[name] for name in Signals._fields), *parameters, *states)
        rows: list[dict[str, Tangent]] = [
            {"value": {}, "twist": {}, "elastic": {}, "parameter": {}, "state": {}} for _ in range(self.size)
        ]
        for (row, kind, index), value in zip(self._layout, found, strict=True):
            rows[row][kind][index] = value
        return [
            Partials(
                r["value"].get(0, 0.0), r["twist"].get(0, 0.0), r["elastic"].get(0, 0.0), r["parameter"], r["state"]
            )
            for r in rows
        ]


@functools.cache
def effect_functions(name: str) -> EffectFunctions:
    """The functions of the effect of that name; raises `UnknownNameError` for any other."""
    effect = find_effect(name)

    def contribution(signals: Signals, p: dict[str, Any], x: dict[str, Any]) -> Sequence[Any]:
        result = effect.contribution(signals, p, x)
        return result if isinstance(result, tuple) else (result,)

    equations = tuple(
        Equations(effect, lambda signals, p, x, state=state: state.equation(signals, p)) for state in effect.states
    )
    return EffectFunctions(effect, Equations(effect, contribution), equations)


def accumulate(into: Tangent, other: Tangent, factor: Number = 1.0) -> None:
    """Add factor * other to a tangent in place."""
    for k, value in other.items():
        product = factor * value
        into[k] = into[k] + product if k in into else product


def scaled(tangent: Tangent, factor: Number) -> Tangent:
    """A tangent times a number or an array (n,)."""
    return {k: factor * value for k, value in tangent.items()}


def is_zero(value: Number) -> bool:
    """Whether a value is the number 0, not an array."""
    return not isinstance(value, np.ndarray) and value == 0.0


@dataclass(frozen=True)
class Dual:
    """A value, a number or (n,), and its derivatives by the parameters that it depends on."""

    value: Number
    tangent: Tangent

    def plus(self, other: Dual, sign: float = 1.0) -> Dual:
        """The sum, or with sign -1 the difference."""
        tangent = dict(self.tangent)
        accumulate(tangent, other.tangent, sign)
        return Dual(self.value + sign * other.value, tangent)
