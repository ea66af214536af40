"""Gains that null drives reach by chance: by the noise alone, and as individuals of the population."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import Place, find_effect
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.score_test import Direction, orthonormal_basis, score_gains
from ..estimation.weighting import MEAN_DRIVE_SIZE

NOISE_GAIN, NOISE_GAIN_PER_PARAMETER = 16.0, 4.0
"""Gain that noise alone does not reach."""
MARGIN, KINEMATIC_MARGIN = 1.5, 5.0
"""On the greatest gain among the simulated individuals, which are not many; a kinematic error is by its nature what
the lobes of an individual make."""
INDIVIDUAL_GAIN = 42.0
"""Gain below which nothing is named on an individual: scatter is not as normal as noise."""


@dataclass(frozen=True)
class Thresholds:
    """Gains that null drives reach: by noise alone and as individuals of the population, by candidate.

    null_excess: cost that single drives of the population leave beyond the components of the scatter.
    """

    noise: Mapping[str, float]
    individuals: Mapping[str, float]
    null_excess: float = 0.0

    def total(self, fit: Fit) -> float:
        """What all effects of a fit would gain together on a null drive."""
        return sum(self.of(name, fit.weighting.size) for name in fit.names)

    def of(self, name: str, size: float) -> float:
        """The threshold of a candidate where the scatter left has this size."""
        share = float(np.clip((size - MEAN_DRIVE_SIZE) / 0.35, 0.0, 1.0))
        return self.noise[name] + share * max(self.individuals[name] - self.noise[name], 0.0)


def calibrate_thresholds(
    problem: Problem, base: Fit, fresh: Array, traces: Mapping[str, Sequence[Direction]], seed: int = 0
) -> Thresholds:
    """Thresholds from individuals `fresh` (m, n), N.m, that no component was made of, with this record's noise;
    traces: variants of every candidate."""
    noise = {
        name: NOISE_GAIN + NOISE_GAIN_PER_PARAMETER * len(find_effect(name).parameters) for name in problem.candidates
    }
    if not len(fresh):
        return Thresholds(noise, noise)
    weights = problem.weights.with_size(1.0)
    rng = np.random.default_rng(np.random.SeedSequence([seed, len(fresh)]))
    basis = orthonormal_basis(weights, base.prediction.sensitivities)
    nulls = fresh.T + np.sqrt(problem.block_variance)[:, None] * rng.standard_normal((len(problem.torque), len(fresh)))
    residuals = weights.whiten(nulls)
    residuals = residuals - basis @ (basis.T @ residuals)
    null_excess = 1.3 * max(0.0, float((residuals**2).sum(axis=0).max() - problem.expected_chi_square(weights)))
    individuals = {}
    for name in problem.candidates:
        greatest = 0.0
        for direction in traces[name]:
            greatest = max(greatest, float(score_gains(direction, weights, basis, residuals)[0].max()))
        margin = KINEMATIC_MARGIN if find_effect(name).place is Place.KINEMATIC else MARGIN
        individuals[name] = max(noise[name], INDIVIDUAL_GAIN, margin * greatest)
    return Thresholds(noise, individuals, null_excess)
