"""Records of a catalogue gear with known friction at the crank, with the torques of crank and output."""

from __future__ import annotations

import numpy as np

from reefmu.model import build_model
from reefmu.record import Record, make_record
from reefmu.simulate import simulate_record
from tests.friction_record import GEAR

TRUE = {"torque": 0.15, "fraction": 0.12, "viscous": 2e-3, "stiffness": 500.0}
"""Parameters of `crank_friction`."""
PERIOD = 400
"""Samples of a cycle, of 20 ms each."""


def both_torques(
    seed: int = 0,
    *,
    turning: bool = True,
    cycles: int = 4,
    scatter: float = 0.0,
    scale: float = 1.0,
    offset: float = 0.0,
    inside: float = 3.0,
    friction: dict[str, float] = TRUE,
    noise: float = 0.02,
) -> Record:
    """A record of cycles that begin at a reversal of the crank.

    turning: whether crank and output turn to and fro under an alternating load, instead of the crank alone, which
    twists the locked output. scatter: standard deviation of the friction from cycle to cycle, relative; scale, offset:
    N.m, errors of the motor's torque; inside: N.m, hysteresis in the drive; noise: N.m at the crank, and 25 times that
    at the output.
    """
    rng = np.random.default_rng(seed)
    n = PERIOD * cycles
    time, phase = 0.02 * np.arange(n), 2 * np.pi * np.arange(n) / PERIOD
    if turning:
        crank, twist = -60 * np.cos(phase), 1.5e-3 * np.sin(0.37 * phase + 0.3)
    else:
        twist = 2.2e-3 * 2 / np.pi * np.arcsin(np.sin(phase - np.pi / 2))
        crank = GEAR.ratio * twist
    motion = {"time": time, "crank_angle": crank, "output_angle": crank / GEAR.ratio - twist}
    effects = {"hysteresis": {"torque": inside}, "crank_friction": friction}
    response = simulate_record(
        build_model(GEAR, effects, inherent=False), make_record(motion | {"output_torque": 0 * time}, "motion")
    )
    output = response["output.tau"]
    lost = (-response["crank.tau"] - output / GEAR.ratio) * (
        1 + scatter * rng.standard_normal(cycles)[np.arange(n) // PERIOD]
    )
    motor = scale * (output / GEAR.ratio + lost) + offset + noise * rng.standard_normal(n)
    measured = output + 25 * noise * rng.standard_normal(n)
    return make_record(motion | {"output_torque": measured, "motor_torque": motor}, "both.csv")
