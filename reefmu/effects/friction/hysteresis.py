"""Hysteresis: a rate-independent torque of constant width that follows the twist's direction."""

from ..base import ConfoundingGroup, Effect, Identification, IndependentVariable, Parameter, Place
from .presliding import TWIST_PRESLIDING, normalised_deflection

HYSTERESIS = Effect(
    name="hysteresis",
    title="Rate-independent friction inside the drive",
    meaning="A rate-independent torque of constant width that follows the direction of the twist, positive while "
    "the twist grows, with a presliding twist after every reversal.",
    place=Place.PARALLEL,
    parameters=(
        Parameter("torque", "N.m", 0.0, 0.0, 1e4, 2.0, "Half the width of the loop"),
        TWIST_PRESLIDING,
    ),
    states=(normalised_deflection(IndependentVariable.TWIST),),
    contribution=lambda signals, p, x: p["torque"] * x["deflection"],
    equation="torque += hysteresis.torque * z,  dz/d|twist| = (direction - z)/presliding",
    excitation="Loops with reversals larger than the presliding twist.",
    source="Dahl, A Solid Friction Model (1968), exponent 1.",
    identification=Identification(
        confounding_groups=(ConfoundingGroup.FRICTION,),
        separated_from=(("load_dependent_hysteresis", "loops of several amplitudes, through zero torque"),),
    ),
)
