"""Inputs and outputs of the drive model, in the order of the vectors u and y."""

from __future__ import annotations

from typing import NamedTuple


class Signal(NamedTuple):
    """One input, output or state: name, unit, description, start value, bounds and typical size.

    minimum, maximum: for the dialogues of tools. discrete: whether an output jumps from one value to another.
    """

    name: str
    unit: str
    description: str
    start: float = 0.0
    minimum: float | None = None
    maximum: float | None = None
    nominal: float | None = None
    discrete: bool = False


def _speed(shaft: str) -> str:
    """A co-simulation step takes the path of an angle from the angle itself, an integrator from the speed."""
    return (
        f"Speed of the {shaft}, d({shaft}.phi)/dt; needed by damping and by friction that depends on speed, in model "
        "exchange by all friction and wear"
    )


INPUTS = (
    Signal("crank.phi", "rad", "Angle of the crank"),
    Signal("crank.w", "rad/s", _speed("crank")),
    Signal("output.phi", "rad", "Angle of the output"),
    Signal("output.w", "rad/s", _speed("output")),
    Signal("temperature", "degC", "Temperature of the drive", 20.0, -273.15, 1000.0, 20.0),
)
OUTPUTS = (
    Signal("output.tau", "N.m", "Torque that the drive exerts on the output"),
    Signal("crank.tau", "N.m", "Torque that the drive exerts on the crank"),
    Signal("twist", "rad", "crank.phi/ratio - output.phi"),
    Signal(
        "stiffness",
        "N.m/rad",
        "Derivative of output.tau by the twist, with states, speeds and the elements' positions held: without the "
        "stiffness that friction adds in its presliding range",
        minimum=0.0,
    ),
    Signal("max_contact_force", "N", "Greatest contact force on a rolling element, mean over drives", minimum=0.0),
    Signal("load_share", "1", "Greatest torque of one rolling element over the drive's", minimum=0.0),
    Signal(
        "in_range",
        "1",
        "1 inside the lookup's range, 0 where it is extrapolated linearly",
        1.0,
        0.0,
        1.0,
        discrete=True,
    ),
    Signal("measured.tau", "N.m", "output.tau as the rig's torque sensor reads it"),
)
CONTACT_LOADS = ("max_contact_force", "load_share")
"""Outputs that a model without contacts does not have."""


def outputs_of(*, has_contacts: bool) -> tuple[Signal, ...]:
    """The outputs of a model, `OUTPUTS` or those without `CONTACT_LOADS`."""
    return tuple(signal for signal in OUTPUTS if has_contacts or signal.name not in CONTACT_LOADS)


INPUT_NAMES = tuple(signal.name for signal in INPUTS)
