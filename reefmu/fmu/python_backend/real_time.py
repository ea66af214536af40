"""What a step costs: whether an FMU of the Python back end keeps up with real time."""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from ..model.component import Component
from ..model.declaration import declare
from ..model.kernel import StepKernel

_TRIES = 5
clock: Callable[[], float] = time.perf_counter
"""Seconds by which a step is timed."""


def step_cost(component: Component, step: float) -> float:
    """Seconds of computing for a communication step, s, on this machine: one part of it is timed, the best of five.

    A joint takes as many parts as its fastest oscillation asks for, so they are counted and not run.
    """
    kernel = StepKernel(component, declare(component))
    kernel.initialise()
    parts = component.substeps(step, np.asarray(component.parameter_vector()))
    tries: list[float] = []
    for _ in range(_TRIES):
        before = clock()
        kernel.step(step / parts)
        tries.append(clock() - before)
    return parts * min(tries)


def real_time_note(component: Component, step: float) -> list[str]:
    """What to say of a step, s, that takes longer than it lasts: one line, or none."""
    cost = step_cost(component, step)
    if cost <= step:
        return []
    return [
        f"slower than real time: the Python back end computes for {cost:.2g} s over a step of {step:.2g} s, "
        f"{cost / step:.2g} times as long; expected --backend native, some hundred times faster"
    ]
