"""A measured record through an exported FMU: what a user of the FMU gets."""

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
"""s: the step where a clock stands still or starts anew. FMI 2.0.4, section 4.2.2, has none of no length, and nothing
in a drive changes in so short a one."""


def replay_record(
    path: str | os.PathLike[str], record: Record, outputs: Sequence[str] = ("measured.tau", "stiffness")
) -> dict[str, NDArray[np.float64]]:
    """Outputs (n,) of an FMU of kind `drive` over a record, sample by sample, as `reefmu.simulate.simulate_record`.

    Each run is a fresh start with a clock of its own. States that never start anew (a wear's, a sensor's drift's) go
    on over the pause between two runs, which is no time where the clock starts anew.
    Errors: `InputError` for a file that is no such FMU or cannot run here.
    """
    inputs: list[dict[str, float]] = [dict(zip(_INPUTS, row, strict=True)) for row in record_inputs(record).tolist()]
    steps = np.maximum(np.diff(record.time, prepend=record.time[0]), MIN_STEP).tolist()
    found = np.empty((len(record), len(outputs)))
    starts = set(record.starts.tolist())
    with FmuDrive(path) as drive:
        lasting = _persistent_states(drive)
        for k in range(len(record)):
            if k == 0:
                values = drive.initialize(inputs[k])
            elif k in starts:
                values = _restart(drive, lasting, steps[k], inputs[k])
            else:
                values = drive.step(steps[k], inputs[k])
            found[k] = [values[name] for name in outputs]
    return dict(zip(outputs, found.T, strict=True))


def _persistent_states(drive: FmuDrive) -> list[str]:
    """Names of the states inside that no run starts anew."""
    inside = {name.split(".")[0] for name in drive.parameters} & set(EFFECTS)
    return [f"{name}.{state.name}" for name in sorted(inside) for state in EFFECTS[name].states if not state.resets]


def _restart(drive: FmuDrive, lasting: list[str], pause: float, inputs: dict[str, float]) -> dict[str, float]:
    """Outputs at the start of a further run; lasting states have gone on over the pause, s."""
    if lasting:
        drive.step(pause, inputs)
    gone_on = drive.read(lasting)
    drive.reset()
    values = drive.initialize(inputs)
    if not lasting:
        return values
    drive.overwrite(gone_on)
    return drive.step(MIN_STEP, inputs)
