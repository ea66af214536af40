"""Directional derivatives of an FMU against differences of the Python model at constant states."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..importer.instance import FmuDrive
from ..model.nominals import twist_at_full_torque, with_nominals
from .reference_run import Excitation

if TYPE_CHECKING:
    from ..model.component import Component

TOLERANCE = 1e-6
"""Greatest deviation of a variable's derivatives, relative to the greatest of them. Differences across a knot of the
lookup's splines have an error of this size; elsewhere the two agree to 1e-8."""
DIFFERENCE_STEPS = (1e-3, 1e-4, 1e-5)
"""Steps of a difference, relative to the scale of an input. A shorter one is used only where a longer one disagrees,
because it crosses the onset of a contact of an individual, where the stiffness starts as a square root."""
RATE_FLOOR = 1e-3
"""1/s: a rate of change of this, times the state's nominal value, is the smallest reference for derivatives of rates.
Near saturation friction has a rate that is a difference of almost equal numbers; chosen by judgement."""
_SIXTH_ORDER = np.array([-1, 9, -45, 45, -9, 1]) / 60
_OFFSETS = (-3, -2, -1, 1, 2, 3)


def differences(function: Callable[[Array], Array], at: Array, step: Array) -> Array:
    """Jacobian of `function` at the point `at`, shape (n_results, n), by central differences of sixth order.

    step: of each argument, shape (n,). The truncation error is step^6/140 times the seventh derivative, the rounding
    error about 1e-16/step times the value.

    >>> float(differences(np.sin, np.array([0.5]), np.array([0.01]))[0, 0] - np.cos(0.5)) < 1e-13
    True
    """
    columns = []
    for k, h in enumerate(step):
        move = h * (np.arange(len(at)) == k)
        columns.append(sum(w * function(at + n * move) for w, n in zip(_SIXTH_ORDER, _OFFSETS, strict=True)) / h)
    return np.array(columns).T


def row_error(came: Array, expected: Array, value: Array, floor: Array | float = 0.0) -> Array:
    """Greatest deviation in every row, relative to the greatest derivative in it, shape (n_rows,).

    came, expected: derivatives, shape (n_rows, n). value: of each function, shape (n_rows,); 1e-4 of it and `floor` are
    the smallest references, so that rounding of a derivative near zero does not count as an error.
    """
    least = np.maximum(np.maximum(1e-4 * np.abs(value), 1e-12), floor)
    scale = np.maximum(np.abs(expected).max(axis=1), least)
    return np.abs(came - expected).max(axis=1) / scale


def derivative_error(
    drive: FmuDrive, component: Component, excitation: Excitation, rows: tuple[int, ...]
) -> tuple[float, str]:
    """The greatest `row_error` over outputs and rates at some rows of a run over `excitation`, and its variable.

    drive: not yet initialised; it runs up to the last of `rows`.
    """
    names = [signal.name for signal in component.outputs] + [f"der({signal.name})" for signal in component.states]
    states = [signal.name for signal in component.states]
    p = component.parameter_vector()
    nominal = [signal.nominal or 1.0 for signal in with_nominals(component).states]
    floor = np.concatenate([np.zeros(len(component.outputs)), RATE_FLOOR * np.array(nominal)])
    worst, where = 0.0, ""
    drive.initialize(excitation.at(0))
    for row in range(1, max(rows) + 1):
        drive.step(float(excitation.dt[row - 1]), excitation.at(row))
        if row not in rows:
            continue
        x, u = np.array(list(drive.read(states).values())), excitation.inputs[row]
        size = _input_scales(component, u)

        def values(inputs: Array, x: Array = x) -> Array:
            return np.concatenate([np.asarray(f(x, inputs, p)).ravel() for f in (component.output, component.rate)])

        came = np.array(
            [list(drive.derivative(names, {name: h}).values()) for name, h in zip(excitation.names, size, strict=True)]
        ).T
        error = np.full(len(names), np.inf)
        for step in DIFFERENCE_STEPS:
            if error.max() > TOLERANCE:
                error = np.minimum(error, row_error(came, differences(values, u, step * size) * size, values(u), floor))
        if error.max() > worst:
            worst, where = float(error.max()), names[int(error.argmax())]
    return worst, where


def _input_scales(component: Component, inputs: Array) -> Array:
    """Scale of each input for the steps: of angles a tenth of the twist at full torque, of others of their value."""
    twist = twist_at_full_torque(component) if component.kind == "drive" else 0.0
    ratio = next(abs(p.value) for p in component.parameters if p.name == "ratio")
    angles = {"crank.phi": 0.1 * ratio * twist, "output.phi": 0.1 * twist}
    return np.array(
        [
            angles.get(signal.name, 0.1 * abs(value) or 1e-3)
            for signal, value in zip(component.inputs, inputs.tolist(), strict=True)
        ]
    )
