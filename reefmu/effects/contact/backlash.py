"""Backlash: the gear's clearance is larger than drawn, the same everywhere."""

from ..base import ConfoundingGroup, Effect, Identification, Parameter, Place, ToleranceSignature

BACKLASH = Effect(
    name="backlash",
    title="Larger gear clearance",
    meaning="The mean gear clearance is larger than drawn, the same everywhere; positive: more clearance. It is "
    "the same quantity as preload, with the other sign.",
    place=Place.CLEARANCE,
    parameters=(Parameter("clearance", "m", 0.0, 0.0, 1e-3, 5e-6, "Gear clearance beyond the drawing's"),),
    contribution=lambda signals, p, x: p["clearance"],
    equation="clearance = drawn + backlash.clearance",
    excitation="Load in both directions through zero torque.",
    source="Equidistant q of the gear profile (paper, section III): a clearance for which the contacts are solved.",
    identification=Identification(
        confounding_groups=(ConfoundingGroup.CLEARANCE,),
        tolerance_signature=ToleranceSignature.CURVE,
        sign_pair="preload",
        separated_from=(("preload", "load the drive in both directions through zero torque"),),
    ),
)
