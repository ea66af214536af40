"""Several kinds of discrepancy that none of the named effects describes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from . import forms
from .elements import Array
from .protocols import Schedule

KINDS = ("asymmetric", "hardening", "soft_when_warm", "wobble", "cogging", "pulsation", "zero_jump", "sensor_bend")


@dataclass(frozen=True)
class Outside:
    """One kind with its size: rad/(N.m) for hardening, otherwise relative to the torque or to full torque.

    number: within 0 ... 1, for the phase or the position.
    """

    kind: str
    size: float
    number: float = 0.0


def outside_torque(outside: Outside | None, torque: Array, test: Schedule, full: float) -> Array:
    """The elastic torque, N.m, as the discrepancy changes it."""
    if outside is None or outside.kind == "hardening":
        return torque
    size, phase = outside.size, 2 * np.pi * outside.number
    match outside.kind:
        case "asymmetric":  # one flank is stiffer than the other
            return torque * (1 + size * (torque > 0))
        case "soft_when_warm":  # the parts' modulus falls with temperature
            return torque * (1 - size * (test.temperature - 20.0) / 30.0)
        case "wobble":  # the stiffness changes over a turn of the crank, the zero does not
            return torque * (1 + size * np.sin(test.crank + phase))
        case "cogging":  # of a motor that is geared to the crank, at a fractional order
            return torque + size * full * np.sin(7.3 * test.crank + phase)
        case "pulsation":  # an oscillation in the rig's surroundings
            return torque + size * full * np.sin(2 * np.pi * test.time / 17.3 + phase)
        case "zero_jump":  # the zero of the torque sensor changed between two runs
            runs = test.run.max()
            return torque + size * full * (test.run > 1 + np.floor((runs - 1) * (0.25 + 0.5 * outside.number)))
        case "sensor_bend":  # a nonlinear characteristic of the torque sensor
            return torque * (1 + size * torque / full)
    raise ValueError(outside.kind)


def outside_series(outside: Outside | None, torque: Array, full: float) -> Array:
    """Twist, rad, that the discrepancy adds under the elastic torque."""
    if outside is None or outside.kind != "hardening":
        return np.zeros(len(torque))
    return outside.size * forms.hardening_spring(torque, full)
