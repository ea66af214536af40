"""Parameters of the named effects with 95 % confidence intervals.

A model never has quite the true form, and the misfit it leaves is correlated over a loop: it does not average out like
noise. Two covariances of the parameters are therefore computed, one from the curvature of the fit and one from the
misfit itself, summed over segments of the record (the cluster-robust sandwich estimator: Cameron and Miller, J. Human
Resources 50, 2015), and the wider interval counts.
"""

from __future__ import annotations

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from ..schema import NamedEffect, Value
from .least_squares import Fit
from .problem import Problem
from .residuals import segments, torque_without

FORM_UNCERTAINTY = 0.005
"""Standard deviation of a parameter, over its value, due to the form of the effect's law. Chosen by judgement."""
NORMAL_QUANTILE = 1.96
"""Quantile of the normal distribution for 95 % confidence."""


def named_effect(problem: Problem, fit: Fit, name: str, base: Fit) -> NamedEffect:
    """One effect of a fit with its parameters, their confidence intervals and its share of the initial gap."""
    at = problem.layout(fit.names).effects[name].start
    errors = standard_errors(problem, fit)
    values = {}
    for k, p in enumerate(find_effect(name).parameters):
        value = float(fit.parameters[at + k])
        unit = 1.0 if fit.bounds.logarithmic[at + k] else abs(value) / float(fit.bounds.scale[at + k])
        # The form of the law affects every parameter but a phase, which is no size.
        form = 0.0 if p.name.startswith("phase") else FORM_UNCERTAINTY * unit
        error = float(np.hypot(errors[at + k], form))
        if fit.bounds.logarithmic[at + k]:
            spread = float(np.exp(min(NORMAL_QUANTILE * error, 50.0)))
            low, high = value / spread, value * spread
        else:
            half = NORMAL_QUANTILE * error * float(fit.bounds.scale[at + k])
            low, high = value - half, value + half
        low, high = max(low, p.minimum), min(high, p.maximum)
        # A share of 0 or 1 is a result, not a bound that stopped the fit.
        warning = "at its bound" if fit.at_bound[at + k] and (p.minimum, p.maximum) != (0.0, 1.0) else ""
        if not warning and high - low > 1.0 * abs(value) and not p.name.startswith("phase"):
            warning = "wide interval"
        values[p.name] = Value(value, low, high, p.unit, warning)
    return NamedEffect(name, values, float(np.clip(_share(problem, fit, name, base), 0.0, 1.0)))


def standard_errors(problem: Problem, fit: Fit) -> Array:
    """(k,) standard errors of the fitted variables, the greater of curvature and sandwich estimates."""
    scale = np.sqrt(np.maximum(np.diag(fit.curvature), 1e-300))
    correlation = fit.curvature / scale / scale[:, None]
    inverse = np.linalg.pinv(correlation + 1e-10 * np.eye(len(scale)), hermitian=True)
    expected = float((problem.block_variance / problem.variance).sum())
    misfit = max(1.0, fit.chi_square / expected)
    by_curvature = np.maximum(np.diag(inverse), 0.0) * misfit
    residual = fit.weighting.whiten(problem.torque - fit.prediction.torque)
    scores = fit.weighting.whiten(fit.prediction.sensitivities) * fit.bounds.slope(fit.parameters) / scale
    cluster = segments(problem)
    sums = np.stack([np.bincount(cluster, column * residual) for column in scores.T], axis=1)
    count = len(sums)
    sandwich = inverse @ (sums.T @ sums) @ inverse * count / max(count - len(scale), 1)
    return np.sqrt(np.maximum(by_curvature, np.diag(sandwich))) / scale


def _share(problem: Problem, fit: Fit, name: str, base: Fit) -> float:
    """Share of the initial systematic mean square that an effect removes.

    What the set removes is divided among its effects by the residual without each of them: without one effect another
    may overcompensate, and those residuals add up to more than the gap.
    """
    noise = float(np.mean(problem.block_variance))
    before = max(float(np.mean((problem.torque - base.prediction.torque) ** 2)) - noise, 1e-300)
    full = float(np.mean((problem.torque - fit.prediction.torque) ** 2))
    removed = (before - max(full - noise, 0.0)) / before
    missed = {
        n: max(float(np.mean((problem.torque - torque_without(problem, fit, n)) ** 2)) - full, 0.0) for n in fit.names
    }
    return removed * missed[name] / max(sum(missed.values()), 1e-300)
