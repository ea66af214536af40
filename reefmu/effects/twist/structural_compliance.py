"""Structural compliance: a linear spring in series with the contacts (shafts, bearings, housing)."""

from ..base import ConfoundingGroup, Effect, Identification, Parameter, Place, ToleranceSignature

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
        separated_from=(
            (
                "modulus_error",
                "loops to several torque levels up to full torque; on a plastic drive measure the "
                "housing's compliance separately",
            ),
        ),
    ),
)
