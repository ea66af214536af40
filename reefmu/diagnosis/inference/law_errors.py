"""Errors of the laws of the effects in a fit: their torque may be wrong by a few per cent, smoothly over what varies,
and their times, lengths and speeds may be spread.

No friction is exactly constant and no wear exactly in proportion to the travel, and the paths on which they depend are
measured with noise. No creep has one time alone: of a spread of its logarithm by s the effect's torque changes, to
second order, by s^2 / 2 times its second derivative. What has no name must therefore show more than such errors of the
effects beside it.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.polynomial.legendre import legvander
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from ..estimation.least_squares import Fit, is_logarithmic
from ..estimation.problem import Problem, make_weights
from ..estimation.score_test import absorbing_basis, amplitudes
from ..estimation.weighting import Weighting
from .coordinates import over_range, speed_functions, wave

LAW_ERROR = 0.05
"""Standard deviation of the torque of an effect, over that torque, by each of the functions that change it. Chosen
by the calibration of the probabilities, where 0.01, 0.02 and 0.05 are each better than the one before, and 0.1 and 0.2
are the same."""
SPREAD = 0.2
"""Standard deviation of s^2 / 2, where s is the spread of a time, a length or a speed, of either sign, since a law may
also set in more sharply than the model's. The estimates for the creep in 18 records of simulated individuals have a
root mean square of 0.19."""
SPREAD_STEP = 0.3
"""Step of the logarithm for the second derivative; chosen by judgement, well below the spread."""
TORQUE_DEGREE, TIME_DEGREE = 3, 2
"""Degrees of the polynomials over torque and time; chosen by judgement."""
ORDERS = (1, 2)
"""Orders of the crank over which the torque of an effect may vary; chosen by judgement."""


def law_columns(problem: Problem, fit: Fit) -> Array:
    """(n, k) N.m, one standard deviation of each error of the laws of a fit's effects; (n, 0) without effects."""
    torques = _effect_torques(problem, fit)
    factors = _factors(problem, fit.prediction.torque)
    smooth = LAW_ERROR * (torques[:, :, None] * factors[:, None, :]).reshape(len(factors), -1)
    return np.concatenate([smooth, *(SPREAD * column[:, None] for column in _spreads(problem, fit))], axis=1)


def beyond_law_errors(problem: Problem, fit: Fit, residual: Array, errors: Array) -> Array:
    """What the likeliest errors of a fit's laws, of the columns (n, k), N.m, leave of its residual (n,), N.m; its
    parameters follow, to first order."""
    if not errors.shape[1]:
        return residual
    columns = np.concatenate([fit.prediction.sensitivities, errors], axis=1)
    white = fit.weighting.whiten(columns)
    deviations = np.append(fit.bounds.prior_deviation, np.ones(errors.shape[1]))
    norm = np.linalg.norm(white, axis=0)
    size = np.where(norm > 0, norm, 1.0)
    scaled = white / size
    curvature = scaled.T @ scaled + np.diag((1 / (deviations * size)) ** 2)
    found = np.linalg.lstsq(curvature, scaled.T @ fit.weighting.whiten(residual), rcond=None)[0] / size
    return residual - columns @ found


def within_law_errors(problem: Problem, fit: Fit) -> frozenset[str]:
    """The effects of a fit that may be the error of the law of a larger one of their kind, which absorbs its misfit.

    Such an error is small beside the larger effect both as a torque and by what shows of it beside the scatter of
    individuals, in which steady torque hides: a preload is no error of a clearance by temperature that is smaller, and
    wear none of a backlash that shows less.
    """
    groups = [{*find_effect(name).identification.confounding_groups} for name in fit.names]
    alike = [(k, other) for k, own in enumerate(groups) for other, its in enumerate(groups) if k != other and own & its]
    if not alike:
        return frozenset()
    noise = make_weights(problem.variance, None, problem.base.full_torque)
    torques = _effect_torques(problem, fit)
    may_be = _may_be_errors(problem, fit, torques, noise) & _may_be_errors(problem, fit, torques, fit.weighting)
    return frozenset(fit.names[k] for k, other in alike if may_be[k, other])


def _may_be_errors(problem: Problem, fit: Fit, torques: Array, weights: Weighting) -> NDArray[np.bool_]:
    """(e, e), whether an effect of a fit has, beside the base curve and another one, at most two standard deviations of
    the error of that one's law; two effects that nearly cancel each other are larger than what they are in all.

    torques: (n, e) N.m, of the effects; weights: by which they count.
    """
    n_base = problem.layout(()).n_base
    sensitivities, deviations = fit.prediction.sensitivities[:, :n_base], fit.bounds.prior_deviation[:n_base]
    basis = absorbing_basis(weights, sensitivities, deviations)
    white = weights.whiten(torques)
    shown = white - basis @ (basis.T @ white)
    products = shown.T @ shown
    squares = np.diag(products)
    beside = squares[:, None] - products**2 / np.maximum(squares, 1e-300)
    return (squares[:, None] <= squares) & (beside < (2 * LAW_ERROR) ** 2 * squares)


def _effect_torques(problem: Problem, fit: Fit) -> Array:
    """(n, e) N.m, what each effect adds to the torque, to first order."""
    torques = np.zeros((len(problem.torque), len(fit.names)))
    for column, (name, where) in enumerate(problem.layout(fit.names).effects.items()):
        effect = find_effect(name)
        for k in amplitudes(effect):
            size = fit.parameters[where.start + k] - effect.parameters[k].neutral
            torques[:, column] += fit.prediction.sensitivities[:, where.start + k] * size
    return torques


def _spreads(problem: Problem, fit: Fit) -> Iterator[Array]:
    """(n,) N.m, second derivative of a fit's torque by the logarithm of each time, length and speed of its effects."""
    predictor, sensitivities = problem.predictor(fit.names), fit.prediction.sensitivities
    for name, where in problem.layout(fit.names).effects.items():
        for at, parameter in zip(range(where.start, where.stop), find_effect(name).parameters, strict=True):
            if is_logarithmic(parameter):
                moved = fit.parameters.copy()
                moved[at] *= np.exp(SPREAD_STEP)
                there = predictor(moved).sensitivities[:, at] * moved[at]
                yield (there - sensitivities[:, at] * fit.parameters[at]) / SPREAD_STEP


def _factors(problem: Problem, torque: Array) -> Array:
    """(n, k) functions of the torque (n,), N.m, and of what else the record varies."""
    trace, mean = problem.trace, problem.blocks.mean
    size = torque / max(float(np.abs(torque).max(initial=0.0)), 1e-300)
    crank = mean(trace.crank)
    parts: list[Array] = [
        np.asarray(legvander(size, TORQUE_DEGREE)[:, 1:], float),
        np.asarray(legvander(over_range(mean(trace.time)), TIME_DEGREE)[:, 1:], float),
        mean(trace.twist_direction)[:, None],
        speed_functions(mean(trace.twist_rate)),
        speed_functions(mean(trace.output_speed)),
        over_range(mean(trace.temperature))[:, None],
        *(wave(order * crank) for order in ORDERS if np.ptp(crank) > 0),
    ]
    return np.concatenate(parts, axis=1)
