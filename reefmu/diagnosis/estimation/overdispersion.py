"""Stretches of a record, and how much louder than estimated its noise is in most of them.

What a missing effect leaves has its place; a noise that is larger or slower than estimated is everywhere. Where even
the middle one of all stretches holds more than the noise should leave, gains count for that much less (McCullagh and
Nelder, Generalized Linear Models, 1989, section 4.5: dispersion).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from stiffness_model.numerics.arrays import Array

from .least_squares import Fit
from .problem import Problem

MAX_SEGMENT_BLOCKS = 60
"""Blocks of a stretch at most."""
N_SLOW_MODES = 6
"""Waves of a stretch that count as slow."""
CHI_SQUARE_MEDIAN = 0.4549


def estimate_overdispersion(problem: Problem, fit: Fit, rest: Array | None = None) -> float:
    """Variance of what is left, over what noise and roughness should leave, in the middle stretch; at least 1.

    The greater of two: over all blocks, and over the slow waves of a stretch, where a noise shows that is more
    correlated than it seemed. rest: (n,) N.m, what is left; beside the fit alone if not given.
    """
    rest = problem.torque - fit.prediction.torque if rest is None else rest
    number, white = segments(problem), fit.weighting.whiten(rest)
    expected = np.bincount(number, problem.expected_chi_square_by_block(fit.weighting))
    whole = float(np.median(np.bincount(number, white**2) / expected))
    long_segments = [segment for k in range(len(expected)) if len(segment := white[number == k]) > 2 * N_SLOW_MODES]
    slow = [np.asarray(dct(segment, norm="ortho"))[:N_SLOW_MODES] ** 2 for segment in long_segments]
    return max(1.0, whole, float(np.median(slow)) / CHI_SQUARE_MEDIAN if slow else 1.0)


def segments(problem: Problem) -> NDArray[np.intp]:
    """Number (n,) of the stretch each block is in: of one run and one direction of the twist, not too long."""
    t = problem.trace
    run = t.run[problem.blocks.first]
    way = np.sign(problem.blocks.mean(np.where(t.start, 0.0, np.diff(t.smooth_twist, prepend=t.smooth_twist[0]))))
    # Where the twist stands the stretch goes on.
    way = way[np.maximum.accumulate(np.where(way != 0, np.arange(len(way)), 0))]
    begins = (np.diff(run, prepend=run[0] - 1) != 0) | (np.diff(way, prepend=way[0]) != 0)
    number = np.cumsum(begins) - 1
    since = np.arange(len(run)) - np.flatnonzero(begins)[number]
    return np.unique(number * (len(run) + 1) + since // MAX_SEGMENT_BLOCKS, return_inverse=True)[1]
