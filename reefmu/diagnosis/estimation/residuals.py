"""What a fit leaves: remainder, scatter, and overdispersion.

A missing effect is local: its residual depends on where the drive is. Noise that is larger or slower than estimated is
everywhere. Where even the median segment of the record exceeds what the noise should leave, gains are divided by that
overdispersion (McCullagh and Nelder, Generalized Linear Models, 1989, section 4.5).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.fft import dct

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from .least_squares import Fit
from .problem import Problem
from .score_test import amplitudes, eliminate
from .weighting import Weighting

MAX_SEGMENT_BLOCKS = 60
"""Greatest length of a segment in blocks. Chosen by judgement: short against the whole record, so that a local residual
does not enter the median segment."""
N_SLOW_MODES = 6
"""Lowest cosine modes of a segment in which slow noise shows. Chosen by judgement: a tenth of a full segment."""
CHI_SQUARE_MEDIAN = 0.4549
"""Median of chi-square with one degree of freedom."""


def costs_by_size(weights: Weighting, values: Array, sizes: Sequence[float]) -> list[float]:
    """-2 log likelihood of a residual beside free columns, under every size of the scatter.

    values: (n, 1 + k) N.m, the residual and the columns.
    """
    products = zip(weights.products(values, sizes), sizes, strict=True)
    free = values.shape[1] - 1
    return [
        float(eliminate(of_size, 1, free)[0, 0]) + weights.with_size(size).log_determinant for of_size, size in products
    ]


def remainder(problem: Problem, fit: Fit) -> float:
    """Rms residual, N.m, that neither the model nor the scatter nor the noise explains."""
    residual = problem.torque - fit.prediction.torque
    residual = residual - predicted_scatter(problem, fit, residual)
    weight = problem.blocks.count / problem.blocks.count.sum()
    excess = float((weight * (residual**2 - problem.block_variance)).sum())
    return float(np.sqrt(max(excess, 0.0)))


def predicted_scatter(problem: Problem, fit: Fit, residual: Array) -> Array:
    """(n,) N.m, best linear unbiased prediction of the drive's own scatter in a residual (n,), N.m."""
    w = fit.weighting
    variance = w.size**2 * w.eigenvalues
    along = w.basis.T @ (residual * w.scale)
    return (w.basis @ (along * variance / (1 + variance))) / w.scale


def torque_without(problem: Problem, fit: Fit, names: Collection[str]) -> Array:
    """(n,) N.m, torque of a fit with some effects switched off and all other parameters unchanged."""
    p, where = fit.parameters.copy(), problem.layout(fit.names).effects
    for name in names:
        effect = find_effect(name)
        for k in amplitudes(effect):
            p[where[name].start + k] = effect.parameters[k].neutral
    return problem.predictor(fit.names)(p).torque


def estimate_overdispersion(problem: Problem, fit: Fit, residual: Array | None = None) -> float:
    """Variance of a residual over its expectation in the median segment, at least 1.

    The greater of two estimates: from all blocks, and from the slow modes of a segment, which show noise with a longer
    autocorrelation than estimated. residual: (n,) N.m; that of the fit if None.
    """
    residual = problem.torque - fit.prediction.torque if residual is None else residual
    number, white = segments(problem), fit.weighting.whiten(residual)
    expected = np.bincount(number, problem.expected_squares(fit.weighting))
    whole = float(np.median(np.bincount(number, white**2) / expected))
    longer = [part for k in range(len(expected)) if len(part := white[number == k]) > 2 * N_SLOW_MODES]
    slow = [np.asarray(dct(part, norm="ortho"))[:N_SLOW_MODES] ** 2 for part in longer]
    return max(1.0, whole, float(np.median(slow)) / CHI_SQUARE_MEDIAN if slow else 1.0)


def segments(problem: Problem) -> NDArray[np.intp]:
    """(n,) number of the segment of each block: one run, one direction of the twist, at most `MAX_SEGMENT_BLOCKS`."""
    t = problem.trace
    run = t.run[problem.blocks.first]
    change = np.where(t.start, 0.0, np.diff(t.smooth_twist, prepend=t.smooth_twist[0]))
    direction = np.sign(problem.blocks.mean(change))
    # While the twist stands still the segment goes on.
    direction = direction[np.maximum.accumulate(np.where(direction != 0, np.arange(len(direction)), 0))]
    begins = (np.diff(run, prepend=run[0] - 1) != 0) | (np.diff(direction, prepend=direction[0]) != 0)
    number = np.cumsum(begins) - 1
    since = np.arange(len(run)) - np.flatnonzero(begins)[number]
    return np.unique(number * (len(run) + 1) + since // MAX_SEGMENT_BLOCKS, return_inverse=True)[1]
