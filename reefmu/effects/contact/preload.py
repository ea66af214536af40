"""Preload: the gear's clearance is smaller than drawn, the same everywhere."""

from ..base import ConfoundingGroup, Effect, Identification, Parameter, Place, ToleranceSignature

PRELOAD = Effect(
    name="preload",
    title="Smaller gear clearance",
    meaning="The mean gear clearance is smaller than drawn, the same everywhere; positive: less clearance, down "
    "to interference. It is the same quantity as backlash, with the other sign.",
    place=Place.CLEARANCE,
    parameters=(Parameter("clearance", "m", 0.0, 0.0, 1e-3, 5e-6, "Gear clearance less than the drawing's"),),
    contribution=lambda signals, p, x: -p["clearance"],
    equation="clearance = drawn - preload.clearance",
    excitation="Load in both directions through zero torque.",
    source="Equidistant q of the gear profile (paper, section III): an interference for which the contacts are solved.",
    identification=Identification(
        confounding_groups=(ConfoundingGroup.CLEARANCE,),
        tolerance_signature=ToleranceSignature.CURVE,
        sign_pair="backlash",
    ),
)
