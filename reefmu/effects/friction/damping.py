"""Damping: a torque in proportion to the twist's rate."""

from ..base import ConfoundingGroup, Effect, Identification, Parameter, Place

DAMPING = Effect(
    name="damping",
    title="Viscous damping inside the drive",
    meaning="A torque in proportion to the rate of the twist, positive while the twist grows.",
    place=Place.PARALLEL,
    parameters=(Parameter("coefficient", "N.m.s/rad", 0.0, 0.0, 1e7, 100.0, "Torque per rate of the twist"),),
    contribution=lambda signals, p, x: p["coefficient"] * signals.twist_rate,
    equation="torque += damping.coefficient * d twist/dt",
    excitation="The same loops at three rates, a decade apart.",
    source="Dashpot parallel to the contacts (Kelvin-Voigt).",
    identification=Identification(
        confounding_groups=(ConfoundingGroup.FRICTION,),
        separated_from=(
            ("hysteresis", "the same loops at three rates, a decade apart"),
            ("viscous_friction", "rotate at constant twist, and loop with the crank locked"),
        ),
    ),
)
