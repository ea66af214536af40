"""A change of the torque held against what single drives of the population do by themselves."""

from __future__ import annotations

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..estimation.least_squares import HELD_SIZE, Fit
from ..estimation.problem import Problem
from ..estimation.weighting import INDIVIDUAL_SIZE, SCATTER_SIZES

FARTHEST = 3.0
"""Standard deviations from the mean drive to which single drives reach."""
WIDER = 1.1
"""Margin on the range that some dozens of individuals span."""


def population_deviations(problem: Problem, fit: Fit, change: Array) -> float:
    """An effect's change (n,), N.m, over the standard deviation of what individuals show in its direction.

    The random effect may be told from it all the same; but then a few per cent of misfit decide.
    """
    if not len(problem.individuals):
        return float("inf")
    scale = 1 / np.sqrt(problem.variance)
    zero = fit.prediction.sensitivities[:, 0] * scale
    zero = zero / max(float(np.linalg.norm(zero)), 1e-300)
    along = change * scale
    along = along - zero * float(zero @ along)
    size = float(along @ along)
    deviation = float(np.std(problem.individuals @ (along * scale)))
    return size / max(deviation, 1e-300)


def residual_outside_population(problem: Problem, fit: Fit) -> float:
    """Rms, N.m, of what is left beside a fit, free of the noise, where no single drive of the population leaves that
    much or that little; 0 where one does."""
    rest = float(np.mean((problem.torque - fit.prediction.torque) ** 2) - np.mean(problem.block_variance))
    rest = float(np.sqrt(max(rest, 0.0)))
    if not len(problem.individuals):
        return 0.0
    zero = fit.prediction.sensitivities[:, 0]
    zero = zero / max(float(np.linalg.norm(zero)), 1e-300)
    single = problem.individuals - np.outer(problem.individuals @ zero, zero)
    each = np.sqrt(np.mean(single**2, axis=1))
    most = max(float(each.max()), FARTHEST * float(np.sqrt(np.mean(each**2))))
    return 0.0 if each.min() / WIDER <= rest <= most * WIDER else rest


def as_individual_drive(problem: Problem, fit: Fit) -> Fit:
    """The fit as one of a drive that scatters at least as little as single drives do."""
    rest = problem.torque - fit.prediction.torque
    sizes = [problem.weights.with_size(size) for size in SCATTER_SIZES if size >= INDIVIDUAL_SIZE]
    likeliest = min(sizes, key=lambda w: float((w.whiten(rest) ** 2).sum()) + w.log_determinant)
    return problem.fit_from(fit.names, fit.parameters, likeliest, options=HELD_SIZE)
