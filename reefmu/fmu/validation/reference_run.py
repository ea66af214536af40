"""The signal an FMU is held against the Python model with, and the two runs over it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from ..importer.instance import FmuDrive
from ..model.nominals import twist_at_full_torque

if TYPE_CHECKING:
    from ..model.component import Component

COMMUNICATION_STEPS = (1e-3, 1 / 60, 1e-6, 2.5e-3, 1e-3 / 3, 0.02, 1e-4)
"""Communication steps in s, in turn: some are no finite binary fraction, one is far below the rest."""
_AMPLITUDES = (0.05, 0.3, 1.0, 0.6, 1.2)
"""Of the twist at full torque; the third and the last reach the end of the drawn range and pass it."""
_STEPS_PER_RAMP = 12
"""Steps from one reversal to the next."""
LOADED_ROWS = tuple(_STEPS_PER_RAMP * leg + _STEPS_PER_RAMP // 4 for leg in (3, 4, 9, 11))
"""Rows between two reversals, inside the drawn range and under load of either sign."""


@dataclass(frozen=True)
class Excitation:
    """dt: steps in s, shape (n,). inputs: shape (n + 1, n_inputs), first those at initialisation."""

    names: tuple[str, ...]
    dt: NDArray[np.float64]
    inputs: NDArray[np.float64]

    def at(self, row: int) -> dict[str, float]:
        """One row of inputs by name."""
        return dict(zip(self.names, self.inputs[row].tolist(), strict=True))

    def part(self, start: int, stop: int | None) -> Excitation:
        """Steps `start` to `stop`; its first row of inputs is the one before them."""
        stop = len(self.dt) if stop is None else stop
        return Excitation(self.names, self.dt[start:stop], self.inputs[start : stop + 1])


def make_excitation(component: Component, scale: float = 1.0) -> Excitation:
    """Reversals at several amplitudes: of the twist while the crank turns both ways and the drive warms up, or of
    the torques on a joint.

    scale: to get a second signal unlike the first.
    """
    corners = [0.0]
    for amplitude in _AMPLITUDES:
        corners += [amplitude, -amplitude, 0.4 * amplitude]
    steps = _STEPS_PER_RAMP * (len(corners) - 1)
    shape = scale * np.interp(np.arange(steps + 1) / _STEPS_PER_RAMP, np.arange(len(corners)), corners)
    # A joint takes many steps of its own in one of these: a tenth of the time is as good a test.
    dt = np.resize(np.array(COMMUNICATION_STEPS), steps) * (0.1 if component.kind == "joint" else 1.0)
    time = np.concatenate([[0.0], np.cumsum(dt)])
    ratio = next(p.value for p in component.parameters if p.name == "ratio")
    if component.kind == "joint":
        load = 0.3 * component.full_torque * shape
        signals = {"load.tau": load, "motor.tau": (load + 0.02 * component.full_torque * np.sin(400 * time)) / ratio}
    else:
        crank = 0.2 + 9.0 * np.sin(2 * math.pi * time / time[-1])
        output = crank / ratio - twist_at_full_torque(component) * shape
        signals = {
            "crank.phi": crank,
            "crank.w": np.gradient(crank, time),
            "output.phi": output,
            "output.w": np.gradient(output, time),
            "temperature": 20 + 15 * time / time[-1],
        }
    columns = [signals.get(signal.name, np.full(steps + 1, signal.start)) for signal in component.inputs]
    return Excitation(tuple(signal.name for signal in component.inputs), dt, np.column_stack(columns))


def run_model(component: Component, excitation: Excitation, parameters: NDArray[np.float64]) -> NDArray[np.float64]:
    """Outputs of the Python model, shape (n + 1, n_outputs); the first row is the start."""
    states = component.initial(excitation.inputs[0], parameters)
    rows = [component.output(states, excitation.inputs[0], parameters)]
    for dt, inputs in zip(excitation.dt.tolist(), excitation.inputs[1:], strict=True):
        states = component.step(states, inputs, dt, parameters)
        rows.append(component.output(states, inputs, parameters))
    return np.array([np.asarray(row).ravel() for row in rows])


def run_fmu(drive: FmuDrive, excitation: Excitation, names: Sequence[str]) -> NDArray[np.float64]:
    """The same from an FMU that is not yet initialised; columns are the outputs `names`."""
    first = drive.initialize(excitation.at(0))
    return np.vstack([[[first[name] for name in names]], continue_fmu(drive, excitation, names)])


def continue_fmu(drive: FmuDrive, excitation: Excitation, names: Sequence[str]) -> NDArray[np.float64]:
    """The steps of `excitation` on an FMU that already runs, shape (n, n_outputs)."""
    rows = []
    for row, dt in enumerate(excitation.dt.tolist(), start=1):
        outputs = drive.step(dt, excitation.at(row))
        rows.append([outputs[name] for name in names])
    return np.array(rows)
