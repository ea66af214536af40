"""Sizes that the effects typically have: the scale of their priors, and that at which a plan asks whether they are
separated."""

from __future__ import annotations

import math

from ...effects import EFFECTS

ROTATION_SPEED = 100.0
"""rad/s of the crank, about 1000 rpm, at which speed-dependent friction has its typical torque. Chosen by judgement."""
WORN_TURNS = 1000.0
"""Turns of the crank after which wear has its typical clearance. Chosen by judgement."""
WARM_UP = 20.0
"""K by which a drive warms up in use, after which thermal clearance has its typical size. Chosen by judgement."""
FRICTION_SHARE = 0.03
"""Typical friction over full torque. Chosen by judgement, from efficiencies of 90 to 97 % of robot gears."""


def typical_sizes(
    full_torque: float, full_twist: float, seconds: float, clearance: float = 0.0, ratio: float | None = None
) -> dict[str, float]:
    """Typical values of the effects' amplitudes by `effect.parameter`, SI: the scale of their priors.

    full_torque: N.m; full_twist: rad, at full torque; seconds: duration of the record, over which a drift counts;
    clearance: m, one standard deviation of the gear's tolerance, 0 where no drawing states it; ratio: of crank to
    output, None where it is not known: speeds are then those of the output. All but the clearances are shares chosen by
    judgement.
    """
    clearance = clearance or EFFECTS["backlash"].parameters[0].nominal
    reduction = abs(ratio or 1.0)
    friction, compliance = FRICTION_SHARE * full_torque, full_twist / full_torque
    return {
        "backlash.clearance": clearance,
        "preload.clearance": clearance,
        "thermal_clearance.rate": clearance / WARM_UP,
        "wear.rate": clearance / (2 * math.pi * WORN_TURNS),
        "modulus_error.error": 0.05,
        "missing_ball.size": 1.0,
        "structural_compliance.compliance": 0.2 * compliance,
        "creep.compliance": 0.1 * compliance,
        **{f"kinematic_error.amplitude_{order}": 0.02 * full_twist for order in (1, 2, 3, 4)},
        "hysteresis.torque": friction,
        "load_dependent_hysteresis.fraction": FRICTION_SHARE,
        # At the rate of a loop through full twist in one second.
        "damping.coefficient": friction / (4 * full_twist),
        "coulomb_friction.torque": friction,
        "viscous_friction.coefficient": friction / (ROTATION_SPEED / reduction),
        "stribeck_friction.torque": friction,
        "torque_sensor_offset.torque": 0.01 * full_torque,
        "torque_sensor_drift.rate": 0.01 * full_torque / seconds,
    }
