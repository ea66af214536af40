"""Creep: a Kelvin-Voigt element in series; twist that follows the elastic torque with a delay."""

from ..base import ConfoundingGroup, Effect, Identification, IndependentVariable, Parameter, Place, State

CREEP = Effect(
    name="creep",
    title="Delayed twist under load",
    meaning="Further twist that follows the elastic torque with a delay of seconds to minutes; positive: twist in "
    "the direction of the torque.",
    place=Place.SERIES,
    parameters=(
        Parameter("compliance", "rad/(N.m)", 0.0, 0.0, 1e-3, 1e-6, "Further twist per torque after a long time"),
        Parameter("time", "s", 30.0, 1e-3, 1e6, 30.0, "Time to 63 % of it at constant torque"),
    ),
    states=(
        State(
            "twist",
            "rad",
            "Delayed twist",
            IndependentVariable.TIME,
            lambda signals, p: (-1 / p["time"], p["compliance"] * signals.elastic_torque / p["time"]),
            nominal=lambda p, full_torque: p["compliance"] * full_torque,
        ),
    ),
    contribution=lambda signals, p, x: (0.0, x["twist"]),
    equation="twist = contact twist + q,  creep.time * dq/dt = creep.compliance * elastic torque - q",
    excitation="A dwell of five time constants under torque, and one after unloading.",
    source="Kelvin-Voigt element: Findley, Lai and Onaran, Creep and Relaxation of Nonlinear Viscoelastic "
    "Materials (1976).",
    identification=Identification(
        confounding_groups=(ConfoundingGroup.COMPLIANCE, ConfoundingGroup.FRICTION),
        separated_from=(
            ("structural_compliance", "hold the torque for five time constants, and unload for as long"),
            ("damping", "hold the torque for five time constants, and loop at three rates a decade apart"),
        ),
    ),
)
