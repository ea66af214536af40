"""The excitation for comparing an FMU with the Python model, and the runs of both over it."""

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
"""Communication steps, s, used in turn: some are not finite binary fractions, one is far shorter than the others."""
_AMPLITUDES = (0.05, 0.3, 1.0, 0.6, 1.2)
"""Amplitudes relative to the twist at full torque; the third ends the rated range, the last exceeds it."""
_STEPS_PER_RAMP = 12
"""Steps from one corner of the excitation to the next."""
LOADED_ROWS = tuple(_STEPS_PER_RAMP * leg + _STEPS_PER_RAMP // 4 for leg in (3, 4, 9, 11))
"""Rows between two reversals, within the rated range, with loads of both signs."""


@dataclass(frozen=True)
class Excitation:
    """Inputs over time. dt: steps, s, shape (n,). inputs: shape (n + 1, n_inputs), of which row 0 is the start."""

    names: tuple[str, ...]
    dt: NDArray[np.float64]
    inputs: NDArray[np.float64]

    def at(self, row: int) -> dict[str, float]:
        """The inputs of one row by name."""
        return dict(zip(self.names, self.inputs[row].tolist(), strict=True))

    def part(self, start: int, stop: int | None) -> Excitation:
        """Steps `start` to `stop`; row 0 of the inputs is the one before these steps."""
        stop = len(self.dt) if stop is None else stop
        return Excitation(self.names, self.dt[start:stop], self.inputs[start : stop + 1])


def make_excitation(component: Component, scale: float = 1.0) -> Excitation:
    """Reversals at several amplitudes, of the twist or of the torques on a joint.

    The crank of a drive oscillates meanwhile, and its temperature rises.

    scale: factor of the amplitudes, for a second excitation that differs from the first.
    """
    corners = [0.0]
    for amplitude in _AMPLITUDES:
        # The amplitudes differ, so that no sample lies at zero torque, where load-dependent friction has no derivative.
        corners += [amplitude, -0.97 * amplitude, 0.4 * amplitude]
    steps = _STEPS_PER_RAMP * (len(corners) - 1)
    shape = scale * np.interp(np.arange(steps + 1) / _STEPS_PER_RAMP, np.arange(len(corners)), corners)
    # A joint divides each step into many substeps; a tenth of the time tests it equally well.
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
    """Outputs of the Python model, shape (n + 1, n_outputs); row 0 is the start."""
    states = component.initial(excitation.inputs[0], parameters)
    rows = [component.output(states, excitation.inputs[0], parameters)]
    for dt, inputs in zip(excitation.dt.tolist(), excitation.inputs[1:], strict=True):
        states = component.step(states, inputs, dt, parameters)
        rows.append(component.output(states, inputs, parameters))
    return np.array([np.asarray(row).ravel() for row in rows])


def run_fmu(drive: FmuDrive, excitation: Excitation, names: Sequence[str]) -> NDArray[np.float64]:
    """The outputs `names` of an FMU that is not yet initialised, shape (n + 1, len(names))."""
    first = drive.initialize(excitation.at(0))
    return np.vstack([[[first[name] for name in names]], continue_fmu(drive, excitation, names)])


def continue_fmu(drive: FmuDrive, excitation: Excitation, names: Sequence[str]) -> NDArray[np.float64]:
    """The outputs `names` over the steps of `excitation` of an FMU that already runs, shape (n, len(names))."""
    rows = []
    for row, dt in enumerate(excitation.dt.tolist(), start=1):
        outputs = drive.step(dt, excitation.at(row))
        rows.append([outputs[name] for name in names])
    return np.array(rows)
