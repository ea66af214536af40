"""Whether a record is of the mean drive: it lacks the ripple that every individual of the population has.

The balls and lobes of an individual deviate one by one, so that its torque ripples as the crank turns, in patterns that
the population determines. Effects shift the curve, bend it or add friction; over a turn they are smooth. A drive that
turns without that ripple is the mean drive (a simulated drive, or one far better than its tolerances), and scatter then
explains nothing.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ..estimation.problem import Problem
from ..estimation.residuals import CHI_SQUARE_MEDIAN

MIN_TURN, MAX_TURN = np.pi, 50 * np.pi
"""Travel of the crank, rad, of a run that shows ripple: below half a turn there is too little of it, and above 25 turns
the blocks average it out; chosen by judgement."""
MIN_BLOCKS = 40
"""Smallest number of blocks of a run that shows ripple; chosen by judgement."""
MIN_PROGRESS = 0.2
"""Smallest travel of the crank between two blocks, over the mean of the run, at which it counts as turning; chosen by
judgement."""
SMOOTH_ORDERS, SMOOTH_DEGREE = 4, 5
"""Orders of the crank and degree of the polynomial over the run that effects may make, and that do not count as ripple.
The orders are those of the effect kinematic_error; the degree is chosen by judgement."""
MIN_PATTERN_VARIANCE = 20.0
"""Variance of a pattern of the population, in units of the noise, from which it is visible; chosen by judgement."""
MIN_PATTERNS = 8
"""Number of visible patterns from which the record can show an individual; chosen by judgement."""
MAX_MEAN_DRIVE_RIPPLE = 0.2
"""Ripple size, in standard deviations of the population, below which a record is of the mean drive. In 168 simulated
individuals of seven drawings, at noises of 0.16 to 0.8 %, it was 0.57 to 1.8, in as many mean drives at most 0.13."""


def ripple_size(problem: Problem, individuals: Array) -> float | None:
    """Size of the record's ripple over that of `individuals` (m, n), N.m; None where this record cannot show it.

    It is the median over the patterns: a cogging motor or a missing ball makes a few of them large, an individual all.
    """
    if not len(individuals):
        return None
    curve = 0.0
    if problem.scatter:
        curve = problem.base.elastic.evaluate(problem.scatter.twist, 0.0, problem.base.shape.start)[0]
    rows = np.vstack([problem.torque - curve, individuals]) / np.sqrt(problem.variance)
    run, crank = problem.trace.run[problem.blocks.first], problem.blocks.mean(problem.trace.crank)
    parts = [ripple for number in np.unique(run) if (ripple := _ripple_of_run(rows, crank, run == number)) is not None]
    if not parts:
        return None
    ripple = np.concatenate(parts, axis=1)
    gram = ripple[1:] @ ripple[1:].T / len(individuals)
    strength, vectors = np.linalg.eigh(gram)
    visible = strength > MIN_PATTERN_VARIANCE
    if visible.sum() < MIN_PATTERNS:
        return None
    along = vectors.T[visible] @ (ripple[1:] @ ripple[0]) / np.sqrt(strength[visible] * len(individuals))
    return float(np.sqrt(np.median(along**2 / strength[visible]) / CHI_SQUARE_MEDIAN))


def _ripple_of_run(rows: Array, crank: Array, inside: NDArray[np.bool_]) -> Array | None:
    """Rows (m, n) in the blocks of one run, without what is smooth over a turn; None where the run shows no ripple."""
    here = np.flatnonzero(inside)
    if len(here) < MIN_BLOCKS or np.ptp(crank[here]) < MIN_TURN or np.ptp(crank[here]) > MAX_TURN:
        return None
    # While the crank stands there is no ripple.
    here = here[np.abs(np.gradient(crank[here])) > MIN_PROGRESS * np.ptp(crank[here]) / len(here)]
    if len(here) < MIN_BLOCKS:
        return None
    order = np.arange(1, SMOOTH_ORDERS + 1) * crank[here][:, None]
    index = np.linspace(-1, 1, len(here))
    smooth = np.concatenate(
        [np.cos(order), np.sin(order), np.polynomial.legendre.legvander(index, SMOOTH_DEGREE)], axis=1
    )
    basis = np.linalg.qr(smooth)[0]
    values = rows[:, here]
    return values - values @ basis @ basis.T


def lacks_ripple(problem: Problem, individuals: Array) -> bool:
    """Whether the record would show the ripple of an individual and does not; individuals: (m, n) N.m."""
    size = ripple_size(problem, individuals)
    return size is not None and size < MAX_MEAN_DRIVE_RIPPLE
