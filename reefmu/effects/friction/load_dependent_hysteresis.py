"""Load-dependent hysteresis: a rate-independent torque, its width in proportion to the elastic torque."""

import casadi as ca

from ..base import ConfoundingGroup, Effect, Identification, IndependentVariable, Parameter, Place
from .presliding import TWIST_PRESLIDING, normalised_deflection

LOAD_DEPENDENT_HYSTERESIS = Effect(
    name="load_dependent_hysteresis",
    title="Rate-independent friction inside the drive that grows with the load",
    meaning="A rate-independent torque that follows the direction of the twist, positive while the twist grows, "
    "its width in proportion to the elastic torque, with a presliding twist after every reversal.",
    place=Place.PARALLEL,
    parameters=(
        Parameter("fraction", "1", 0.0, 0.0, 1.0, 0.03, "Half the width of the loop, as a share of the elastic torque"),
        TWIST_PRESLIDING,
    ),
    states=(normalised_deflection(IndependentVariable.TWIST),),
    contribution=lambda signals, p, x: p["fraction"] * ca.fabs(signals.elastic_torque) * x["deflection"],
    equation="torque += fraction * |elastic torque| * z,  dz/d|twist| = (direction - z)/presliding",
    excitation="Loops to several torques: the loop closes at zero torque and opens with the load.",
    source="Coulomb friction between bodies pressed together by the load; presliding by Dahl, A Solid Friction "
    "Model (1968), exponent 1.",
    identification=Identification(confounding_groups=(ConfoundingGroup.FRICTION,)),
)
