"""The log likelihood ratio of two sets of effects, each with the scatter at its own contacts."""

from __future__ import annotations

import numpy as np

from reefmu.diagnosis.estimation.weighting import Weighting
from stiffness_model.numerics.arrays import Array


def log_ratio(true: Weighting, other: Weighting, apart: Array) -> tuple[float, float]:
    """Mean and standard deviation, over records of the true set, of its log likelihood less that of another.

    true, other: covariances of both, of the same noise; apart: (n,) N.m, torque of the true set less that of the other.
    The mean is the Kullback-Leibler divergence of two Gaussian distributions; the ratio is a quadratic form of one,
    whose variance is that of Mathai and Provost, Quadratic Forms in Random Variables, 1992, section 3.2b. With one
    covariance, under which the torques are d standard deviations apart, they are d^2 / 2 and d.
    """
    columns, distance = other.whiten(true.size * true.components.T), other.whiten(apart)
    spread = other.size**2 * other.eigenvalues
    damping = spread / (1 + spread)
    # The true covariance whitened by the other one is I + C C^T - B D B^T.
    along, along_distance = other.basis.T @ columns, other.basis.T @ distance
    trace = float((columns**2).sum() - damping.sum())
    square = float(((columns.T @ columns) ** 2).sum() + (damping**2).sum() - 2 * (damping[:, None] * along**2).sum())
    of_distance = float((distance**2).sum())
    mean = 0.5 * (trace + other.log_determinant - true.log_determinant + of_distance)
    stretched = of_distance + float(((columns.T @ distance) ** 2).sum()) - float(damping @ along_distance**2)
    return mean, float(np.sqrt(0.5 * square + stretched))
