"""Hysteresis: a rate-independent torque of constant width that follows the twist's direction."""

from .base import Along, Effect, Parameter, Place, State

HYSTERESIS = Effect(
    name="hysteresis",
    title="Rate-independent friction inside the drive",
    place=Place.PARALLEL,
    parameters=(
        Parameter("torque", "N.m", 0.0, 0.0, 1e4, 2.0, "Half the width of the loop"),
        Parameter("presliding", "rad", 5e-5, 1e-7, 0.1, 5e-5, "Twist over which the torque turns over"),
    ),
    states=(
        State("deflection", "1", "Share of the friction that is built up, -1 to 1", Along.TWIST,
              lambda signals, p: (-1 / p["presliding"], signals.twist_direction / p["presliding"])),
    ),
    contribution=lambda signals, p, x: p["torque"] * x["deflection"],
    equation="torque += hysteresis.torque * z,  dz/d|twist| = (direction - z)/presliding",
    excitation="Loops with reversals larger than the presliding twist.",
    source="Dahl, A Solid Friction Model (1968), exponent 1.",
)
