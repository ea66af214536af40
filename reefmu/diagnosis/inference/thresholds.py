"""Gains that drives without any effect reach by chance: through noise, and as individuals of the population."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...effects import Place, find_effect
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.score_test import Direction, absorbing_basis, score_gains
from ..estimation.weighting import MEAN_DRIVE_SIZE

NOISE_GAIN, NOISE_GAIN_PER_PARAMETER = 16.0, 4.0
"""Gain that an effect must exceed over noise alone, and more for each of its parameters. A chi-square of one degree of
freedom exceeds 16 once in 16 000; the rest is a margin for noise that is not quite normal, chosen by judgement."""
MARGIN, KINEMATIC_MARGIN = 1.5, 5.0
"""Factors on the greatest gain among the simulated individuals, of which there are only some dozens. A kinematic error
has the larger one because the lobes of an individual make the same pattern. Both are chosen by judgement."""
INDIVIDUAL_GAIN = 42.0
"""Gain below which nothing is named on an individual, because scatter is less normal than noise. Chosen on simulated
records; it sets 1000 of 1184 thresholds, and 28 in its place changes no verdict (ablation)."""
INDIVIDUAL_TRANSITION = 0.35
"""Scatter size above that of the mean drive at which the thresholds of individuals hold in full; chosen by
judgement."""
N_SIMULATED_CYCLES = 60
"""Records with scatter between cycles that are simulated. Chosen by judgement: the mean of 60 chi-squares is known
within a fifth."""
NULL_EXCESS_MARGIN = 1.3
"""Factor on the greatest excess among the simulated individuals; chosen by judgement."""


@dataclass(frozen=True)
class Thresholds:
    """Gains that drives without effects reach, by candidate: `noise` by noise alone, `individuals` as individuals of
    the population. null_excess: cost that individuals leave beyond the components of the scatter.
    """

    noise: Mapping[str, float]
    individuals: Mapping[str, float]
    null_excess: float = 0.0

    def total(self, fit: Fit) -> float:
        """Sum of the thresholds of a fit's effects."""
        return sum(self.of(name, fit.weighting.size) for name in fit.names)

    def of(self, name: str, size: float) -> float:
        """Threshold of a candidate beside a scatter of this size."""
        return self.noise[name] + individual_share(size) * max(self.individuals[name] - self.noise[name], 0.0)


def individual_share(size: float) -> float:
    """How far a drive with a scatter of this size counts as an individual, from 0 (mean drive) to 1.

    >>> individual_share(0.1), individual_share(1.0)
    (0.0, 1.0)
    """
    return float(np.clip((size - MEAN_DRIVE_SIZE) / INDIVIDUAL_TRANSITION, 0.0, 1.0))


def cycle_excess(
    problem: Problem, base: Fit, traces: Mapping[str, Sequence[Direction]], seed: int = 0
) -> dict[str, float]:
    """Factor, at least 1, by which scatter between cycles makes the gains of each candidate greater than the weights of
    the blocks expect.

    The mean gain of records that differ by such scatter and by noise, over its number of columns: the factor by which a
    likelihood ratio under working independence is divided (Rotnitzky and Jewell, Biometrika 77, 1990).
    """
    if problem.cycle_scatter is None:
        return dict.fromkeys(problem.candidates, 1.0)
    weights, rng = problem.weights.with_size(0.0), np.random.default_rng(np.random.SeedSequence([seed, 1]))
    noise = np.maximum(problem.block_variance - problem.cycle_scatter.variance, 0.0)
    drawn = problem.cycle_scatter.simulate(N_SIMULATED_CYCLES, rng)
    drawn += np.sqrt(noise)[:, None] * rng.standard_normal(drawn.shape)
    basis = absorbing_basis(weights, base.prediction.sensitivities, base.bounds.prior_deviation)
    residuals = weights.whiten(drawn)
    residuals = residuals - basis @ (basis.T @ residuals)
    found: dict[str, float] = {}
    for name in problem.candidates:
        gains = [
            float(score_gains(direction, weights, basis, residuals)[0].mean()) / direction.columns.shape[1]
            for direction in traces[name]
        ]
        found[name] = max(1.0, *gains)
    return found


def calibrate_thresholds(
    problem: Problem, base: Fit, traces: Mapping[str, Sequence[Direction]], seed: int = 0
) -> Thresholds:
    """Thresholds of a problem's candidates.

    Individuals with this record's noise, which the components of the scatter were not made from, are tested against
    every candidate by score. base: the fit without effects; traces: linearised variants of every candidate.
    """
    excess = cycle_excess(problem, base, traces, seed)
    noise = {
        name: excess[name] * (NOISE_GAIN + NOISE_GAIN_PER_PARAMETER * len(find_effect(name).parameters))
        for name in problem.candidates
    }
    drives = problem.individuals
    if problem.is_mean_drive or not len(drives):
        return Thresholds(noise, noise)
    rng = np.random.default_rng(np.random.SeedSequence([seed, len(drives)]))
    noise_of_drives = rng.standard_normal((len(problem.torque), len(drives)))
    residuals = drives.T + np.sqrt(problem.block_variance)[:, None] * noise_of_drives
    weights = problem.weights.with_likeliest_scatter(residuals, 1.0, 1.0)
    basis = absorbing_basis(weights, base.prediction.sensitivities, base.bounds.prior_deviation)
    residuals = weights.whiten(residuals)
    residuals = residuals - basis @ (basis.T @ residuals)
    null_excess = float((residuals**2).sum(axis=0).max() - problem.expected_chi_square(weights))
    individuals = {}
    for name in problem.candidates:
        greatest = 0.0
        for direction in traces[name]:
            greatest = max(greatest, float(score_gains(direction, weights, basis, residuals)[0].max()))
        margin = KINEMATIC_MARGIN if find_effect(name).place is Place.KINEMATIC else MARGIN
        individuals[name] = max(noise[name], INDIVIDUAL_GAIN, margin * greatest)
    return Thresholds(noise, individuals, NULL_EXCESS_MARGIN * max(0.0, null_excess))
