"""The state shared by the dry frictions at the output shaft: how much of the friction is built up."""

from .base import Along, State


def built_up_share() -> State:
    """z in -1 ... 1 that follows the output's direction over the effect's `presliding`, rad (Dahl, 1968)."""
    return State("deflection", "1", "Share of the friction that is built up, -1 to 1", Along.OUTPUT,
                 lambda signals, p: (-1 / p["presliding"], signals.output_direction / p["presliding"]))
