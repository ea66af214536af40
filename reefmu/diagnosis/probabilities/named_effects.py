"""The named effects: their parameters with 95 % intervals, and the part of the gap that each removes."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import Parameter, find_effect
from ..estimation.intervals import bound_reached, interval_errors, one_sided_limit
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import torque_without
from ..fitted_values import NamedEffect, Value
from .averaged_intervals import Rival, averaged_interval


def named_effects(problem: Problem, fit: Fit, base: Fit, rivals: Sequence[Rival] = ()) -> list[NamedEffect]:
    """The effects of a fit with their parameters, 95 % intervals and shares of the initial gap.

    rivals: other explanations of the record, which the intervals count.
    """
    errors = interval_errors(problem, fit)
    return [_named_effect(problem, fit, name, base, errors, rivals) for name in fit.names]


def _named_effect(
    problem: Problem, fit: Fit, name: str, base: Fit, errors: Array, rivals: Sequence[Rival]
) -> NamedEffect:
    where, effect = problem.layout(fit.names).effects[name], find_effect(name)
    variables = fit.bounds.to_free(fit.parameters)
    lows, highs, own_errors = variables.copy(), variables.copy(), errors.copy()
    for k, p in enumerate(effect.parameters):
        at, is_phase = where.start + k, p.name.startswith("phase")
        # The form of the law affects every parameter but a phase, which is no size.
        size = 1.0 if fit.bounds.logarithmic[at] else abs(variables[at])
        form = 0.0 if is_phase else effect.identification.form_uncertainty * size
        own_errors[at] = np.hypot(errors[at], form)
        # Phases that differ by a turn are the same, so that their average says nothing.
        others = () if is_phase else rivals
        lows[at], highs[at] = averaged_interval(float(variables[at]), float(own_errors[at]), others, name, k)
    ends = np.stack([fit.bounds.to_parameters(lows), fit.bounds.to_parameters(highs)], axis=1)[where]
    values = {
        p.name: _value(fit, where.start + k, p, float(own_errors[where.start + k]), *ends[k].tolist())
        for k, p in enumerate(effect.parameters)
    }
    return NamedEffect(name, values, float(np.clip(_share(problem, fit, name, base), 0.0, 1.0)))


def _value(fit: Fit, at: int, parameter: Parameter, error: float, low: float, high: float) -> Value:
    """A parameter with its interval, one-sided where the fit stopped at a bound. error: of the fitted variable."""
    value, bound = float(fit.parameters[at]), bound_reached(fit, at, parameter)
    if bound:
        limit = one_sided_limit(fit, at, error, bound)
        low, high = (value, limit) if bound == "low" else (limit, value)
        return Value(value, low, high, parameter.unit, "at its bound", bound)
    is_wide = high - low > 1.0 * abs(value) and not parameter.name.startswith("phase")
    return Value(value, low, high, parameter.unit, "wide interval" if is_wide else "")


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
        n: max(float(np.mean((problem.torque - torque_without(problem, fit, [n])) ** 2)) - full, 0.0) for n in fit.names
    }
    return removed * missed[name] / max(sum(missed.values()), 1e-300)
