"""Names of effects and their sizes: from a ratio to the noise to the parameters of the simulated drive."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from .contact_law import turn_past_cage
from .elements import Array
from .outside import KINDS, Outside
from .plant import Behaviour, Motion, run
from .protocols import Schedule
from .tables import SCATTER_NODES, SCATTER_TURNS, Tables

Setter = Callable[[Behaviour, float], Behaviour]
"""(behaviour, size) -> the behaviour with one effect of that size, at least 0."""

_FIELDS = {
    "backlash": "clearance",
    "preload": "clearance",
    "thermal_clearance": "thermal",
    "wear": "wear",
    "structural_compliance": "compliance",
    "creep": "creep",
    "kinematic_error": "kinematic",
    "hysteresis": "hysteresis",
    "load_dependent_hysteresis": "load_hysteresis",
    "damping": "damping",
    "coulomb_friction": "coulomb",
    "viscous_friction": "viscous",
    "stribeck_friction": "stribeck",
    "torque_sensor_offset": "offset",
    "torque_sensor_drift": "drift",
}
EFFECTS = (*list(_FIELDS)[:4], "modulus_error", "missing_ball", *list(_FIELDS)[4:])
"""The names of the seventeen effects, as in `reefmu.effects`."""
BOTH_SIGNS = (
    "thermal_clearance",
    "modulus_error",
    "torque_sensor_offset",
    "torque_sensor_drift",
    "asymmetric",
    "soft_when_warm",
    "zero_jump",
    "sensor_bend",
)


def shapes(tables: Tables, rng: np.random.Generator) -> Behaviour:
    """A drive without effects, with the lengths, times, phases and orders that its effects would have."""
    twist = tables.full_twist
    orders = rng.choice([1, 2, 3, 4], 2, replace=False)
    return Behaviour(
        creep_time=rng.uniform(5, 20),
        presliding=twist * rng.uniform(0.01, 0.04),
        rubbing=twist * rng.uniform(0.01, 0.04),
        turnover=rng.uniform(0.05, 0.25),
        orders=tuple((int(k), w, rng.uniform(0, 2 * np.pi)) for k, w in zip(orders, (1.0, 0.4), strict=True)),
    )


def setter(name: str, rng: np.random.Generator) -> Setter:
    """The setter of an effect or of a kind of `outside.KINDS`; sign, phase and position are drawn."""
    sign = float(rng.choice([-1.0, 1.0])) if name in BOTH_SIGNS else -1.0 if name == "preload" else 1.0
    phase, number = rng.uniform(-0.75, 0.75) * np.pi, rng.uniform()

    def put(behaviour: Behaviour, size: float) -> Behaviour:
        change: dict[str, Any]
        if name in KINDS:
            change = {"outside": Outside(name, sign * size, number)}
        elif name == "modulus_error":
            change = {"modulus": float(np.exp(sign * size))}
        elif name == "missing_ball":
            change = {"missing": phase if size else None}
        else:
            change = {_FIELDS[name]: sign * size}
        return replace(behaviour, **change)

    return put


def greatest(name: str, tables: Tables, test: Schedule) -> float:
    """The greatest size of an effect, in its own unit; chosen by judgement."""
    full, twist, clearance = tables.full_torque, tables.full_twist, 0.9 * tables.c[-1]
    if name in KINDS and name != "hardening":
        return 0.5
    return float(
        {
            "backlash": clearance,
            "preload": clearance,
            "modulus_error": np.log(1.9),
            "missing_ball": 1.0,
            "thermal_clearance": clearance / max(np.ptp(test.temperature), 1.0),
            "wear": clearance / max(np.abs(np.diff(test.crank)).sum(), 1.0),
            "structural_compliance": 0.5 * twist / full,
            "creep": 0.5 * twist / full,
            "kinematic_error": 0.3 * twist,
            "load_dependent_hysteresis": 0.5,
            "damping": 100 * full,
            "viscous_friction": 10 * full,
            "hardening": 4 * twist / full,
        }.get(name, full)
    )


def find_size(
    name: str, put: Setter, start: Behaviour, tables: Tables, plain: Motion, test: Schedule, wanted: float
) -> tuple[float, Array]:
    """The size whose contribution has the rms `wanted`, N.m, or else the greatest size; and the contribution, N.m: what
    the effect alone adds to the gap of the mean drive in this test. A missing ball has one size only.
    """
    most = greatest(name, tables, test)
    if wanted == 0:
        return 0.0, np.zeros(len(test.time))
    size = most if name == "missing_ball" else 0.02 * most
    for _ in range(6):
        trace = run(tables, put(start, size), test).gap - plain.gap
        effect = rms(trace)
        done = abs(effect - wanted) <= 0.02 * wanted or (size == most and effect < wanted)
        if done or effect == 0 or name == "missing_ball":
            break
        size = min(size * min(wanted / effect, 30.0), most)
    return size, trace


def rms(values: Array) -> float:
    """Root of the mean square."""
    return float(np.sqrt(np.mean(values**2)))


def scatter_along(tables: Tables, test: Schedule, motion: Motion, trace: Array) -> float:
    """Standard deviation, over individuals, of the part of their scatter that resembles the effect, over its
    contribution.

    The zero of the twist is first projected out of both, because every diagnosis estimates it.
    """
    base = motion.stiffness[:, None]
    turn = turn_past_cage(tables, test.crank, motion.twist) / (2 * np.pi)
    row = (turn * SCATTER_NODES).astype(int) % (SCATTER_TURNS * SCATTER_NODES)
    place = np.clip(np.interp(motion.twist, tables.x, np.arange(len(tables.x))), 0, len(tables.x) - 1.001)
    column, part = place.astype(int), place % 1.0
    found = (1 - part) * tables.scatter[:, row, column] + part * tables.scatter[:, row, column + 1]
    columns = np.vstack([found, trace]).T
    columns = columns - base @ np.linalg.lstsq(base, columns, rcond=None)[0]
    own = columns[:, -1]
    return float(np.std(own @ columns[:, :-1] / (own @ own)))
