"""Modulus error: gear and cage are softer or stiffer than drawn; crank and rolling elements are not."""

from stiffness_model.lookup.modulus import BOUNDS

from ..base import ConfoundingGroup, Effect, Identification, Parameter, Place, Requirement, ToleranceSignature

MODULUS_ERROR = Effect(
    name="modulus_error",
    title="Modulus of gear and cage other than drawn",
    meaning="Gear and cage are softer or stiffer than drawn, by a factor on Young's modulus; positive: stiffer. "
    "Crank and rolling elements stay as drawn.",
    place=Place.MODULUS,
    parameters=(
        Parameter("error", "1", 0.0, *BOUNDS, 0.1, "Young's modulus of gear and cage over the drawn one, less 1"),
    ),
    contribution=lambda signals, p, x: p["error"],
    equation="torque = contact torque of gear and cage with (1 + modulus_error.error) times the drawn modulus",
    excitation="Several torque levels up to full torque: structural_compliance softens the high ones most.",
    source="Contacts in series, deflections as compliance^(1/p) (Hertz; paper, eq. 23): see `lookup.modulus`.",
    identification=Identification(
        requirements=(Requirement.DRAWING,),
        confounding_groups=(ConfoundingGroup.COMPLIANCE,),
        tolerance_signature=ToleranceSignature.CURVE,
    ),
)
