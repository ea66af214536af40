"""Bounded nonlinear least squares by the method of Levenberg and Marquardt, with exact sensitivities.

Residuals and sensitivities are whitened by the covariance of noise and scatter, so that the cost is -2 log likelihood
up to a constant; the size of the scatter may be estimated along the way.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...effects import IndependentVariable, Parameter, find_effect
from ..forward.predictor import Prediction, Predictor
from .weighting import Projection, Weighting

MAX_TRIALS = 6
"""Damped steps that are tried from one point before the fit ends. Chosen by judgement."""
MAX_LOG_STEP = 1.5
"""Greatest change of a logarithm in one step: beyond it the linearisation says nothing. Chosen by judgement."""
COST_DIGITS = 2
"""Digits after the point to which costs are compared: fits end where a step changes them by less than 0.001."""
PRIORS = {"missing_ball.size": (1.0, 0.1)}
"""Mean and standard deviation of Gaussian priors, by effect and parameter. A ball is missing or it is present; a tenth
allows for an imperfect contact law and was chosen by judgement."""


@dataclass(frozen=True)
class ParameterBounds:
    """Bounds, scales and Gaussian priors of a parameter vector, (k,) each.

    Lengths, times and speeds are fitted by their logarithm (`logarithmic`), the others in units of `scale`.
    prior_deviation is infinite where nothing is known; prior_mean is then of no effect.
    """

    low: Array
    high: Array
    scale: Array
    logarithmic: NDArray[np.bool_]
    prior_deviation: Array
    prior_mean: Array

    def to_free(self, p: Array) -> Array:
        """Fitted variables (k,) of parameters (k,)."""
        return np.where(self.logarithmic, np.log(np.maximum(p, 1e-300)), p / self.scale)

    def to_parameters(self, z: Array) -> Array:
        """Parameters (k,) of fitted variables (k,), clipped to the bounds."""
        p = np.where(self.logarithmic, np.exp(np.minimum(z, 700.0)), z * self.scale)
        return np.clip(p, self.low, self.high)

    def slope(self, p: Array) -> Array:
        """Derivatives (k,) of the parameters by the fitted variables at parameters (k,)."""
        return np.where(self.logarithmic, p, self.scale)


def is_logarithmic(parameter: Parameter) -> bool:
    """Whether a parameter is strictly positive (a length, a time, a speed) and fitted by its logarithm."""
    return parameter.minimum > 0


def may_be_infinite(parameter: Parameter) -> bool:
    """Whether the neutral value of a time is its upper bound: the process it times then never takes place."""
    return is_logarithmic(parameter) and parameter.neutral == parameter.maximum


def make_bounds(names: tuple[str, ...], base: ParameterBounds) -> ParameterBounds:
    """The bounds of the base parameters followed by those of the effects `names`."""
    declared = [(f"{name}.{p.name}", p) for name in names for p in find_effect(name).parameters]
    parameters = [p for _, p in declared]
    priors = [PRIORS.get(key, (0.0, np.inf)) for key, _ in declared]
    return ParameterBounds(
        np.concatenate([base.low, [p.minimum for p in parameters]]),
        np.concatenate([base.high, [p.maximum for p in parameters]]),
        np.concatenate([base.scale, [p.nominal for p in parameters]]),
        np.concatenate([base.logarithmic, np.array([is_logarithmic(p) for p in parameters], bool)]),
        np.concatenate([base.prior_deviation, [deviation for _, deviation in priors]]),
        np.concatenate([base.prior_mean, [mean for mean, _ in priors]]),
    )


@dataclass(frozen=True)
class Fit:
    """One fitted set of effects.

    names: of the effects; parameters: (k,) in the order zero, base shape, effects; cost: -2 log likelihood up to a
    constant; chi_square: of the whitened residual, with the priors; curvature: (k, k), J^T J of the fitted variables;
    at_bound: (k,), which parameters ended at a bound.
    """

    names: tuple[str, ...]
    parameters: Array
    cost: float
    chi_square: float
    weighting: Weighting
    prediction: Prediction
    curvature: Array
    at_bound: NDArray[np.bool_]
    bounds: ParameterBounds

    @property
    def n_effect_parameters(self) -> int:
        """Number of parameters of the effects."""
        return sum(len(find_effect(name).parameters) for name in self.names)

    @property
    def friction_paths(self) -> frozenset[IndependentVariable]:
        """The angles along which its effects build up friction."""
        return frozenset().union(*(find_effect(name).friction_paths for name in self.names))


@dataclass(frozen=True)
class FitOptions:
    """How far a fit goes.

    steps: at most; tolerance: change of the cost, predicted or achieved, at which it ends; estimate_size: whether the
    size of the scatter is estimated with the parameters or held.
    """

    steps: int = 25
    tolerance: float = 1e-3
    estimate_size: bool = True


def by_cost(found: Fit) -> tuple[float, tuple[str, ...]]:
    """Order of fits, lowest cost first; of sets whose costs differ by rounding alone, the first by its names, whatever
    the last digits are on this machine."""
    return round(found.cost, COST_DIGITS), found.names


HELD_SIZE = FitOptions(estimate_size=False)
"""A full fit under the size of the scatter that is given."""


@dataclass(frozen=True)
class _Point:
    parameters: Array
    prediction: Prediction
    residual: Projection
    chi_square: float


@dataclass(frozen=True)
class _Objective:
    predictor: Predictor
    torque: Array
    bounds: ParameterBounds

    def evaluate(self, p: Array, weights: Weighting, prediction: Prediction | None = None) -> _Point:
        prediction = self.predictor(p) if prediction is None else prediction
        residual = weights.project(self.torque - prediction.torque)
        prior = float((((p - self.bounds.prior_mean) / self.bounds.prior_deviation) ** 2).sum())
        return _Point(p, prediction, residual, float(residual.inner(residual)) + prior)

    def likeliest(self, weights: Weighting, prediction: Prediction) -> Weighting:
        return weights.with_likeliest_scatter(self.torque - prediction.torque)

    def jacobian(self, point: _Point, weights: Weighting) -> Projection:
        return weights.project(point.prediction.sensitivities * self.bounds.slope(point.parameters))


def fit(
    predictor: Predictor,
    torque: Array,
    weights: Weighting,
    bounds: ParameterBounds,
    start: Array,
    options: FitOptions | None = None,
) -> Fit:
    """Fit all parameters of a predictor to measured torque (n,), N.m, from `start` (k,)."""
    options = options or FitOptions()
    objective = _Objective(predictor, torque, bounds)
    p = np.clip(start, bounds.low, bounds.high)
    prediction = predictor(p)
    if options.estimate_size:
        weights = objective.likeliest(weights, prediction)
    point = objective.evaluate(p, weights, prediction)
    damping = 1e-3
    jacobian = objective.jacobian(point, weights)
    for _ in range(options.steps):
        better, damping = _improve(objective, point, weights, jacobian, damping, options.tolerance)
        if better is None:
            break
        gain = point.chi_square - better.chi_square
        point = better
        if options.estimate_size:
            resized = objective.likeliest(weights, point.prediction)
            if resized.size != weights.size:
                weights = resized
                point = objective.evaluate(point.parameters, weights, point.prediction)
                gain = np.inf
        jacobian = objective.jacobian(point, weights)
        if gain < options.tolerance:
            break
    _, curvature = normal_equations(jacobian, point.residual, point.parameters, bounds)
    return Fit(
        predictor.names,
        point.parameters,
        point.chi_square + weights.log_determinant,
        point.chi_square,
        weights,
        point.prediction,
        curvature,
        _at_bound(point.parameters, bounds),
        bounds,
    )


def _improve(
    objective: _Objective, point: _Point, weights: Weighting, jacobian: Projection, damping: float, tolerance: float
) -> tuple[_Point | None, float]:
    """The next point, None where no step reduces the cost by more than the tolerance, and the next damping."""
    p, bounds = point.parameters, objective.bounds
    gradient, curvature = normal_equations(jacobian, point.residual, p, bounds)
    # A parameter at its bound that the gradient pushes against it is held.
    held = ((p <= bounds.low) & (gradient < 0)) | ((p >= bounds.high) & (gradient > 0))
    free = np.flatnonzero(~held & (np.diag(curvature) > 0))
    if not free.size:
        return None, damping
    inner = curvature[np.ix_(free, free)]
    diagonal = np.diag(inner)
    for _ in range(MAX_TRIALS):
        step = np.zeros(len(p))
        step[free] = np.linalg.solve(inner + np.diag(damping * diagonal + 1e-12 * diagonal.max()), gradient[free])
        step = np.where(bounds.logarithmic, np.clip(step, -MAX_LOG_STEP, MAX_LOG_STEP), step)
        if float(gradient @ step) < tolerance:
            break  # the linearisation predicts no reduction worth a step
        candidate = objective.evaluate(bounds.to_parameters(bounds.to_free(p) + step), weights)
        if candidate.chi_square < point.chi_square:
            return candidate, max(damping / 10, 1e-9)
        damping = max(damping * 8, 1e-4)
    return None, damping


def normal_equations(
    jacobian: Projection, residual: Projection, p: Array, bounds: ParameterBounds
) -> tuple[Array, Array]:
    """Gradient (k,) and curvature (k, k) of half the cost, with the priors; jacobian: by the fitted variables of p."""
    prior_slope = bounds.slope(p) / bounds.prior_deviation
    gradient = jacobian.inner(residual) - prior_slope * (p - bounds.prior_mean) / bounds.prior_deviation
    return gradient, jacobian.inner(jacobian) + np.diag(prior_slope**2)


def _at_bound(p: Array, bounds: ParameterBounds) -> NDArray[np.bool_]:
    margin = 1e-6 * np.where(np.isfinite(bounds.high - bounds.low), bounds.high - bounds.low, 1.0)
    return (p <= bounds.low + np.minimum(margin, 1e-6 * bounds.scale)) | (p >= bounds.high - margin)
