"""A first look at a record: rates, repeats, saturation, quantisation, gaps, a twist in the wrong sign."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..record import Record

LEAST_SAMPLES = 100
SATURATED = 0.03
"""Share of samples at the very extreme of the torque that counts as a limit reached."""


@dataclass(frozen=True)
class Audit:
    """samples, runs; rate: median sampling rate, Hz; torque_step: quantisation of the torque, N.m, 0 if none is seen;
    notes: what a reader should know; problems: why nothing can be said.
    """

    samples: int
    runs: int
    rate: float
    torque_step: float
    notes: tuple[str, ...]
    problems: tuple[str, ...]


def audit(record: Record, ratio: float) -> Audit:
    """Look at a record before anything is fitted to it."""
    n = len(record)
    inner = np.diff(record.run) == 0
    step = np.diff(record.time)[inner]
    notes, problems = [], []
    if n < LEAST_SAMPLES:
        problems.append(f"only {n} samples; expected at least {LEAST_SAMPLES}")
    moving = step[step > 0]
    rate = 1 / float(np.median(moving)) if moving.size else 0.0
    if moving.size:
        gaps = int((moving > 20 * np.median(moving)).sum())
        if gaps > len(record.starts):
            notes.append(f"{gaps} gaps in time within runs")
    else:
        problems.append("time does not move within the runs")
    torque, twist = record.output_torque, record.twist(ratio)
    levels = np.unique(torque)
    smallest = float(np.diff(levels).min()) if levels.size > 1 else 0.0
    quantised = levels.size < 0.2 * n and levels.size > 1
    if levels.size < 2:
        problems.append("the torque never changes")
    top = max(float(np.mean(torque >= levels[-1] - 1e-12)), float(np.mean(torque <= levels[0] + 1e-12)))
    if levels.size > 20 and top > SATURATED:
        notes.append(f"{100 * top:.0f} % of the samples stand at the torque's extreme: a saturated sensor or a "
                     "limited load")
    if np.ptp(twist) <= 0:
        problems.append("the twist never changes")
    elif levels.size > 1 and np.corrcoef(twist, torque)[0, 1] < -0.5:
        problems.append("the torque falls as the twist grows: the twist, or the torque, has the wrong sign "
                        "(twist = crank angle/ratio - output angle)")
    for name in record.missing:
        notes.append({"crank_angle": "no crank angle: the crank counts as locked", "run": "no run column: one run",
                      "temperature": "no temperature: 20 degC throughout"}.get(name, f"no column {name}"))
    return Audit(n, len(record.starts), rate, smallest if quantised else 0.0, tuple(notes), tuple(problems))
