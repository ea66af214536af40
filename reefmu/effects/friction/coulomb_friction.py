"""Coulomb friction at the output shaft: constant, against the output's motion."""

from ..base import ConfoundingGroup, Effect, Identification, IndependentVariable, Parameter, Place
from .presliding import OUTPUT_PRESLIDING, normalised_deflection

COULOMB_FRICTION = Effect(
    name="coulomb_friction",
    title="Dry friction at the output shaft",
    meaning="Dry friction of constant size at the output shaft, taken from the drive's torque in the direction of "
    "the output's speed.",
    place=Place.OUTPUT,
    parameters=(
        Parameter("torque", "N.m", 0.0, 0.0, 1e4, 2.0, "Friction of the moving output"),
        OUTPUT_PRESLIDING,
    ),
    states=(normalised_deflection(IndependentVariable.OUTPUT),),
    contribution=lambda signals, p, x: p["torque"] * x["deflection"],
    equation="output torque -= coulomb_friction.torque * z,  dz/d|output| = (direction - z)/presliding",
    excitation="Rotation both ways under load of either sign; with a locked crank it looks like hysteresis.",
    source="Dahl, A Solid Friction Model (1968), exponent 1.",
    identification=Identification(
        confounding_groups=(ConfoundingGroup.FRICTION,),
        limit_of="stribeck_friction",
        separated_from=(
            ("viscous_friction", "rotate at three speeds, a decade apart, both ways"),
            ("stribeck_friction", "rotate at speeds from creeping to several times the Stribeck speed"),
            ("hysteresis", "rotate the output both ways under load; with the crank locked they cannot be told apart"),
        ),
    ),
)
