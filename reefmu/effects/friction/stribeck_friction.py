"""Stribeck friction at the output shaft: greatest at standstill, vanishing at speed, against the output's motion."""

import casadi as ca

from ..base import ConfoundingGroup, Effect, Identification, IndependentVariable, Parameter, Place
from .presliding import OUTPUT_PRESLIDING, normalised_deflection

STRIBECK_FRICTION = Effect(
    name="stribeck_friction",
    title="Friction at the output shaft that falls from standstill with speed",
    meaning="Friction at the output shaft that is greatest at standstill and falls with speed, taken from the "
    "drive's torque in the direction of the output's speed.",
    place=Place.OUTPUT,
    parameters=(
        Parameter("torque", "N.m", 0.0, 0.0, 1e4, 2.0, "Friction at standstill beyond that at speed"),
        Parameter("speed", "rad/s", 0.05, 1e-5, 1e3, 0.05, "Speed of the output at which 37 % of it remain"),
        OUTPUT_PRESLIDING,
    ),
    states=(normalised_deflection(IndependentVariable.OUTPUT),),
    contribution=lambda signals, p, x: (
        p["torque"] * ca.exp(-((signals.output_speed / p["speed"]) ** 2)) * x["deflection"]
    ),
    equation="output torque -= torque * exp(-(output speed/speed)^2) * z,  dz/d|output| = (direction - z)/presliding",
    excitation="Rotation both ways at speeds from creeping to several times the parameter `speed`.",
    source="Armstrong-Helouvry, Dupont and Canudas de Wit, A Survey of Models ... for the Control of Machines "
    "with Friction (1994), Gaussian form; the constant part is coulomb_friction.",
    identification=Identification(
        confounding_group=ConfoundingGroup.FRICTION,
        separated_from=(("hysteresis", "rotate the output both ways at several speeds under load"),),
    ),
)
