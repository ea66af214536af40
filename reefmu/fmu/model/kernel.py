"""The functions of a component on one array of doubles, without a Python object for each value and call."""

from __future__ import annotations

import math
from array import array
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from reefmu.model.buffered import bind

from .variables import Interface

if TYPE_CHECKING:
    import casadi


class StepFunctions(Protocol):
    """The functions that a kernel calls: those of a `Component` or of `equations_file.StepEquations`."""

    @property
    def initial(self) -> casadi.Function: ...
    @property
    def advance(self) -> casadi.Function: ...
    @property
    def output(self) -> casadi.Function: ...
    def substeps(self, dt: float, p: Any) -> int: ...


def substep_count(max_step: casadi.Function | None, dt: float, p: Any) -> int:
    """Number of equal substeps of a step of dt seconds, each no longer than max_step(p); 1 without `max_step`."""
    return 1 if max_step is None else max(1, math.ceil(dt / float(np.asarray(max_step(p)).item())))


class StepKernel:
    """All variables of one instance, and the two operations on them.

    values: doubles by value reference, at first the start values; results are NaN until `initialise`. An operation
    whose result is not finite returns False and leaves `values` unchanged.
    """

    def __init__(self, component: StepFunctions, interface: Interface) -> None:
        self.values = array("d", (math.nan if v.start is None else v.start for v in interface.variables))
        view = memoryview(self.values)
        u, y, p, x = (view[interface.span(block)] for block in ("input", "output", "parameter", "local"))
        self._dt = array("d", [0.0])
        self._new_x = array("d", bytes(8 * len(x)))
        self._new_y = array("d", bytes(8 * len(y)))
        self._x, self._y = x, y
        new_x, new_y = memoryview(self._new_x), memoryview(self._new_y)
        self._initial = bind(component.initial, [u, p], new_x)
        self._advance = bind(component.advance, [x, u, memoryview(self._dt), p], new_x)
        self._component, self._p = component, p
        self._output = bind(component.output, [new_x, u, p], new_y)

    def initialise(self) -> bool:
        """Compute the states consistent with the inputs, and the outputs."""
        if self._x:
            self._initial()
        return self._finish()

    def step(self, dt: float) -> bool:
        """Compute the states after `dt` seconds at constant inputs, and the outputs at the end."""
        before = bytes(self._x)
        count = self._component.substeps(dt, np.frombuffer(self._p))
        for substep in range(count if self._x else 0):
            self._dt[0] = dt / count
            self._advance()
            if substep < count - 1:
                self._x[:] = memoryview(self._new_x)
        done = self._finish()
        if not done and self._x:
            self._x.cast("B")[:] = before
        return done

    def _finish(self) -> bool:
        self._output()
        # The sum is finite only if every result is.
        if not math.isfinite(sum(self._new_x) + sum(self._new_y)):
            return False
        if self._x:
            self._x[:] = memoryview(self._new_x)
        self._y[:] = memoryview(self._new_y)
        return True
