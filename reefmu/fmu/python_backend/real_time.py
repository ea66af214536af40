"""The computing time of a step: whether an FMU of the Python back end keeps up with real time."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from ..model.component import Component
from ..model.declaration import declare
from ..model.kernel import StepKernel

_REPETITIONS = 5
clock: Callable[[], float] = time.perf_counter
"""The clock, s, that times a step; tests replace it."""


def step_cost(component: Component, step: float) -> float:
    """Computing time, s, of a communication step of `step` seconds on this machine.

    The shortest of five timings of one substep, times the number of substeps: a joint may need too many to run them.
    """
    kernel = StepKernel(component, declare(component))
    kernel.initialise()
    count = component.substeps(step, np.asarray(component.parameter_vector()))
    times: list[float] = []
    for _ in range(_REPETITIONS):
        before = clock()
        kernel.step(step / count)
        times.append(clock() - before)
    return count * min(times)


def real_time_note(component: Component, step: float) -> list[str]:
    """A note of one line for a step, s, whose computing time exceeds its length; else none."""
    cost = step_cost(component, step)
    if cost <= step:
        return []
    return [
        f"slower than real time: the Python back end needs {cost:.2g} s for a step of {step:.2g} s, "
        f"{cost / step:.2g} times as long; use --backend native, some hundred times faster"
    ]
