"""The chosen design as a drawing that the other commands take."""

from __future__ import annotations

import math
from dataclasses import replace

from ...drawing.drive import Drive
from ...units import ARCMIN
from ..definition.metrics import METRICS
from ..definition.study import BEST, torque_text
from ..evaluation.evaluate import drive_at
from .results import Results

_ROOM = 1.05
"""The drawing's range of twists goes this far beyond the study's torque."""


def chosen_drive(results: Results) -> Drive:
    """The drive of `results.chosen`, its range of twists that of the study's torque, in tenths of an arcmin."""
    design = results.chosen
    assert design is not None
    drive = drive_at(results.study, results.evaluations.positions[design])
    twist = float(results.evaluations.column("twist")[design])
    tenths = math.ceil(10 * _ROOM * twist / ARCMIN)
    facts = ", ".join(
        f"{METRICS[name].text} {results.display_values(name)[design]:.4g} {METRICS[name].display_unit}".rstrip()
        for name in results.study.objectives
    )
    return replace(
        drive,
        name=f"{results.study.name}_chosen",
        max_twist=tenths * ARCMIN / 10,
        description=f"Chosen from the study {results.study.name!r} ({rule_text(results)}); at "
        f"{torque_text(results.study.numbers.torque)}: {facts}",
    )


def rule_text(results: Results) -> str:
    """The rule of [choose] in words."""
    choice = results.study.choice
    limits = [f"{METRICS[x.metric].text} {_bounds(x.low, x.high, x.metric)}" for x in choice.limits]
    within = f" within {', '.join(limits)}" if limits else ""
    best = choice.rule == BEST
    return (f"the best in {METRICS[choice.objective].text}" if best else "the knee of the front") + within


def _bounds(low: float, high: float, metric: str) -> str:
    scale, unit = METRICS[metric].scale, METRICS[metric].display_unit
    ends = [
        f"{sign} {value / scale:g} {unit}".rstrip()
        for sign, value in ((">=", low), ("<=", high))
        if math.isfinite(value)
    ]
    return " and ".join(ends)
