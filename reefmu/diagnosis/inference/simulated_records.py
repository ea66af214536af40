"""Records without any effect, simulated along this one: its noise, scatter between cycles, and individual drives."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..estimation.least_squares import Fit, fit
from ..estimation.problem import Problem
from ..estimation.weighting import INDIVIDUAL_SIZE, Weighting
from ..estimation.worker_pool import WorkerPool
from .unnamed import gain_by_level, strongest_term, typical_samples

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

    def under(self, weighting: Weighting, gain: Array | float = 1.0) -> Array:
        """(n, m) N.m, the records of drives that scatter as widely as a weighting says; gain: (n,), see `Contacts`."""
        if not self.drives.size:
            return self.noise
        return self.noise + weighting.size * (self.drives.T * gain).T


def simulate_records(problem: Problem, count: int, seed: int) -> SimulatedRecords:
    """`count` records along that of a problem."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, count]))
    noise, drives = simulate_noise(problem, count, rng), problem.individuals
    if not len(drives):
        return SimulatedRecords(noise, np.zeros((len(noise), 0)))
    drawn = drives[rng.integers(len(drives), size=count)].T
    return SimulatedRecords(noise, drawn / problem.weights.with_likeliest_scatter(drawn + noise, INDIVIDUAL_SIZE).size)


def gain_by_chance(pool: WorkerPool, base: Fit, records: SimulatedRecords, size: float) -> float:
    """Greatest gain in -2 log likelihood of anything unnamed along some records, each beside the base curve and
    the scatter that fit it best.

    base: fit without effects; size: of the scatter of the simulated drives, 1 for individuals as drawn.
    """
    drawn = records.under(base.weighting.with_size(size)).T
    return max([0.0, *pool.map(_gain, [(base.prediction.torque + record, base.parameters) for record in drawn])])


def _gain(problem: Problem, job: tuple[Array, Array]) -> float:
    """`gain_by_chance` of one record: its torque (n,), N.m, and the parameters from which a fit without effects
    starts."""
    torque, start = job
    found = fit(problem.predictor(()), torque, problem.weights, problem.bounds(()), start)
    residual = torque - found.prediction.torque
    return strongest_term(problem, found, residual).gain - gain_by_level(problem, found, residual)


def simulate_noise(problem: Problem, count: int, rng: np.random.Generator) -> Array:
    """(n, count) N.m, block means of the noise of `count` records, with scatter between cycles where there is one.

    Each record has one of the autocorrelations that the noise of this one allows, by its probability, and a level that
    deviates by the standard error of the estimate.
    """
    samples = typical_samples(problem)
    known, n = problem.noise.correlation, len(problem.torque)
    drawn = known.draw_of_means(samples, n, count, rng) / known.of_means(samples, 1)
    # That of a variance from so many means, halved for its root and doubled because differences of cycles gave it.
    independent = known.independent_means(samples, problem.noise.samples)
    level = np.exp(rng.standard_normal(count) / np.sqrt(independent))
    series = _stationary(drawn, rng) * level
    if problem.cycle_scatter is None:
        return np.sqrt(problem.block_variance)[:, None] * series
    variance = np.maximum(problem.block_variance - problem.cycle_scatter.variance, 0.0)
    return np.sqrt(variance)[:, None] * series + problem.cycle_scatter.simulate(count, rng)


def _stationary(covariance: Array, rng: np.random.Generator) -> Array:
    """(n, k) Gaussian series with autocovariances (n, k), by circulant embedding (Dietrich and Newsam, Fast and Exact
    Simulation of Stationary Gaussian Processes through Circulant Embedding of the Covariance Matrix, 1997)."""
    circle = np.concatenate([covariance, covariance[-2:0:-1]])
    amplitude = np.sqrt(np.fft.fft(circle, axis=0).real.clip(0.0) / len(circle))
    white = rng.standard_normal((2, *circle.shape))
    return np.fft.fft(amplitude * (white[0] + 1j * white[1]), axis=0)[: len(covariance)].real
