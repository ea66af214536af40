"""Marginal likelihood of a fitted set of effects: the likelihood averaged over the prior of the effects' parameters.

Laplace's approximation (Kass and Raftery, Bayes Factors, Journal of the American Statistical Association 90, 1995,
section 4.1): the prior density at the estimate times the volume in which the likelihood is large. Parameters of the
base curve are in every set; they only enter through what they have in common with the effects.
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from scipy.special import logsumexp

from stiffness_model.numerics.arrays import Array

from ...effects import Parameter, find_effect
from ..calibrated_odds import PRIOR_WIDTH
from ..estimation.least_squares import PRIORS, Fit, is_logarithmic
from ..estimation.problem import Problem
from ..estimation.score_test import absorbing_basis, linearise
from ..inference.law_errors import within_law_errors

LOGARITHMIC_RANGE = 2 * math.log(10.0)
"""Range of the logarithm of a time, length or speed that is as likely as any: two decades, chosen by judgement, or that
between its bounds."""
LARGEST_FAINT, N_FAINT = 1e3, 300
"""Largest amplitude of an effect that the record hardly shows, in typical sizes, and the number of those that are
tried, in steps of a thirtieth; the prior leaves less than a thousandth beyond."""
SINGULAR = 1e-9
"""Curvature, over the mean of the diagonal, that is added where the base curve's parameters have none: rounding."""


def log_volume(problem: Problem, fit: Fit, sizes: Mapping[str, float], dispersion: float) -> float:
    """Logarithm of the prior probability of the parameters that the record leaves possible; 0 without effects.

    sizes: typical ones, SI, by `effect.parameter`; dispersion: variance of the residual over that of the weights.
    Amplitudes have Cauchy priors about their neutral value, cut there where they have one sign; phases and logarithms
    of lengths, times and speeds are uniform.
    """
    if not fit.names:
        return 0.0
    n_base = problem.layout(()).n_base
    log_prior, precision = 0.0, np.zeros(len(fit.parameters))
    for name, where in problem.layout(fit.names).effects.items():
        for at, parameter in zip(range(where.start, where.stop), find_effect(name).parameters, strict=True):
            unit = float(fit.bounds.scale[at])
            size = PRIOR_WIDTH * (sizes.get(f"{name}.{parameter.name}") or unit)
            density, precision[at] = parameter_prior(parameter, float(fit.parameters[at]), size, unit)
            log_prior += density
    curvature = fit.curvature / dispersion + np.diag(precision)
    base = np.arange(n_base)
    curvature[base, base] += SINGULAR * float(np.trace(curvature)) / len(curvature)
    beside_base = _log_determinant(curvature) - _log_determinant(curvature[:n_base, :n_base])
    n_effect_parameters = len(fit.parameters) - n_base
    return log_prior + 0.5 * (n_effect_parameters * math.log(2 * math.pi) - beside_base)


def log_evidence_of_faint(
    problem: Problem, fit: Fit, name: str, sizes: Mapping[str, float], least: float, dispersion: float
) -> float:
    """Log marginal likelihood of one more effect beside a fit, over that of the fit, to first order: for effects that
    the record hardly shows.

    least: smallest amplitude that counts, in typical sizes. All variants of phases, lengths, times and speeds are as
    likely. The priors of several amplitudes are Gaussian, with the density at zero of those of `log_volume`.
    """
    weights, parameters = fit.weighting, find_effect(name).parameters
    basis = absorbing_basis(weights, fit.prediction.sensitivities, fit.bounds.prior_deviation)
    residual = weights.whiten(problem.torque - fit.prediction.torque)
    found: list[float] = []
    for direction in linearise(problem, name, fit):
        typical = [sizes.get(f"{name}.{parameters[k].name}") or parameters[k].nominal for k in direction.sizes]
        white = weights.whiten(direction.columns * np.tile(typical, 2 if direction.paired else 1))
        free = white - basis @ (basis.T @ white)
        score, information = free.T @ residual / dispersion, free.T @ free / dispersion
        if len(typical) == 1 and not direction.paired:
            x, log_weight = _amplitudes(name, parameters[direction.sizes[0]], typical[0], least, direction.one_sided)
            found.append(float(logsumexp(score[0] * x - information[0, 0] * x**2 / 2 + log_weight)))
        else:
            precision = 2 / (math.pi * PRIOR_WIDTH) if direction.paired else 2 / (math.pi * PRIOR_WIDTH**2)
            inside = information + precision * np.eye(len(score))
            log_width = _log_determinant(inside / precision)
            found.append(0.5 * float(score @ np.linalg.solve(inside, score)) - 0.5 * log_width)
    return float(logsumexp(found)) - math.log(len(found))


def _amplitudes(name: str, parameter: Parameter, size: float, least: float, one_sided: bool) -> tuple[Array, Array]:
    """Amplitudes over a typical size, from the least that counts, and the logarithm of each one's prior probability."""
    ends = np.geomspace(least, LARGEST_FAINT, N_FAINT + 1)
    x, step = np.sqrt(ends[1:] * ends[:-1]), np.diff(ends)
    if (key := f"{name}.{parameter.name}") in PRIORS:
        mean, deviation = (value / size for value in PRIORS[key])
        return x, -0.5 * ((x - mean) / deviation) ** 2 - math.log(deviation * math.sqrt(2 * math.pi)) + np.log(step)
    log = np.log(step) - np.log(math.pi * PRIOR_WIDTH * (1 + (x / PRIOR_WIDTH) ** 2))
    return (x, log + math.log(2.0)) if one_sided else (np.concatenate([-x, x]), np.concatenate([log, log]))


def material_effects(problem: Problem, fit: Fit, sizes: Mapping[str, float], least: float) -> frozenset[str]:
    """The effects of a fit without those that may be the error of another one's law, and those that change what the
    tolerances of every drive change as well and have no amplitude of at least `least` typical sizes."""
    found: set[str] = set()
    for name, values in problem.layout(fit.names).by_effect(fit.parameters).items():
        effect = find_effect(name)
        scaled = [
            abs(values[p.name] - p.neutral) / sizes[f"{name}.{p.name}"]
            for p in effect.parameters
            if sizes.get(f"{name}.{p.name}", 0.0) > 0
        ]
        if effect.identification.tolerance_signature is None or not scaled or max(scaled) >= least:
            found.add(name)
    return frozenset(found) - within_law_errors(problem, fit)


def parameter_prior(parameter: Parameter, value: float, size: float, unit: float) -> tuple[float, float]:
    """Log density at a value, and precision, of a parameter's prior in the units in which it is fitted.

    size: half-width of an amplitude; unit: in which it is fitted.
    """
    if is_logarithmic(parameter):
        extent = min(LOGARITHMIC_RANGE, math.log(parameter.maximum / parameter.minimum))
        return -math.log(extent), 12 / extent**2
    if (extent := _bounded_extent(parameter)) is not None:
        return -math.log(extent / unit), 12 * (unit / extent) ** 2
    width = size / unit
    log_density = -math.log(math.pi * width * (1 + ((value - parameter.neutral) / size) ** 2))
    has_one_sign = parameter.minimum >= parameter.neutral or parameter.maximum <= parameter.neutral
    return log_density + (math.log(2.0) if has_one_sign else 0.0), 1 / width**2


def _bounded_extent(parameter: Parameter) -> float | None:
    """Range of a phase or of the wind-up's share, None for an amplitude."""
    if parameter.name.startswith("phase"):
        return 2 * math.pi
    return 1.0 if parameter.name == "windup" else None


def _log_determinant(matrix: Array) -> float:
    return float(np.linalg.slogdet(matrix)[1])
