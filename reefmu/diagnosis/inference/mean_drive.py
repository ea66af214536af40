"""Whether a record is of the mean drive: it lacks the ripple that every single drive of the population has.

A single drive's balls and lobes deviate one by one, so that its torque ripples as the crank turns, in patterns that the
population fixes. Effects shift, bend or rub; over a turn they are smooth. A drive that turns without that ripple is
the mean drive (a simulated one, or one far better than its tolerances), and then nothing may be put down to scatter.
"""

from __future__ import annotations

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..estimation.problem import Problem
from ..estimation.residuals import CHI_SQUARE_MEDIAN

LEAST_TURN, LEAST_BLOCKS = np.pi, 40
"""Way of the crank, rad, and blocks of a run that shows ripple."""
SMOOTH_ORDERS, SMOOTH_DEGREE = 4, 5
"""What effects may make over a turn: orders of the crank, and a polynomial."""
SEEN = 20.0
"""Variance of a pattern over the noise's from which it counts."""
LEAST_PATTERNS = 8
MEAN_SIZE = 0.2
"""Size of the ripple, in standard deviations of the population, below which it is not there: 168 individuals of seven
drawings at noises of 0.16 to 0.8 % had 0.57 to 1.8, as many mean drives up to 0.13."""


def ripple_size(problem: Problem, individuals: Array) -> float | None:
    """Size of the record's ripple over that of `individuals` (m, n), N.m; None where this record cannot show it.

    The median over the patterns: a cogging motor or a missing ball makes a few of them large, an individual all.
    """
    if not len(individuals):
        return None
    curve = (
        problem.base.elastic.evaluate(problem.scatter.twist, 0.0, problem.base.shape.start)[0]
        if problem.scatter
        else 0.0
    )
    rows = np.vstack([problem.torque - curve, individuals]) / np.sqrt(problem.variance)
    run, crank = problem.trace.run[problem.blocks.first], problem.blocks.mean(problem.trace.crank)
    parts = []
    for number in np.unique(run):
        here = np.flatnonzero(run == number)
        if len(here) < LEAST_BLOCKS or np.ptp(crank[here]) < LEAST_TURN or np.ptp(crank[here]) > 50 * LEAST_TURN:
            continue
        # Between blocks the crank turns on; while it stands there is nothing to see.
        here = here[np.abs(np.gradient(crank[here])) > 0.2 * np.ptp(crank[here]) / len(here)]
        if len(here) < LEAST_BLOCKS:
            continue
        order = np.arange(1, SMOOTH_ORDERS + 1) * crank[here][:, None]
        index = np.linspace(-1, 1, len(here))
        smooth = np.concatenate(
            [np.cos(order), np.sin(order), np.polynomial.legendre.legvander(index, SMOOTH_DEGREE)], axis=1
        )
        basis = np.linalg.qr(smooth)[0]
        part = rows[:, here]
        parts.append(part - part @ basis @ basis.T)
    if not parts:
        return None
    whole = np.concatenate(parts, axis=1)
    gram = whole[1:] @ whole[1:].T / len(individuals)
    strength, vectors = np.linalg.eigh(gram)
    seen = strength > SEEN
    if seen.sum() < LEAST_PATTERNS:
        return None
    along = vectors.T[seen] @ (whole[1:] @ whole[0]) / np.sqrt(strength[seen] * len(individuals))
    return float(np.sqrt(np.median(along**2 / strength[seen]) / CHI_SQUARE_MEDIAN))


def is_mean_drive(problem: Problem, individuals: Array) -> bool:
    """Whether the record could show an individual's ripple and does not."""
    size = ripple_size(problem, individuals)
    return size is not None and size < MEAN_SIZE
