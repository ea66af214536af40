"""The low-pass filter that all channels of a record have passed, and where its elements were before it.

Amplifiers and encoders of a rig filter torque and angles alike, so that no channel is late against another. At a steady
speed a filtered angle lags by the filter's time constant, while a torque that changes within it, as where elements
enter and leave the profile, is smoothed instead. Each sample of a first-order filter whose input is linear between
samples is a mean of its input there and at the samples before (Franklin, Powell and Workman, Digital Control of Dynamic
Systems, 1998, section 6.3, the triangle-hold equivalent). From the first sample before on the weights fall
geometrically: those of the last ones are counted at their mean age, so that a torque that changes slowly lags by the
time constant, as the angles do.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...speed import median_step
from .trace import Trace

LAST_SHARE = 0.1
"""Weight of the last samples before, in the mean, that are counted together. Chosen by the likelihood of seven records
of individuals that were sampled at twice the time constant: -2 log likelihood is 4 to 39 lower than where all samples
before (0.42) are counted at the first of them, and changes by less than 6 with 0.007."""


@dataclass(frozen=True)
class Instant:
    """One of the instants of which a filtered torque is the mean, for n samples.

    crank, twist: (n,) rad, without the filter; share: (n,), weight in the mean.
    """

    crank: Array
    twist: Array
    share: Array


def filtered_instants(trace: Trace, time_constant: float) -> list[Instant]:
    """The instants whose mean the filtered torque of every sample is, its own first.

    time_constant: s, of a first-order low-pass filter of all channels; the crank's speed is taken as steady within it.
    Of samples closer than the time constant only some count, about as far apart as it.
    """
    per_sample = np.concatenate([_change(trace.crank[a:b]) for a, b in trace.run_ranges])
    if time_constant <= 0:
        return [Instant(trace.crank, trace.smooth_twist, np.ones(len(trace)))]
    step = _usual_step(trace)
    # Where stamps show no time between samples, the filter is taken to have settled.
    step[step <= 0] = 1e9 * time_constant
    crank = trace.crank + time_constant / step * per_sample
    stride = np.ceil(time_constant / step).astype(np.intp)
    steps = stride * step / time_constant
    decay, rest = np.exp(-steps), -np.expm1(-steps) / steps

    def before(number: int, share: Array, further: Array) -> Instant:
        at = _before(trace, number * stride)
        return Instant((crank - further * stride * per_sample)[at], trace.smooth_twist[at], share)

    found, number = [Instant(crank, trace.smooth_twist, 1 - rest)], 1
    while (rest[per_sample != 0] > LAST_SHARE).any():
        found.append(before(number, rest * (1 - decay), np.zeros(len(trace))))
        rest, number = rest * decay, number + 1
    # By how many steps the mean of geometric weights lies before the first.
    return [*found, before(number, rest, decay / (1 - decay))]


def _before(trace: Trace, count: NDArray[np.intp]) -> NDArray[np.intp]:
    """(n,) numbers of the samples that are some samples (n,) before each, at most the first of its run."""
    number = np.arange(len(trace))
    return np.maximum(number - count, np.maximum.accumulate(np.where(trace.start, number, 0)))


def _usual_step(trace: Trace) -> Array:
    """(n,) s, usual time between neighbouring samples: clocks jitter more than motions do."""
    times = (trace.time[a:b] for a, b in trace.run_ranges)
    return np.concatenate([median_step(np.diff(t, append=2 * t[-1] - t[-2])) if len(t) > 1 else 0 * t for t in times])


def _change(angle: Array) -> Array:
    """(n,) rad, change of an angle of one run from sample to sample, in the middle of the steps on either side."""
    return np.gradient(angle) if len(angle) > 1 else np.zeros(len(angle))
