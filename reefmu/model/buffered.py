"""Calls of CasADi functions through buffers, without the conversions that take 20 to 50 us of an ordinary call."""

from __future__ import annotations

import threading
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

if TYPE_CHECKING:
    import casadi as ca


def bind(function: ca.Function, arguments: Sequence[memoryview], result: memoryview) -> Callable[[], Any]:
    """`function` reading `arguments` and writing its first `result` in place, called without arguments.

    The buffer holds addresses only, so the returned function also keeps the arrays alive.
    """
    buffer: Any
    buffer, evaluate = function.buffer()
    for position, argument in enumerate(arguments):
        if len(argument):  # a model without states has an empty vector, which needs no memory
            buffer.set_arg(position, argument)
    if len(result):
        buffer.set_res(0, result)

    def call(_alive: object = (buffer, tuple(arguments), result)) -> Any:
        return evaluate()

    return call


class Buffered:
    """The first result of a CasADi function of vectors, on NumPy arrays: (n_0,), (n_1,), ... -> (n,).

    Every thread has its own buffer. Like the function itself, an instance can be copied and pickled.

    >>> import casadi as ca
    >>> x, k = ca.MX.sym("x", 2), ca.MX.sym("k")
    >>> Buffered(ca.Function("scaled", [x, k], [k * x]))([1.0, 2.0], 3.0)
    array([3., 6.])
    """

    def __init__(self, function: ca.Function) -> None:
        self.function = function
        self._of_thread = threading.local()

    def __reduce__(self) -> tuple[Any, ...]:
        return Buffered, (self.function,)

    def __call__(self, *values: ArrayLike) -> NDArray[np.float64]:
        try:
            arguments, result, evaluate = self._of_thread.bound
        except AttributeError:
            arguments, result, evaluate = self._of_thread.bound = self._bound()
        for argument, value in zip(arguments, values, strict=True):
            argument[:] = value
        evaluate()
        return result.copy()

    def _bound(self) -> tuple[list[NDArray[np.float64]], NDArray[np.float64], Callable[[], Any]]:
        import casadi as ca

        symbols = self.function.mx_in()
        dense = ca.Function("dense", symbols, [ca.densify(self.function.call(symbols)[0])])
        arguments = [np.zeros(dense.numel_in(k)) for k in range(dense.n_in())]
        result = np.zeros(dense.numel_out(0))
        return arguments, result, bind(dense, [a.data for a in arguments], result.data)
