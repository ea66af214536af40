"""Kinematic error: the twist of the contacts differs from that of the two angles, periodically in the crank angle."""

from typing import Any

import casadi as ca

from ..base import Effect, Identification, Parameter, Place, Requirement, Signals, ToleranceSignature, Values

ORDERS = (1, 2, 3, 4)
"""Orders k of the crank angle."""


def _contribution(signals: Signals, p: Values, x: Values) -> Any:
    return sum(p[f"amplitude_{k}"] * ca.sin(k * signals.crank_angle + p[f"phase_{k}"]) for k in ORDERS)


KINEMATIC_ERROR = Effect(
    name="kinematic_error",
    title="Transmission error of the crank's orders",
    meaning="The twist of the contacts differs from the one that crank angle and output angle give, periodically "
    "in the crank angle. A positive value of the sum of sines is subtracted from the twist. Friction and damping "
    "inside the drive act along the twist between the shafts, which contains it.",
    place=Place.KINEMATIC,
    parameters=tuple(
        parameter
        for k in ORDERS
        for parameter in (
            Parameter(f"amplitude_{k}", "rad", 0.0, 0.0, 0.1, 1e-4, f"Amplitude at {k} per turn of the crank"),
            Parameter(f"phase_{k}", "rad", 0.0, -7.0, 7.0, 1.0, f"Phase at {k} per turn of the crank"),
        )
    ),
    contribution=_contribution,
    equation="contact twist = twist - sum_k amplitude_k sin(k crank angle + phase_k)",
    excitation="At least four crank angles over a turn, or rotation.",
    source="Fourier series of the transmission error over the crank's turn.",
    amplitudes=tuple(f"amplitude_{k}" for k in ORDERS),
    identification=Identification(
        requirements=(Requirement.CRANK_ANGLE,),
        tolerance_signature=ToleranceSignature.RIPPLE,
        shown_by="loops at four or more crank angles over a turn",
    ),
)
