"""Friction of the transmission at the crank: dry, in proportion to the load, and viscous; it sticks.

At a load that would give the torque U at the crank without losses, the dry friction F makes the efficiency U/(U + F)
with the crank driving and 1 - F/U with the output driving. Where F exceeds U the drive is self-locking.
"""

from typing import Any

import casadi as ca

from ..base import Effect, Expression, Identification, Parameter, Place, Signals, Values
from .elastoplastic import CRANK, RETARDATION, STIFFNESS, bristle_deflection, friction_torque, stribeck_factor

_TINY = 1e-100
_ALIKE = ("hysteresis", "load_dependent_hysteresis", "coulomb_friction")
"""Effects that friction at the crank resembles in the motor's torque."""
_SEPARATING_TEST = (
    "measure the torques of crank and output while the crank turns both ways under load; or turn with the motor's "
    "torque alone, under a known load, once with the crank driving and once with the output driving"
)
TYPICAL_RATIO = 50.0
"""Ratio that relates full torque to the crank for the typical size of the state; chosen by judgement."""


def _limit(signals: Signals, p: Values) -> Expression:
    useful = ca.fabs(signals.elastic_torque / signals.ratio)
    by_load = p["fraction"] * useful / (1 + p["relief"] * useful)
    greater, smaller = ca.fmax(p["torque"], by_load), ca.fmin(p["torque"], by_load)
    # A power of zero has no derivative by its exponent.
    quotient = ca.fmax(smaller / (greater + _TINY), _TINY)
    dry = greater * (1 + quotient ** p["exponent"]) ** (1 / p["exponent"])
    return dry * stribeck_factor(signals.crank_speed, p["stribeck"], p["speed"])


def _contribution(signals: Signals, p: Values, x: Values) -> Any:
    thinning = ca.exp(-p["thinning"] * (signals.temperature - 20))
    return friction_torque(CRANK, _limit, signals, p, x["deflection"]) + p["viscous"] * thinning * signals.crank_speed


CRANK_FRICTION = Effect(
    name="crank_friction",
    title="Friction of the transmission, at the crank",
    meaning="Friction of the whole transmission, taken from the torque on the crank against its motion: dry, of which "
    "a part grows with the load, and viscous. The torque on the output does not change: with the crank driving, the "
    "motor supplies the friction; with the output driving, the crank receives less, and none where the drive locks. "
    "Below the break-away torque the crank sticks. A drawing with a friction_coefficient and a data sheet with "
    "efficiencies have this effect by themselves.",
    place=Place.CRANK,
    parameters=(
        Parameter("torque", "N.m", 0.0, 0.0, 1e4, 0.02, "Dry friction without load, of seals and preloaded contacts"),
        Parameter("fraction", "1", 0.0, 0.0, 10.0, 0.1, "Dry friction over the crank's torque without losses"),
        Parameter(
            "exponent", "1", 1.0, 1.0, 10.0, 2.0, "How both combine: 1 adds, more lets the load relieve the preload"
        ),
        Parameter(
            "relief",
            "1/(N.m)",
            0.0,
            0.0,
            1e3,
            0.01,
            "Decrease of the fraction under load: divided by 1 + relief x crank's torque without losses",
        ),
        Parameter("stribeck", "1", 0.0, 0.0, 10.0, 0.3, "Break-away over dry friction at speed, less 1"),
        Parameter("speed", "rad/s", 5.0, 1e-3, 1e5, 5.0, "Speed of the crank at which 37 % of that excess remain"),
        Parameter("viscous", "N.m.s/rad", 0.0, 0.0, 1e4, 1e-4, "Viscous friction per speed of the crank at 20 degC"),
        Parameter("thinning", "1/K", 0.0, 0.0, 1.0, 0.03, "Relative decrease of viscous friction per kelvin"),
        STIFFNESS,
        RETARDATION,
    ),
    states=(
        bristle_deflection(
            CRANK,
            _limit,
            lambda p, full_torque: p["torque"] + p["fraction"] * full_torque / TYPICAL_RATIO,
            depends_on_load=True,
        ),
    ),
    contribution=_contribution,
    equation="crank torque -= stiffness (z + retardation dz/dt) + viscous exp(-thinning (temperature - 20 degC)) "
    "crank speed,  |z| to limit/stiffness,  limit = (torque^n + (fraction U/(1 + relief U))^n)^(1/n) "
    "(1 + stribeck exp(-(crank speed/speed)^2)),  n = exponent,  U = |elastic torque/ratio|",
    excitation="Torques at crank and output, both measured, under rotation at several loads, speeds and temperatures, "
    "with the crank driving and with the output driving.",
    source="Coulomb's law for contacts pressed together by the load (stiffness_model.ratings.efficiency); presliding: "
    "Dupont, Hayward, Armstrong, Altpeter, Single State Elastoplastic Friction Models (2002); Stribeck: "
    "Armstrong-Helouvry, Dupont, Canudas de Wit (1994); viscosity: Reynolds (1886), exponential.",
    amplitudes=("torque", "fraction", "viscous"),
    identification=Identification(
        not_a_candidate="friction at the crank does not reach the output, and in the motor's torque alone it cannot be "
        "told from friction inside the drive and at the output: that needs the torques of crank and output, or the "
        "motor's torque with power flowing in both directions",
        separated_from=tuple((name, _SEPARATING_TEST) for name in _ALIKE),
    ),
)
