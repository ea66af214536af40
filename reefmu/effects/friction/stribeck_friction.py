"""Stribeck friction at the output shaft: greatest at standstill, vanishing at speed, against the output's motion."""

import casadi as ca

from ..base import ConfoundingGroup, Effect, Identification, IndependentVariable, Parameter, Place
from .presliding import OUTPUT_PRESLIDING, normalised_deflection

STANDSTILL = 1e-6
"""Speed over the parameter `speed` that counts as none: a power below 1 has no slope at zero. Chosen by judgement; at
the smallest exponent it takes 0.1 % off the friction at standstill."""

STRIBECK_FRICTION = Effect(
    name="stribeck_friction",
    title="Friction at the output shaft that falls from standstill with speed",
    meaning="Friction at the output shaft that is greatest at standstill and falls with speed, taken from the "
    "drive's torque in the direction of the output's speed.",
    place=Place.OUTPUT,
    parameters=(
        Parameter("torque", "N.m", 0.0, 0.0, 1e4, 2.0, "Friction at standstill beyond that at speed"),
        Parameter("speed", "rad/s", 0.05, 1e-5, 1e3, 0.05, "Speed of the output at which 37 % of it remain"),
        Parameter("exponent", "1", 2.0, 0.5, 4.0, 1.0, "Exponent of the speed: 2 Gaussian, 1 exponential"),
        OUTPUT_PRESLIDING,
    ),
    states=(normalised_deflection(IndependentVariable.OUTPUT),),
    contribution=lambda signals, p, x: (
        p["torque"]
        * ca.exp(-(((signals.output_speed / p["speed"]) ** 2 + STANDSTILL**2) ** (p["exponent"] / 2)))
        * x["deflection"]
    ),
    equation="output torque -= torque * exp(-|output speed/speed|^exponent) * z,  "
    "dz/d|output| = (direction - z)/presliding",
    excitation="Rotation both ways at speeds from creeping to several times the parameter `speed`.",
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, A Survey of Models ... for the Control of Machines "
    "with Friction (1994), exponents from 0.5 to far above 2; the constant part is coulomb_friction.",
    identification=Identification(
        confounding_groups=(ConfoundingGroup.FRICTION,),
        separated_from=(("hysteresis", "rotate the output both ways at several speeds under load"),),
    ),
)
