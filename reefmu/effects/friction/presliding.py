"""What the dry frictions share: the part of the friction that is built up, and the way over which that happens."""

import operator

from ..base import IndependentVariable, Parameter, State

_DIRECTIONS = {
    IndependentVariable.TWIST: operator.attrgetter("twist_direction"),
    IndependentVariable.OUTPUT: operator.attrgetter("output_direction"),
}

TWIST_PRESLIDING = Parameter("presliding", "rad", 5e-5, 1e-7, 0.1, 5e-5, "Twist over which the torque turns over")
OUTPUT_PRESLIDING = Parameter("presliding", "rad", 2e-5, 1e-7, 0.1, 2e-5, "Way of the output over which it builds up")


def normalised_deflection(along: IndependentVariable) -> State:
    """z in -1 ... 1 that follows the direction of twist or output over the effect's `presliding`, rad (Dahl, 1968)."""
    direction = _DIRECTIONS[along]
    return State(
        "deflection",
        "1",
        "Share of the friction that is built up, -1 to 1",
        along,
        lambda signals, p: (-1 / p["presliding"], direction(signals) / p["presliding"]),
    )
