"""Whether the chosen model explains a record: the p-value of what its fit leaves, by simulation along this record.

Records of drives that are what the model says are simulated with this record's noise and, of an individual, with the
deviations of individuals of the population and those of other forms, which no drawing describes; each is fitted to
first order. The p-value is the share of them whose
whitened sum of squares is at least that of the record (parametric bootstrap; Davison and Hinkley, Bootstrap Methods and
their Application, 1997, section 4.2.3).
"""

from __future__ import annotations

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.score_test import absorbing_basis
from ..estimation.weighting import Weighting
from ..inference.simulated_records import simulate_records

N_RECORDS = 199
"""Records that are simulated: the least p-value is 0.005, and one of 0.05 has a standard error of 0.015."""


def global_p(problem: Problem, fit: Fit, seed: int = 0) -> float:
    """The p-value of a fit, 0.005 ... 1."""
    return p_value(problem, fit, problem.torque - fit.prediction.torque, seed)


def p_value(problem: Problem, fit: Fit, residual: Array, seed: int = 0) -> float:
    """The p-value of a residual (n,), N.m, beside a fit."""
    measured = float(squares_left(fit, residual[:, None])[0])
    return float((1 + (simulated_squares(problem, fit, seed) >= measured).sum()) / (1 + N_RECORDS))


def simulated_squares(problem: Problem, fit: Fit, seed: int = 0) -> Array:
    """(N_RECORDS,) whitened sums of squares of records of drives that are what a fit says."""
    records = simulate_records(problem, N_RECORDS, seed).under(fit.weighting, fit.prediction.contacts.gain)
    return squares_left(fit, records + _unknown_forms(fit.weighting, problem.base.full_torque, seed))


def squares_left(fit: Fit, values: Array) -> Array:
    """(k,) whitened sums of squares of values (n, k), N.m, beside the parameters of a fit."""
    basis = absorbing_basis(fit.weighting, fit.prediction.sensitivities, fit.bounds.prior_deviation)
    white = fit.weighting.whiten(values)
    return ((white - basis @ (basis.T @ white)) ** 2).sum(axis=0)


def _unknown_forms(weighting: Weighting, full_torque: float, seed: int) -> Array:
    """(n, N_RECORDS) N.m, deviations in forms that no drawing describes, of individuals of the population."""
    drawn = weighting.without_unknown_forms(full_torque)
    deviation = weighting.size * np.sqrt(weighting.eigenvalues - drawn.eigenvalues)
    rng = np.random.default_rng(np.random.SeedSequence([seed, N_RECORDS, len(deviation)]))
    sizes = deviation[:, None] * rng.standard_normal((len(deviation), N_RECORDS))
    return (weighting.basis @ sizes) / weighting.scale[:, None]
