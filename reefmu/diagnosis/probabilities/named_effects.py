"""The named effects: their parameters with 95 % intervals, and the part of the gap that each removes."""

from __future__ import annotations

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from ..estimation.intervals import FORM_UNCERTAINTY, NORMAL_QUANTILE, bound_reached, interval_errors, one_sided_limit
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import torque_without
from ..fitted_values import NamedEffect, Value


def named_effects(problem: Problem, fit: Fit, base: Fit) -> list[NamedEffect]:
    """The effects of a fit with their parameters, confidence intervals and shares of the initial gap."""
    errors = interval_errors(problem, fit)
    return [_named_effect(problem, fit, name, base, errors) for name in fit.names]


def _named_effect(problem: Problem, fit: Fit, name: str, base: Fit, errors: Array) -> NamedEffect:
    at = problem.layout(fit.names).effects[name].start
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
        bound = bound_reached(fit, at + k, p)
        if bound:
            limit = one_sided_limit(fit, at + k, error, bound)
            low, high = (value, limit) if bound == "low" else (limit, value)
        warning = "at its bound" if bound else ""
        if not warning and high - low > 1.0 * abs(value) and not p.name.startswith("phase"):
            warning = "wide interval"
        values[p.name] = Value(value, low, high, p.unit, warning, bound)
    return NamedEffect(name, values, float(np.clip(_share(problem, fit, name, base), 0.0, 1.0)))


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
