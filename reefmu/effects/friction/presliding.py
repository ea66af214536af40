"""The presliding state of dry friction: it builds up over a short path after every reversal (Dahl, 1968)."""

import operator

from ..base import IndependentVariable, Parameter, State

_DIRECTIONS = {
    IndependentVariable.TWIST: operator.attrgetter("twist_direction"),
    IndependentVariable.OUTPUT: operator.attrgetter("output_direction"),
}

TWIST_PRESLIDING = Parameter(
    "presliding", "rad", 5e-5, 1e-7, 0.1, 5e-5, "Twist over which friction builds up after a reversal"
)
OUTPUT_PRESLIDING = Parameter(
    "presliding", "rad", 2e-5, 1e-7, 0.1, 2e-5, "Angle over which friction builds up after a reversal"
)


def normalised_deflection(variable: IndependentVariable) -> State:
    """State z from -1 to 1 that follows the direction of twist or output over the parameter `presliding`, rad."""
    direction = _DIRECTIONS[variable]
    return State(
        "deflection",
        "1",
        "Share of the friction that is built up, -1 to 1",
        variable,
        lambda signals, p: (-1 / p["presliding"], direction(signals) / p["presliding"]),
        minimum=-1.0,
        maximum=1.0,
    )
