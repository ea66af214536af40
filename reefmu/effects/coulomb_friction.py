"""Coulomb friction at the output shaft: constant, against the output's motion."""

from .base import Effect, Parameter, Place
from .presliding import built_up_share

COULOMB_FRICTION = Effect(
    name="coulomb_friction",
    title="Dry friction at the output shaft",
    place=Place.OUTPUT,
    parameters=(
        Parameter("torque", "N.m", 0.0, 0.0, 1e4, 2.0, "Friction of the moving output"),
        Parameter("presliding", "rad", 2e-5, 1e-7, 0.1, 2e-5, "Way of the output over which it builds up"),
    ),
    states=(built_up_share(),),
    contribution=lambda signals, p, x: p["torque"] * x["deflection"],
    equation="output torque -= coulomb_friction.torque * z,  dz/d|output| = (direction - z)/presliding",
    excitation="Rotation both ways under load of either sign; with a locked crank it looks like hysteresis.",
    source="Dahl, A Solid Friction Model (1968), exponent 1.",
)
