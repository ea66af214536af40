"""A first look at a record: rates, repeats, saturation, quantisation, gaps, a twist in the wrong sign."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...record import Record

MIN_SAMPLES = 100
SATURATION_SHARE = 0.03
"""Share of samples at the very extreme of the torque that counts as a limit reached."""
TIME_RESOLUTION = 1e-9
"""s: the least step between samples that counts as one; converters of angle and torque take longer."""
ANGLE_RESOLUTION = 2 * np.pi / 2**32
"""rad: the least change that counts as one; the finest encoders divide a turn into 2^32."""
TORQUE_RESOLUTION = 1e-9
"""N.m: the same of the torque; the finest sensors on shafts resolve some 1e-6."""
ROUNDING = 16 * float(np.finfo(float).eps)
"""The same of any number, as a share of its size: what rounding makes is no change."""
MAX_TWIST = 1.0
"""rad: no gear twists as far."""


@dataclass(frozen=True)
class Audit:
    """samples, runs; rate: median sampling rate, Hz; torque_step: quantisation of the torque, N.m, 0 if none is seen;
    notes: what a reader should know; defects: why nothing can be said.
    """

    samples: int
    runs: int
    rate: float
    torque_step: float
    notes: tuple[str, ...]
    defects: tuple[str, ...]


def audit(record: Record, ratio: float) -> Audit:
    """Look at a record before anything is fitted to it."""
    n = len(record)
    inner = np.diff(record.run) == 0
    step = np.diff(record.time)[inner]
    notes, defects = [], []
    if n < MIN_SAMPLES:
        defects.append(f"only {n} samples; expected at least {MIN_SAMPLES}")
    moving = step[step > TIME_RESOLUTION]
    rate = 1 / float(np.median(moving)) if moving.size else 0.0
    if moving.size:
        gaps = int((moving > 20 * np.median(moving)).sum())
        if gaps > len(record.starts):
            notes.append(f"{gaps} gaps in time within runs")
    else:
        defects.append(f"time does not move within the runs by steps above {TIME_RESOLUTION:g} s")
    torque, twist = record.output_torque, record.twist(ratio)
    levels = np.unique(torque)
    smallest = float(np.diff(levels).min()) if levels.size > 1 else 0.0
    quantised = levels.size < 0.2 * n and levels.size > 1
    loaded = exceeds_resolution(torque, TORQUE_RESOLUTION, float(np.abs(torque).max()))
    if not loaded:
        defects.append(f"the torque never changes by more than {TORQUE_RESOLUTION:g} N.m or its own rounding")
    top = max(float(np.mean(torque >= levels[-1] - 1e-12)), float(np.mean(torque <= levels[0] + 1e-12)))
    if levels.size > 20 and top > SATURATION_SHARE:
        notes.append(
            f"{100 * top:.0f} % of the samples stand at the torque's extreme: a saturated sensor or a limited load"
        )
    angles = float(np.abs(record.crank_angle / ratio).max() + np.abs(record.output_angle).max())
    if not exceeds_resolution(twist, ANGLE_RESOLUTION, angles):
        defects.append(f"the twist never changes by more than {ANGLE_RESOLUTION:.2g} rad or its own rounding")
    elif np.ptp(twist) > MAX_TWIST:
        defects.append(
            f"the twist spans {np.ptp(twist):.3g} rad, and no gear's spans more than {MAX_TWIST:g}: a unit "
            f"or the ratio, {ratio:g}, is wrong (twist = crank angle/ratio - output angle)"
        )
    elif loaded and np.corrcoef(twist, torque)[0, 1] < -0.5:
        defects.append(
            "the torque falls as the twist grows: the twist, or the torque, has the wrong sign "
            "(twist = crank angle/ratio - output angle)"
        )
    for name in record.missing:
        notes.append(
            {
                "crank_angle": "no crank angle: the crank counts as locked",
                "run": "no run column: one run",
                "temperature": "no temperature: 20 degC throughout",
            }.get(name, f"no column {name}")
        )
    return Audit(n, len(record.starts), rate, smallest if quantised else 0.0, tuple(notes), tuple(defects))


def exceeds_resolution(values: NDArray[np.float64], finest: float, size: float) -> bool:
    """Whether values (n,) change by more than the finest instrument sees, and more than their rounding.

    finest: in their unit; size: the greatest of the numbers that they were made from.

    >>> exceeds_resolution(np.array([0.3, 0.3 + 1e-16]), 0.0, 0.3)
    False
    >>> exceeds_resolution(np.array([0.3, 0.4]), ANGLE_RESOLUTION, 0.3)
    True
    """
    return float(np.ptp(values)) > max(finest, ROUNDING * size)
