"""Sizes of the named effects with honest 95 % intervals.

A model is never quite of the true form, and the misfit it leaves is alike over a loop: it is no noise that averages
out. Besides what noise and scatter make of the fit's curvature, the covariance is therefore also taken from the misfit
itself, as it adds up over stretches of the record (the sandwich of Huber and White, in clusters: Cameron and Miller,
J. Human Resources 50, 2015), and the wider of the two counts.
"""

from __future__ import annotations

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..forward.effect_functions import kernel
from ..schema import NamedEffect, Value
from .least_squares import Fit
from .overdispersion import stretches
from .problem import Study
from .search import without

FORM = 0.005
"""Standard deviation, as a share of a size, that stems from the form of its law."""


def named_effect(study: Study, fit: Fit, name: str, base: Fit) -> NamedEffect:
    """One effect with its parameters and their 95 % intervals."""
    at = study.layout(fit.names).effects[name].start
    deviation = deviations(study, fit)
    values = {}
    for k, p in enumerate(kernel(name).effect.parameters):
        value = float(fit.parameters[at + k])
        unit = 1.0 if fit.box.logarithmic[at + k] else abs(value) / float(fit.box.scale[at + k])
        # A phase is no size; all else depends on the form of the law, which is nobody's own.
        own = 0.0 if p.name.startswith("phase") else FORM * unit
        z = float(np.hypot(deviation[at + k], own))
        if fit.box.logarithmic[at + k]:
            spread = float(np.exp(min(1.96 * z, 50.0)))
            low, high = value / spread, value * spread
        else:
            half = 1.96 * z * float(fit.box.scale[at + k])
            low, high = value - half, value + half
        low, high = max(low, p.minimum), min(high, p.maximum)
        # A share of none or of all is a result, no bound that stopped the fit.
        warning = "at its bound" if fit.at_bound[at + k] and (p.minimum, p.maximum) != (0.0, 1.0) else ""
        if not warning and high - low > 1.0 * abs(value) and not p.name.startswith("phase"):
            warning = "wide interval"
        values[p.name] = Value(value, low, high, p.unit, warning)
    return NamedEffect(name, values, float(np.clip(_share(study, fit, name, base), 0.0, 1.0)))


def deviations(study: Study, fit: Fit) -> Array:
    """Standard deviations (size,) of the fitted variables, from the noise and from the misfit as it is."""
    scale = np.sqrt(np.maximum(np.diag(fit.curvature), 1e-300))
    correlation = fit.curvature / scale / scale[:, None]
    inverse = np.linalg.pinv(correlation + 1e-10 * np.eye(len(scale)), hermitian=True)
    expected = float((study.block_variance / study.variance).sum())
    misfit = max(1.0, fit.chi_square / expected)
    by_noise = np.maximum(np.diag(inverse), 0.0) * misfit
    residual = fit.weighting.white(study.torque - fit.prediction.torque)
    scores = fit.weighting.white(fit.prediction.sensitivities) * fit.box.slope(fit.parameters) / scale
    cluster = stretches(study)
    sums = np.stack([np.bincount(cluster, column * residual) for column in scores.T], axis=1)
    count = len(sums)
    spread = inverse @ (sums.T @ sums) @ inverse * count / max(count - len(scale), 1)
    return np.sqrt(np.maximum(by_noise, np.diag(spread))) / scale


def _share(study: Study, fit: Fit, name: str, base: Fit) -> float:
    """Part of the initial systematic gap that an effect removes: of what the set removes, by what is missed without it.

    Without one of several effects another may overdo; what is missed then sums up to more than the gap.
    """
    noise = float(np.mean(study.block_variance))
    before = max(float(np.mean((study.torque - base.prediction.torque) ** 2)) - noise, 1e-300)
    full = float(np.mean((study.torque - fit.prediction.torque) ** 2))
    removed = (before - max(full - noise, 0.0)) / before
    missed = {n: max(float(np.mean((study.torque - without(study, fit, n)) ** 2)) - full, 0.0) for n in fit.names}
    return removed * missed[name] / max(sum(missed.values()), 1e-300)
