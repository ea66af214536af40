"""Dry friction at the output shaft that sticks: no creep under a load below the break-away torque."""

from dataclasses import replace

from ..base import Effect, Expression, Identification, Parameter, Place, Signals, Values
from .elastoplastic import OUTPUT, RETARDATION, STIFFNESS, bristle_deflection, friction_torque, stribeck_factor


def _limit(signals: Signals, p: Values) -> Expression:
    return p["torque"] * stribeck_factor(signals.output_speed, p["stribeck"], p["speed"])


ELASTOPLASTIC_FRICTION = Effect(
    name="elastoplastic_friction",
    title="Dry friction at the output shaft with stiction",
    meaning="Dry friction at the output shaft, taken from the drive's torque against the output's motion, as "
    "coulomb_friction and stribeck_friction together; but a load held below the break-away torque does not creep: the "
    "output moves by the elastic deflection of the friction alone, however often the load alternates.",
    place=Place.OUTPUT,
    parameters=(
        Parameter("torque", "N.m", 0.0, 0.0, 1e4, 2.0, "Friction of the moving output"),
        Parameter("stribeck", "1", 0.0, 0.0, 10.0, 0.3, "Break-away over friction at speed, less 1"),
        Parameter("speed", "rad/s", 0.05, 1e-5, 1e3, 0.05, "Speed of the output at which 37 % of that excess remain"),
        replace(STIFFNESS, neutral=1e5, nominal=1e5),
        RETARDATION,
    ),
    states=(bristle_deflection(OUTPUT, _limit, lambda p, full_torque: p["torque"]),),
    contribution=lambda signals, p, x: friction_torque(OUTPUT, _limit, signals, p, x["deflection"]),
    equation="output torque -= stiffness (z + retardation dz/dt),  |z| to limit/stiffness,  "
    "limit = torque (1 + stribeck exp(-(output speed/speed)^2))",
    excitation="Loads held below and above the break-away torque, and rotation both ways at several speeds.",
    source="Dupont, Hayward, Armstrong, Altpeter, Single State Elastoplastic Friction Models (2002); Stribeck: "
    "Armstrong-Helouvry, Dupont, Canudas de Wit (1994).",
    identification=Identification(
        not_a_candidate="it slides as coulomb_friction and stribeck_friction do, which are named in its place",
    ),
)
