"""Sizes of the named effects with honest 95 % intervals.

A model is never quite of the true form, and the misfit it leaves is alike over a loop: it is no noise that averages
out. Besides what noise and scatter make of the fit's curvature, the covariance is therefore also taken from the misfit
itself, as it adds up over stretches of the record (the sandwich of Huber and White, in clusters: Cameron and Miller,
J. Human Resources 50, 2015), and the wider of the two counts.
"""

from __future__ import annotations

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from ..schema import NamedEffect, Value
from .least_squares import Fit
from .overdispersion import segments
from .problem import Problem
from .search import torque_without

FORM_UNCERTAINTY = 0.005
"""Standard deviation, as a share of a size, that stems from the form of its law."""


def named_effect(problem: Problem, fit: Fit, name: str, base: Fit) -> NamedEffect:
    """One effect with its parameters and their 95 % intervals."""
    at = problem.layout(fit.names).effects[name].start
    deviation = standard_errors(problem, fit)
    values = {}
    for k, p in enumerate(find_effect(name).parameters):
        value = float(fit.parameters[at + k])
        unit = 1.0 if fit.bounds.logarithmic[at + k] else abs(value) / float(fit.bounds.scale[at + k])
        # A phase is no size; all else depends on the form of the law, which is nobody's own.
        own = 0.0 if p.name.startswith("phase") else FORM_UNCERTAINTY * unit
        z = float(np.hypot(deviation[at + k], own))
        if fit.bounds.logarithmic[at + k]:
            spread = float(np.exp(min(1.96 * z, 50.0)))
            low, high = value / spread, value * spread
        else:
            half = 1.96 * z * float(fit.bounds.scale[at + k])
            low, high = value - half, value + half
        low, high = max(low, p.minimum), min(high, p.maximum)
        # A share of none or of all is a result, no bound that stopped the fit.
        warning = "at its bound" if fit.at_bound[at + k] and (p.minimum, p.maximum) != (0.0, 1.0) else ""
        if not warning and high - low > 1.0 * abs(value) and not p.name.startswith("phase"):
            warning = "wide interval"
        values[p.name] = Value(value, low, high, p.unit, warning)
    return NamedEffect(name, values, float(np.clip(_share(problem, fit, name, base), 0.0, 1.0)))


def standard_errors(problem: Problem, fit: Fit) -> Array:
    """Standard deviations (size,) of the fitted variables, from the noise and from the misfit as it is."""
    scale = np.sqrt(np.maximum(np.diag(fit.curvature), 1e-300))
    correlation = fit.curvature / scale / scale[:, None]
    inverse = np.linalg.pinv(correlation + 1e-10 * np.eye(len(scale)), hermitian=True)
    expected = float((problem.block_variance / problem.variance).sum())
    misfit = max(1.0, fit.chi_square / expected)
    by_noise = np.maximum(np.diag(inverse), 0.0) * misfit
    residual = fit.weighting.whiten(problem.torque - fit.prediction.torque)
    scores = fit.weighting.whiten(fit.prediction.sensitivities) * fit.bounds.slope(fit.parameters) / scale
    cluster = segments(problem)
    sums = np.stack([np.bincount(cluster, column * residual) for column in scores.T], axis=1)
    count = len(sums)
    spread = inverse @ (sums.T @ sums) @ inverse * count / max(count - len(scale), 1)
    return np.sqrt(np.maximum(by_noise, np.diag(spread))) / scale


def _share(problem: Problem, fit: Fit, name: str, base: Fit) -> float:
    """Part of the initial systematic gap that an effect removes: of what the set removes, by what is missed without it.

    Without one of several effects another may overdo; what is missed then sums up to more than the gap.
    """
    noise = float(np.mean(problem.block_variance))
    before = max(float(np.mean((problem.torque - base.prediction.torque) ** 2)) - noise, 1e-300)
    full = float(np.mean((problem.torque - fit.prediction.torque) ** 2))
    removed = (before - max(full - noise, 0.0)) / before
    missed = {
        n: max(float(np.mean((problem.torque - torque_without(problem, fit, n)) ** 2)) - full, 0.0) for n in fit.names
    }
    return removed * missed[name] / max(sum(missed.values()), 1e-300)
