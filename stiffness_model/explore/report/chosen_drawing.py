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

_TWIST_MARGIN = 1.05
"""The drawing's max_twist over the twist at the study's torque; chosen by judgement."""


def chosen_drive(results: Results) -> Drive:
    """The drive of `results.chosen`. Its max_twist, in tenths of an arcmin, is just beyond the twist at the torque."""
    design = results.chosen
    assert design is not None
    drive = drive_at(results.study, results.evaluations.positions[design])
    twist = float(results.evaluations.column("twist")[design])
    tenths = math.ceil(10 * _TWIST_MARGIN * twist / ARCMIN)
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
    """The rule of [choose] as a phrase."""
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
