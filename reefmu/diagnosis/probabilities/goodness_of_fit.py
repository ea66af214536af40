"""Whether the chosen model explains a record: the p-value of what its fit leaves, by simulation along this record.

Records of drives that are what the model says are simulated with this record's noise and, of an individual, with the
deviations of individuals of the population; each is fitted to first order. The p-value is the share of them whose
whitened sum of squares is at least that of the record (parametric bootstrap; Davison and Hinkley, Bootstrap Methods and
their Application, 1997, section 4.2.3).
"""

from __future__ import annotations

import numpy as np
from scipy.signal import lfilter

from stiffness_model.numerics.arrays import Array

from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.score_test import absorbing_basis
from ..estimation.weighting import INDIVIDUAL_SIZE, Weighting

N_RECORDS = 199
"""Records that are simulated: the least p-value is 0.005, and one of 0.05 has a standard error of 0.015."""


def global_p(problem: Problem, fit: Fit, seed: int = 0) -> float:
    """The p-value of a fit, 0.005 ... 1."""
    return p_value(problem, fit, problem.torque - fit.prediction.torque, seed)


def p_value(problem: Problem, fit: Fit, residual: Array, seed: int = 0) -> float:
    """The p-value of a residual (n,), N.m, beside a fit."""
    basis = absorbing_basis(fit.weighting, fit.prediction.sensitivities, fit.bounds.prior_deviation)
    records = simulate_records(problem, fit.weighting, N_RECORDS, seed)
    measured = float(_left(fit.weighting, basis, residual[:, None])[0])
    return float((1 + (_left(fit.weighting, basis, records) >= measured).sum()) / (1 + N_RECORDS))


def simulate_records(problem: Problem, weighting: Weighting, count: int, seed: int) -> Array:
    """(n, count) N.m, residuals of records of drives that are what the model says: noise, and deviations of individuals
    of the population, as much larger than theirs as the scatter of the weighting is."""
    rng = np.random.default_rng(np.random.SeedSequence([seed, count]))
    noise, drives = simulate_noise(problem, count, rng), problem.individuals
    if problem.is_mean_drive or not len(drives):
        return noise
    drawn = drives[rng.integers(len(drives), size=count)].T
    usual = problem.weights.with_likeliest_scatter(drawn + noise, INDIVIDUAL_SIZE).size
    return noise + weighting.size / usual * drawn


def _left(weighting: Weighting, basis: Array, values: Array) -> Array:
    """(k,) whitened sums of squares of values (n, k), N.m, beside parameters with a basis (n, p)."""
    white = weighting.whiten(values)
    return ((white - basis @ (basis.T @ white)) ** 2).sum(axis=0)


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
