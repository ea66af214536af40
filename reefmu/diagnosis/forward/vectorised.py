"""CasADi expressions evaluated over whole arrays by NumPy, instruction by instruction.

CasADi's virtual machine evaluates one sample at a time, and a record has ten thousand. An effect has a few dozen
operations; as many array operations take a tenth of the time. Scalars stay scalars.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import casadi as ca
import numpy as np

Number = Any
"""A float or an array (n,)."""

_UNARY: dict[int, Callable[[Number], Number]] = {
    ca.OP_NEG: np.negative,
    ca.OP_EXP: np.exp,
    ca.OP_LOG: np.log,
    ca.OP_SQRT: np.sqrt,
    ca.OP_SQ: np.square,
    ca.OP_TWICE: lambda x: 2 * x,
    ca.OP_SIN: np.sin,
    ca.OP_COS: np.cos,
    ca.OP_TAN: np.tan,
    ca.OP_TANH: np.tanh,
    ca.OP_SINH: np.sinh,
    ca.OP_COSH: np.cosh,
    ca.OP_ATAN: np.arctan,
    ca.OP_ASIN: np.arcsin,
    ca.OP_ACOS: np.arccos,
    ca.OP_FABS: np.abs,
    ca.OP_SIGN: np.sign,
    ca.OP_FLOOR: np.floor,
    ca.OP_CEIL: np.ceil,
    ca.OP_INV: lambda x: 1 / x,
    ca.OP_EXPM1: np.expm1,
    ca.OP_LOG1P: np.log1p,
    ca.OP_ASSIGN: lambda x: x,
    ca.OP_NOT: lambda x: np.asarray(np.logical_not(x), float),
}
_BINARY: dict[int, Callable[[Number, Number], Number]] = {
    ca.OP_ADD: lambda x, y: x + y,
    ca.OP_SUB: lambda x, y: x - y,
    ca.OP_MUL: lambda x, y: x * y,
    ca.OP_DIV: lambda x, y: x / y,
    ca.OP_POW: np.power,
    ca.OP_CONSTPOW: np.power,
    ca.OP_FMIN: np.minimum,
    ca.OP_FMAX: np.maximum,
    ca.OP_ATAN2: np.arctan2,
    ca.OP_FMOD: np.fmod,
    ca.OP_HYPOT: np.hypot,
    ca.OP_COPYSIGN: np.copysign,
    ca.OP_LT: lambda x, y: np.asarray(np.less(x, y), float),
    ca.OP_LE: lambda x, y: np.asarray(np.less_equal(x, y), float),
    ca.OP_EQ: lambda x, y: np.asarray(np.equal(x, y), float),
    ca.OP_NE: lambda x, y: np.asarray(np.not_equal(x, y), float),
    ca.OP_AND: lambda x, y: np.asarray(np.logical_and(x, y), float),
    ca.OP_OR: lambda x, y: np.asarray(np.logical_or(x, y), float),
    ca.OP_IF_ELSE_ZERO: lambda x, y: np.where(x, y, 0.0),
}


class Program:
    """Scalar CasADi expressions of scalar symbols; a call takes one number or array for each symbol.

    Raises `NotImplementedError` for an operation that has no counterpart in NumPy here.
    """

    def __init__(self, symbols: Sequence[ca.SX], expressions: Sequence[ca.SX]) -> None:
        function = ca.Function("program", list(symbols), list(expressions))
        self._work, self._outputs = function.sz_w(), len(expressions)
        self._steps: list[tuple[int, Sequence[int], Sequence[int], float]] = []
        for k in range(function.n_instructions()):
            op = function.instruction_id(k)
            if op not in _UNARY and op not in _BINARY and op not in (ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT):
                raise NotImplementedError(f"CasADi operation {op} has no counterpart in NumPy here")
            constant = function.instruction_constant(k) if op == ca.OP_CONST else 0.0
            self._steps.append((op, function.instruction_input(k), function.instruction_output(k), constant))

    def __call__(self, *values: Number) -> list[Number]:
        """The value of every expression, a number or an array (n,)."""
        work: list[Number] = [0.0] * max(self._work, 1)
        results: list[Number] = [0.0] * self._outputs
        for op, inputs, outputs, constant in self._steps:
            if op == ca.OP_CONST:
                work[outputs[0]] = constant
            elif op == ca.OP_INPUT:
                work[outputs[0]] = values[inputs[0]]
            elif op == ca.OP_OUTPUT:
                results[outputs[0]] = work[inputs[0]]
            elif op in _UNARY:
                work[outputs[0]] = _UNARY[op](work[inputs[0]])
            else:
                work[outputs[0]] = _BINARY[op](work[inputs[0]], work[inputs[1]])
        return results
