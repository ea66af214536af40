"""Audit of a record before anything is fitted: rates, saturation, gaps, a wrong sign, the transmission ratio."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.errors import InputError

from ...record import Record

MIN_SAMPLES = 100
"""Least number of samples of a record that is diagnosed. Chosen by judgement: fewer do not make a hysteresis loop."""
SATURATION_SHARE = 0.03
"""Share of the samples at the torque's extreme from which saturation is noted. Chosen by judgement."""
TIME_RESOLUTION = 1e-9
"""s, least time step that counts. Converters for angle and torque take longer, so shorter steps are rounding."""
ANGLE_RESOLUTION = 2 * np.pi / 2**32
"""rad, least change of an angle that counts: the finest encoders divide a turn into 2^32 steps."""
TORQUE_RESOLUTION = 1e-9
"""N.m, least change of the torque that counts. The finest shaft sensors resolve about 1e-6; the margin is ample."""
ROUNDING = 16 * float(np.finfo(float).eps)
"""Relative change of a number that may be rounding: sixteen units in the last place, chosen by judgement."""
MAX_TWIST = 1.0
"""rad, greatest plausible span of a twist. Chosen by judgement, far above that of any gear."""
GAP_STEPS = 20
"""Time step, over the median step of its run, that counts as a gap. Chosen by judgement."""
QUANTISED_SHARE = 0.2
"""Distinct torques, over the number of samples, below which the torque counts as quantised. Chosen by judgement."""
WRONG_SIGN_CORRELATION = -0.5
"""Correlation of torque and twist below which a sign must be wrong: hysteresis and noise leave it positive."""
MIN_RATIO, MAX_RATIO_RESIDUAL = 1.5, 0.05
"""Least transmission ratio, and greatest relative residual of the line through the angles, at which the angles show a
ratio. Chosen by judgement: no gear of this kind has a lower ratio, and a twist is far smaller."""
LOCKED_SHARE = 0.002
"""Range of the crank angle, over that of the output angle, below which the crank is locked and its encoder shows noise.
Chosen by judgement: a crank that turns moves farther than the output, and a twist that is off by this share is none."""
WHOLE_RATIO = 0.02
"""Relative distance to an integer within which a ratio is that integer. Chosen by judgement: play and twist shift the
slope by less."""


@dataclass(frozen=True)
class Audit:
    """samples, runs: their numbers; rate: Hz, median sampling rate; torque_step: N.m, quantisation of the torque, 0 if
    none shows; notes: for the reader; defects: each of them prevents a diagnosis.
    """

    samples: int
    runs: int
    rate: float
    torque_step: float
    notes: tuple[str, ...]
    defects: tuple[str, ...]


def audit(record: Record, ratio: float | None) -> Audit:
    """Audit a record of a gear with a signed transmission ratio, None where the record does not show it."""
    n = len(record)
    inner = np.diff(record.run) == 0
    step = np.diff(record.time)[inner]
    notes, defects = [], []
    if n < MIN_SAMPLES:
        defects.append(f"only {n} samples; expected at least {MIN_SAMPLES}")
    moving = step[step > TIME_RESOLUTION]
    rate = 1 / float(np.median(moving)) if moving.size else 0.0
    if moving.size:
        if gaps := count_gaps(record):
            notes.append(f"{gaps} {'gap' if gaps == 1 else 'gaps'} in time within runs")
    else:
        defects.append(f"the time does not advance within the runs by steps above {TIME_RESOLUTION:g} s")
    torque, twist = record.output_torque, record.twist(ratio)
    levels = np.unique(torque)
    smallest = float(np.diff(levels).min()) if levels.size > 1 else 0.0
    quantised = levels.size < QUANTISED_SHARE * n and levels.size > 1
    loaded = exceeds_resolution(torque, TORQUE_RESOLUTION, float(np.abs(torque).max()))
    if not loaded:
        defects.append(f"the torque never changes by more than {TORQUE_RESOLUTION:g} N.m or its rounding error")
    top = max(float(np.mean(torque >= levels[-1] - 1e-12)), float(np.mean(torque <= levels[0] + 1e-12)))
    if levels.size > 20 and top > SATURATION_SHARE:
        notes.append(
            f"{100 * top:.0f} % of the samples lie at the extreme torque: a saturated sensor or a limited load"
        )
    angles = float(np.abs(twist + record.output_angle).max() + np.abs(record.output_angle).max())
    if not exceeds_resolution(twist, ANGLE_RESOLUTION, angles):
        defects.append(f"the twist never changes by more than {ANGLE_RESOLUTION:.2g} rad or its rounding error")
    elif np.ptp(twist) > MAX_TWIST:
        wrong = "a unit" if ratio is None else f"a unit or the ratio, {ratio:g},"
        defects.append(
            f"the twist spans {np.ptp(twist):.3g} rad, and that of a gear no more than {MAX_TWIST:g}: {wrong} is wrong "
            "(twist = crank angle/ratio - output angle)"
        )
    elif loaded and np.corrcoef(twist, torque)[0, 1] < WRONG_SIGN_CORRELATION:
        defects.append(
            "the torque falls as the twist grows: the twist (crank angle/ratio - output angle) or the torque has the "
            'wrong sign; a column map that names every column to use reverses it: TITLE = "-output_torque [N.m]"'
        )
    locked = (
        "output is taken as locked while the crank turns" if record.is_output_locked else "crank is taken as locked"
    )
    for name in record.missing:
        notes.append(
            {
                "crank_angle": f"no crank angle: the {locked}",
                "run": "no run column: the record is taken as one run",
                "temperature": "no temperature: taken as 20 degC throughout",
            }.get(name, f"no column {name}")
        )
    return Audit(n, len(record.starts), rate, smallest if quantised else 0.0, tuple(notes), tuple(defects))


def exceeds_resolution(values: NDArray[np.float64], resolution: float, magnitude: float) -> bool:
    """Whether the range of values (n,) exceeds the resolution of the finest instrument and the rounding error.

    resolution: in the unit of the values; magnitude: greatest of the numbers that they were computed from.

    >>> exceeds_resolution(np.array([0.3, 0.3 + 1e-16]), 0.0, 0.3)
    False
    >>> exceeds_resolution(np.array([0.3, 0.4]), ANGLE_RESOLUTION, 0.3)
    True
    """
    return float(np.ptp(values)) > max(resolution, ROUNDING * magnitude)


def count_gaps(record: Record) -> int:
    """Number of time steps within runs that are gaps; every run has a sampling rate of its own."""
    gaps = 0
    for time in np.split(record.time, record.starts[1:]):
        step = np.diff(time)
        moving = step[step > TIME_RESOLUTION]
        gaps += int((moving > GAP_STEPS * np.median(moving)).sum()) if moving.size else 0
    return gaps


def ratio_from_angles(record: Record) -> float | None:
    """The signed transmission ratio from the angles of a record; None where a shaft is locked.

    Twist and torque at the output then do not depend on it.
    The crank angle over the output angle is a straight line except for the twist. Its slope is the ratio, rounded to
    the nearest integer within `WHOLE_RATIO`. Raises `InputError` where the angles show no ratio.
    """
    crank, output = record.crank_angle, record.output_angle
    if np.ptp(crank) <= LOCKED_SHARE * np.ptp(output) or "crank_angle" in record.missing:
        return None
    where = record.source or "record"
    expected = (
        "expected a crank that turns with the output or is locked, or a twist [rad] in place of the angles, for a gear "
        "without a drawing"
    )
    if not exceeds_resolution(output, ANGLE_RESOLUTION, float(np.abs(output).max())):
        raise InputError(
            f"{where}: {expected}, got a crank that turns while the output stands still: the ratio is unknown"
        )
    x, y = output - output.mean(), crank - crank.mean()
    slope = float(x @ y) / float(x @ x)
    residual = float(np.std(y - slope * x) / np.std(crank))
    if abs(slope) < MIN_RATIO or residual > MAX_RATIO_RESIDUAL:
        raise InputError(f"{where}: {expected}, got angles that show no transmission ratio")
    whole = round(slope)
    return float(whole if abs(slope - whole) < WHOLE_RATIO * abs(slope) else slope)
