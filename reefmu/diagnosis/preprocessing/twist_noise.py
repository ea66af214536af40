"""The noise of the twist: taken off twist and torque alike, and what is left of it in the twist's rate and path.

Torques are compared at a measured twist. The noise of that twist is in the residual, times the stiffness of the base
curve, and in everything that is computed from the twist: a softer drive, a steeper curve or any two functions of the
torque whose sum is flat but steep would explain it (regression with errors in variables: Fuller, Measurement Error
Models, 1987, section 1.1). The twist that the neighbours of a block have does not hold the block's noise. A damped
drive multiplies the noise of the twist's rate by its damping, and where friction begins to slide anew after a reversal
its torque changes with the twist's path far more steeply than that of the contacts.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from stiffness_model.numerics.arrays import Array

from .motion import monotone_path, rate_errors, signal_noise
from .trace import Blocks, Trace

MOST_DEVIATIONS = 4.0
"""Standard deviations beyond which the difference of a block from its neighbours is motion, such as a reversal: white
noise exceeds them once in 16 000 blocks."""

CUBIC = np.array([1.0, -4.0, 6.0, -4.0, 1.0]) / 6
"""Coefficients of the difference of a value from the cubic through two equidistant neighbours on either side."""

N_DRAWS = 30
"""Random errors of the twist's rate that give its variance in the blocks, within a quarter of it."""
N_PATHS = 16
"""The same of the twist's path, within a third."""


def at_twist_of_neighbours(trace: Trace, blocks: Blocks, slope: Array) -> Trace:
    """The trace with every block at the twist that the two blocks before and the two after it in its run have, and with
    the torque that the base curve has there.

    slope: (n,) N.m/rad, stiffness of the base curve in the blocks. Effects change the stiffness by a part of it, so
    that of what the neighbours have differently only that part enters the residual.
    """
    noise = blocks.spread(_noise(trace, blocks))
    return replace(
        trace,
        twist=trace.twist - noise,
        torque=trace.torque - blocks.spread(slope) * noise,
    )


def _noise(trace: Trace, blocks: Blocks) -> Array:
    """(n,) rad, difference of the mean twist of each block from the cubic through its neighbours; 0 where that is
    motion, and in the two blocks at either end of a run."""
    twist, run = blocks.mean(trace.twist), trace.run[blocks.first]
    found = np.zeros(len(twist))
    if len(twist) > 4:
        found[2:-2] = np.convolve(twist, CUBIC, "valid")
        found[2:-2][run[:-4] != run[4:]] = 0.0
    deviation = signal_noise(trace.twist, trace.run_ranges) * np.sqrt((CUBIC**2).sum() / blocks.count)
    return np.where(np.abs(found) < MOST_DEVIATIONS * deviation, found, 0.0)


def rate_variance(trace: Trace, blocks: Blocks) -> Array:
    """(n,) (rad/s)^2, variance of the mean rate of the twist in the blocks, by the noise of the measured twist."""
    noise, rng = signal_noise(trace.twist, trace.run_ranges), np.random.default_rng(np.random.SeedSequence(0))
    parts = [rate_errors(trace.twist[a:b], trace.time[a:b], noise, N_DRAWS, rng) for a, b in trace.run_ranges]
    return np.mean([blocks.mean(errors) ** 2 for errors in np.concatenate(parts, axis=1)], axis=0)


def noisy_paths(trace: Trace) -> Iterator[Array]:
    """Some paths (samples,), rad, of a twist as measured with as much noise again as it has; none where it has none."""
    noise, rng = signal_noise(trace.twist, trace.run_ranges), np.random.default_rng(np.random.SeedSequence(0))
    for _ in range(N_PATHS if noise > 0 else 0):
        twist = trace.twist + noise * rng.standard_normal(len(trace))
        yield np.concatenate([monotone_path(twist[a:b], noise) for a, b in trace.run_ranges])
