"""A design study as a value: what it varies, what must hold, what is better, and with which numbers."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from ...frozen_mapping import freeze
from ...io.ree_drawing import write_drawing
from ...units import UNITS
from ...version import __version__
from .design import Packing, base_drive
from .parameters import Parameter, Value

SENSES = {"max": -1.0, "min": 1.0}
"""Factor that turns an objective into a quantity to minimise."""
KNEE, BEST = "knee", "best"


@dataclass(frozen=True)
class Limit:
    """A metric's range, SI; either end may be infinite."""

    metric: str
    low: float = -math.inf
    high: float = math.inf


@dataclass(frozen=True)
class Choice:
    """Which member of the front becomes the drawing: the "knee", or the "best" in `objective` within `limits`."""

    rule: str = KNEE
    objective: str = ""
    limits: tuple[Limit, ...] = ()


@dataclass(frozen=True)
class StudySettings:
    """torque: N.m, at which stiffness, forces and pressure are taken; designs: of the Sobol sample; drives and
    twists: for each design; generations and population: of the optimiser; seed: of sample, drives and optimiser."""

    torque: float
    designs: int
    drives: int
    twists: int
    generations: int
    population: int
    seed: int


@dataclass(frozen=True)
class Study:
    """What to vary, what must hold, and what is better.

    base: the tables of the base drawing; fixed: its fields that all designs change alike; objectives: metric -> "max"
    or "min"; packing, limits: what a feasible design keeps; choice: which member of the front is drawn.
    """

    name: str
    base: Mapping[str, Any]
    parameters: tuple[Parameter, ...]
    objectives: Mapping[str, str]
    numbers: StudySettings
    fixed: Mapping[str, Value] = field(default_factory=dict)
    packing: Packing = field(default_factory=Packing)
    limits: tuple[Limit, ...] = ()
    choice: Choice = field(default_factory=Choice)
    description: str = ""

    def __post_init__(self) -> None:
        for name in ("base", "objectives", "fixed"):
            object.__setattr__(self, name, freeze(getattr(self, name)))

    def __repr__(self) -> str:
        """One line; `study_to_dict` has everything.

        >>> from stiffness_model.explore.definition.study_toml import load_study
        >>> load_study("tolerance_field")
        Study('tolerance_field', 4 parameters, objectives lost_motion, no_load_sum, cost_class)
        """
        return f"Study({self.name!r}, {len(self.parameters)} parameters, objectives {', '.join(self.objectives)})"

    @property
    def identity(self) -> str:
        """A hash of all that the results depend on; name, description and choice are not among it."""
        facts = [
            __version__,  # Another version may compute other numbers.
            self.base,
            [vars(p) for p in self.parameters],
            self.objectives,
            vars(self.numbers),
            self.fixed,
            vars(self.packing),
            [vars(limit) for limit in self.limits],
        ]
        return hashlib.sha256(json.dumps(facts, sort_keys=True, default=dict).encode()).hexdigest()


def study_to_dict(study: Study) -> dict[str, Any]:
    """The study as plain tables for `DIR/study.json`, with its identity and the base drawing."""
    return {
        "name": study.name,
        "description": study.description,
        "identity": study.identity,
        "base": write_drawing(base_drive(study.base, study.name)),
        "fixed": dict(study.fixed),
        "parameters": {p.name: list(p.values) or [p.low, p.high] for p in study.parameters},
        "packing": vars(study.packing),
        "objectives": dict(study.objectives),
        "numbers": vars(study.numbers),
        "limits": {
            limit.metric: [end if math.isfinite(end) else None for end in (limit.low, limit.high)]
            for limit in study.limits
        },
    }


def torque_text(torque: float) -> str:
    """A torque, N.m, for figures and tables."""
    return f"{torque / UNITS['torque']['N.m']:g} N.m"
