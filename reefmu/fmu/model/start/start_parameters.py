"""The parameters of a start, and the answer to a torque out of reach.

At a torque of zero the angles at the start give the twist. At any other torque the twist is the one at which the drive
exerts it, and the states that evolve in time have what it adds to them once it has been held for long: under that load
the drive stays at rest. In a joint the output's angle follows from the twist. The angles of kind `drive` are inputs, so
that its twist is counted from them: the state `START_TWIST`, which is constant, is added to the twist that they give.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    import casadi

    from reefmu.model.drive_model import DriveModel
    from reefmu.model.parameters import ModelParameter

PREFIX = "start."
START_TORQUE, START_TWIST = f"{PREFIX}torque", f"{PREFIX}twist"
REFUSAL = f"{START_TORQUE}: expected a torque from %.4g to %.4g N.m, which the drive reaches at the start, got %.6g N.m"
"""What an FMU answers to a torque out of reach, in C and in Python: least, greatest and wanted torque."""


def start_parameters(model: DriveModel, meaning: str) -> tuple[ModelParameter, ...]:
    """`START_TORQUE`, and a start value for every state of the effects. meaning: what the angles do at a torque."""
    from reefmu.model.parameters import ModelParameter

    values = {p.name: p.value for p in model.parameters}
    states = tuple(
        ModelParameter(
            f"{PREFIX}{effect.name}.{state.name}",
            0.0,
            state.minimum,
            state.maximum,
            state.unit,
            f"{state.description} (at the start, before what {START_TORQUE} adds)",
            False,
            state.nominal({q.name: values[f"{effect.name}.{q.name}"] for q in effect.parameters}, model.full_torque),
        )
        for effect in model.effects
        for state in effect.states
    )
    text = f"Torque of the drive on the output at the start, in equilibrium: {meaning}; 0: the angles give the torque"
    return (ModelParameter(START_TORQUE, 0.0, None, None, "N.m", text, False, model.full_torque), *states)


def refusal(limits: casadi.Function, u: Sequence[float], p: Sequence[float], torque: float) -> str:
    """One line on a torque, N.m, that is out of reach, with inputs u and parameters p; empty for one within.

    limits: as of `StartFunctions`.
    """
    least, greatest = np.asarray(limits(u, p)).ravel().tolist()
    return REFUSAL % (least, greatest, torque) if torque != 0 and (torque < least or torque > greatest) else ""
