"""The low-pass filter that all channels of a record have passed, and where its elements were before it.

Amplifiers and encoders of a rig filter torque and angles alike, so that no channel is late against another. At a steady
speed a filtered angle lags by the filter's time constant, while a torque that changes within it, as where elements
enter and leave the profile, is smoothed instead. Each sample of a first-order filter whose input is linear between
samples is a mean of its input there and at the samples before (Franklin, Powell and Workman, Digital Control of Dynamic
Systems, 1998, section 6.3, the triangle-hold equivalent). Where samples are farther apart than the time constant, the
sample before has nearly all the weight of those, and alone counts here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...speed import median_step
from .trace import Trace


@dataclass(frozen=True)
class Instant:
    """One of the instants of which a filtered torque is the mean, for n samples.

    crank, twist: (n,) rad, without the filter; share: (n,), weight in the mean.
    """

    crank: Array
    twist: Array
    share: Array


def filtered_instants(trace: Trace, time_constant: float) -> tuple[Instant, Instant]:
    """The instants whose mean the filtered torque of every sample is: its own and that of the sample before.

    time_constant: s, of a first-order low-pass filter of all channels; the crank's speed is taken as steady within it.
    """
    step = _usual_step(trace)
    per_sample = np.concatenate([_change(trace.crank[a:b]) for a, b in trace.run_ranges])
    crank = trace.crank + time_constant * np.divide(per_sample, step, out=np.zeros(len(trace)), where=step > 0)
    before = np.where(trace.start, 0, -1) + np.arange(len(trace))
    share = _share_before(step, time_constant)
    return (
        Instant(crank, trace.smooth_twist, 1 - share),
        Instant(crank[before], trace.smooth_twist[before], share),
    )


def _usual_step(trace: Trace) -> Array:
    """(n,) s, usual time between neighbouring samples: clocks jitter more than motions do."""
    times = (trace.time[a:b] for a, b in trace.run_ranges)
    return np.concatenate([median_step(np.diff(t, append=2 * t[-1] - t[-2])) if len(t) > 1 else 0 * t for t in times])


def _change(angle: Array) -> Array:
    """(n,) rad, change of an angle of one run from sample to sample, in the middle of the steps on either side."""
    return np.gradient(angle) if len(angle) > 1 else np.zeros(len(angle))


def _share_before(step: Array, time_constant: float) -> Array:
    """(n,) weight of the sample before in a filtered one."""
    if time_constant <= 0:
        return np.zeros(len(step))
    steps = np.maximum(step / time_constant, 1e-9)
    return -np.expm1(-steps) / steps
