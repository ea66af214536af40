"""A measured record through an exported FMU: what a user of the FMU gets."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from reefmu.effects import EFFECTS
from reefmu.record import Record
from reefmu.simulate import record_inputs

from .host import FmuDrive

_INPUTS = ("crank.phi", "crank.w", "output.phi", "output.w", "temperature")


def replay_record(path: str | os.PathLike[str], record: Record, outputs: Sequence[str] = ("measured.tau", "stiffness")
                  ) -> dict[str, NDArray[np.float64]]:
    """Outputs (n,) of an FMU of kind `drive` over a record, sample by sample, each run from a fresh start.

    Where an effect inside never starts anew (wear, a sensor's drift), the runs follow each other without a reset,
    with the pause between two runs as one step.
    Errors: `InputError` for a file that is no such FMU or cannot run here.
    """
    inputs: list[dict[str, float]] = [dict(zip(_INPUTS, row, strict=True)) for row in record_inputs(record).tolist()]
    found = np.empty((len(record), len(outputs)))
    with FmuDrive(path) as drive:
        inside = {name.split(".")[0] for name in drive.parameters}
        lasting = any(not state.resets for name in inside & set(EFFECTS) for state in EFFECTS[name].states)
        starts = set(record.starts.tolist()) if not lasting else {0}
        for k in range(len(record)):
            if k in starts:
                if k:
                    drive.reset()
                values = drive.initialize(inputs[k])
            else:
                values = drive.step(max(float(record.time[k] - record.time[k - 1]), 0.0), inputs[k])
            found[k] = [values[name] for name in outputs]
    return dict(zip(outputs, found.T, strict=True))
