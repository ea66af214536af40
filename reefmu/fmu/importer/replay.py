"""A measured record through an exported FMU, to compare the corrected model with the measurement."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from reefmu.effects import EFFECTS
from reefmu.record import Record
from reefmu.simulate import record_inputs

from .instance import FmuDrive

_INPUTS = ("crank.phi", "crank.w", "output.phi", "output.w", "temperature")
MIN_STEP = 1e-12
"""Step, s, where the clock of a record stands still or restarts: FMI 2.0.4, section 4.2.2, has no step of zero length,
and no state of a drive changes noticeably within so short a step."""


def replay_record(
    path: str | os.PathLike[str], record: Record, outputs: Sequence[str] = ("measured.tau", "stiffness")
) -> dict[str, NDArray[np.float64]]:
    """Outputs, each of shape (n,), of an FMU of kind `drive` over a record, as `reefmu.simulate.simulate_record`.

    Each run is a new initialisation. States that do not reset between runs (of wear and of a sensor's drift) continue
    over the pause between two runs, which has no length where the clock restarts.
    Errors: `InputError` for a file that is not such an FMU or cannot run here.
    """
    inputs: list[dict[str, float]] = [dict(zip(_INPUTS, row, strict=True)) for row in record_inputs(record).tolist()]
    steps = np.maximum(np.diff(record.time, prepend=record.time[0]), MIN_STEP).tolist()
    columns = np.empty((len(record), len(outputs)))
    starts = set(record.starts.tolist())
    with FmuDrive(path) as drive:
        persistent = _persistent_states(drive)
        for k in range(len(record)):
            if k == 0:
                values = drive.initialize(inputs[k])
            elif k in starts:
                values = _restart(drive, persistent, steps[k], inputs[k])
            else:
                values = drive.step(steps[k], inputs[k])
            columns[k] = [values[name] for name in outputs]
    return dict(zip(outputs, columns.T, strict=True))


def _persistent_states(drive: FmuDrive) -> list[str]:
    """Names of the states that do not reset between runs."""
    effects = {name.split(".")[0] for name in drive.parameters} & set(EFFECTS)
    return [f"{name}.{state.name}" for name in sorted(effects) for state in EFFECTS[name].states if not state.resets]


def _restart(drive: FmuDrive, persistent: list[str], pause: float, inputs: dict[str, float]) -> dict[str, float]:
    """Outputs at the start of a further run, after the persistent states have continued over the pause, s."""
    if persistent:
        drive.step(pause, inputs)
    continued = drive.read(persistent)
    drive.reset()
    values = drive.initialize(inputs)
    if not persistent:
        return values
    drive.overwrite(continued)
    return drive.step(MIN_STEP, inputs)
