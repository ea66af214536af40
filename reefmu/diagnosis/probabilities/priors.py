"""What is plausible before a record is seen: the typical sizes of effects, and the odds that a user gives them.

Typical sizes are the scale of the priors, and that at which a plan asks whether effects are separated.
"""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from stiffness_model.errors import expect, expect_number, refuse_unknown
from stiffness_model.io.toml_files import parse_toml, read_text

from ...effects import EFFECTS, find_effect
from ...record.unit_conversion import convert
from ..estimation.score_test import amplitudes

UNNAMED = "unnamed"
"""Key of the odds of something that no effect describes."""
LARGEST_ODDS = 1e6
"""Largest odds in a file, and the inverse of the least: beyond them no record would change a conclusion."""
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


@dataclass(frozen=True)
class Priors:
    """What a user knows of a drive before its record is seen.

    odds: by effect, and for `UNNAMED`, over those of the drives on which the probabilities are calibrated; sizes:
    typical ones by `effect.parameter`, SI, in place of `typical_sizes`.
    """

    odds: Mapping[str, float] = field(default_factory=dict[str, float])
    sizes: Mapping[str, float] = field(default_factory=dict[str, float])

    def log_odds(self, effects: Collection[str], unnamed: bool) -> float:
        """Logarithm of the odds of a hypothesis over those without these priors.

        >>> round(math.exp(Priors({"wear": 5.0, UNNAMED: 0.1}).log_odds(["wear", "creep"], True)), 9)
        0.5
        """
        names = [*effects, *([UNNAMED] if unnamed else [])]
        return sum(math.log(self.odds.get(name, 1.0)) for name in names)


def load_priors(path: str | os.PathLike[str]) -> Priors:
    """The priors in a TOML file. Raises `InputError` with the file, the key, what was expected and what was given."""
    return priors_from_dict(parse_toml(read_text(Path(path), "TOML priors"), str(path), "TOML priors"), str(path))


def priors_from_dict(table: Mapping[str, Any], where: str = "priors") -> Priors:
    """The priors in nested tables, as TOML gives them. Raises `InputError`.

    >>> priors_from_dict({"odds": {"wear": 5}, "sizes": {"backlash": {"clearance": "4 um"}}})
    Priors(odds={'wear': 5.0}, sizes={'backlash.clearance': 4e-06})
    >>> priors_from_dict({"odds": {"waer": 5}})
    Traceback (most recent call last):
    ...
    stiffness_model.errors.UnknownNameError: priors [odds]: unknown effect 'waer'; did you mean 'wear'?
    """
    refuse_unknown("section", table, ("odds", "sizes"), where)
    for section in ("odds", "sizes"):
        expect(isinstance(table.get(section, {}), Mapping), f"a table [{section}]", table.get(section), where)
    odds, sizes = table.get("odds", {}), table.get("sizes", {})
    refuse_unknown("effect", odds, (*EFFECTS, UNNAMED), f"{where} [odds]")
    low, high = 1 / LARGEST_ODDS, LARGEST_ODDS
    wanted = f"odds from {low:g} to {high:g}"
    found = {name: expect_number(v, wanted, f"{where} [odds] {name}", low=low, high=high) for name, v in odds.items()}
    refuse_unknown("effect", sizes, EFFECTS, f"{where} [sizes]")
    return Priors(found, {key: size for name, v in sizes.items() for key, size in _sizes(name, v, where)})


def _sizes(name: str, table: object, where: str) -> list[tuple[str, float]]:
    """Key and value, SI, of each size of an effect."""
    effect, where = find_effect(name), f"{where} [sizes] {name}"
    units = {effect.parameters[k].name: effect.parameters[k].unit for k in amplitudes(effect)}
    example = f"sizes by parameter, such as {{{next(iter(units))} = ...}}"
    if not isinstance(table, Mapping):
        expect(False, example, table, where)
        return []
    refuse_unknown("parameter", table, units, where)
    return [(f"{name}.{key}", _size(value, units[key], f"{where}.{key}")) for key, value in table.items()]


def _size(value: object, unit: str, where: str) -> float:
    """A size in its SI unit; without a unit only where it has none."""
    if not isinstance(value, str):
        expect(unit == "1", f"a text with a unit, such as '1 {unit}'", value, where)
        return expect_number(value, "a positive number", where, low=1e-300)
    number, _, given = value.strip().partition(" ")
    try:
        size = float(number)
    except ValueError:
        size = math.nan
    expect(math.isfinite(size) and size > 0, f"a positive number and a unit, such as '1 {unit}'", value, where)
    return float(convert(np.array([size]), given.strip() or "1", unit, where.rsplit(".", 1)[-1], where)[0])
