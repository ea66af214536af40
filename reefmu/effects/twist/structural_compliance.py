"""Structural compliance: a linear spring in series with the contacts (shafts, bearings, housing)."""

import math

from ..base import ConfoundingGroup, Effect, Identification, Parameter, Place, ToleranceSignature

LEAST_EXPONENT = 0.9
"""Exponent of the twist over the load of a spring of line contacts alone, as rollers in bearings are (Palmgren; Harris,
Rolling Bearing Analysis); that of shafts and housings is 1."""

STRUCTURAL_COMPLIANCE = Effect(
    name="structural_compliance",
    title="Spring in series",
    meaning="A further linear spring in series with the contacts, outside them (shafts, bearings, housing); "
    "positive: more twist for the same torque.",
    place=Place.SERIES,
    parameters=(Parameter("compliance", "rad/(N.m)", 0.0, 0.0, 1e-3, 3e-6, "Twist outside the contacts per torque"),),
    contribution=lambda signals, p, x: (p["compliance"], 0.0),
    equation="twist = contact twist + compliance * elastic torque",
    excitation="Several torque levels up to full torque.",
    source="Linear spring. The crank bearing alone adds some 3 arcmin at 300 N.m to the contacts' 8.",
    identification=Identification(
        confounding_groups=(ConfoundingGroup.COMPLIANCE,),
        tolerance_signature=ToleranceSignature.CURVE,
        limit_of="creep",
        # At full torque the slope is the exponent times the compliance: the root mean square of the difference over
        # exponents that are equally likely.
        form_uncertainty=(1 - LEAST_EXPONENT) / math.sqrt(3),
        separated_from=(
            (
                "modulus_error",
                "loops to several torque levels up to full torque; on a plastic drive measure the "
                "housing's compliance separately",
            ),
        ),
    ),
)
