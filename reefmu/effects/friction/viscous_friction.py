"""Viscous friction at the output shaft: in proportion to the output's speed and against it."""

from ..base import ConfoundingGroup, Effect, Identification, Parameter, Place

VISCOUS_FRICTION = Effect(
    name="viscous_friction",
    title="Viscous friction at the output shaft",
    meaning="Friction in proportion to the output's speed at the output shaft, taken from the drive's torque in "
    "the direction of that speed.",
    place=Place.OUTPUT,
    parameters=(Parameter("coefficient", "N.m.s/rad", 0.0, 0.0, 1e6, 5.0, "Friction per speed of the output"),),
    contribution=lambda signals, p, x: p["coefficient"] * signals.output_speed,
    equation="output torque -= viscous_friction.coefficient * output speed",
    excitation="Rotation at three speeds, a decade apart.",
    source="Lubricant sheared in bearings and seals, linear in the speed.",
    identification=Identification(confounding_groups=(ConfoundingGroup.FRICTION,)),
)
