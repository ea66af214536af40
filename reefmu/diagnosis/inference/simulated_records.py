"""Records without any effect, simulated along this one: its noise, scatter between cycles, and individual drives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from stiffness_model.numerics.arrays import Array

from ..estimation.least_squares import Fit, fit
from ..estimation.problem import Problem
from ..estimation.weighting import INDIVIDUAL_SIZE, Weighting
from .unnamed import strongest_term

N_WITH_TERMS = 8
"""Simulated records to which nonparametric terms are fitted. Chosen by judgement to bound the time."""


@dataclass(frozen=True)
class SimulatedRecords:
    """Residuals of m records of drives that are what the model says.

    noise: (n, m) N.m; drives: (n, m) N.m, deviations of individuals of the population from the mean drive for a scatter
    of size 1 as a weighting measures it, (n, 0) where no drawing states tolerances.
    """

    noise: Array
    drives: Array

    def under(self, weighting: Weighting) -> Array:
        """(n, m) N.m, the records of drives that scatter as widely as a weighting says."""
        return self.noise + weighting.size * self.drives if self.drives.size else self.noise


def simulate_records(problem: Problem, count: int, seed: int) -> SimulatedRecords:
    """`count` records along that of a problem."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, count]))
    noise, drives = simulate_noise(problem, count, rng), problem.individuals
    if not len(drives):
        return SimulatedRecords(noise, np.zeros((len(noise), 0)))
    drawn = drives[rng.integers(len(drives), size=count)].T
    return SimulatedRecords(noise, drawn / problem.weights.with_likeliest_scatter(drawn + noise, INDIVIDUAL_SIZE).size)


def gain_by_chance(problem: Problem, base: Fit, records: SimulatedRecords, size: float) -> float:
    """Greatest gain in -2 log likelihood of anything unnamed along some records, each beside the base curve and
    the scatter that fit it best.

    base: fit without effects; size: of the scatter of the simulated drives, 1 for individuals as drawn.
    """
    gains = [0.0]
    for record in records.under(base.weighting.with_size(size)).T:
        torque = base.prediction.torque + record
        found = fit(problem.predictor(()), torque, problem.weights, problem.bounds(()), base.parameters)
        gains.append(strongest_term(problem, found, torque - found.prediction.torque).gain)
    return max(gains)


def simulate_noise(problem: Problem, count: int, rng: np.random.Generator) -> Array:
    """(n, count) N.m, block means of the noise of `count` records, with scatter between cycles where there is one.

    The noise of the blocks is a first-order autoregression with the correlation time that was estimated; the level of
    each record deviates by the standard error of that estimate.
    """
    noise = problem.noise
    per_sample = (noise.correlation_time - 1) / (noise.correlation_time + 1)
    rho = per_sample ** float(np.median(problem.blocks.count))
    white = rng.standard_normal((len(problem.torque), count))
    white[0] /= np.sqrt(1 - rho**2)
    series = np.asarray(lfilter([np.sqrt(1 - rho**2)], [1.0, -rho], white, axis=0))
    level = np.exp(np.sqrt(noise.correlation_time / len(problem.trace)) * rng.standard_normal(count))
    if problem.cycle_scatter is None:
        return np.sqrt(problem.block_variance)[:, None] * series * level
    variance = np.maximum(problem.block_variance - problem.cycle_scatter.variance, 0.0)
    return np.sqrt(variance)[:, None] * series * level + problem.cycle_scatter.simulate(count, rng)
