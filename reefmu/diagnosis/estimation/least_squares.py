"""Least squares with bounds by Levenberg and Marquardt, on exact sensitivities and whitened residuals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ...effects import Parameter
from ..forward.predictor import Prediction, Predictor, effects_of
from .weighting import Weighting


@dataclass(frozen=True)
class ParameterBounds:
    """Scales and bounds of a parameter vector. Lengths, times and speeds are fitted by their logarithm."""

    low: Array
    high: Array
    scale: Array
    logarithmic: NDArray[np.bool_]
    prior_deviation: Array
    """Standard deviation of each parameter about `prior_mean`; infinite where nothing is known."""
    prior_mean: Array

    def to_free(self, p: Array) -> Array:
        """Fitted variables of parameters."""
        return np.where(self.logarithmic, np.log(np.maximum(p, 1e-300)), p / self.scale)

    def to_parameters(self, z: Array) -> Array:
        """Parameters of fitted variables, within the bounds."""
        p = np.where(self.logarithmic, np.exp(np.minimum(z, 700.0)), z * self.scale)
        return np.clip(p, self.low, self.high)

    def slope(self, p: Array) -> Array:
        """d parameter / d fitted variable."""
        return np.where(self.logarithmic, p, self.scale)


def is_logarithmic(parameter: Parameter) -> bool:
    """Whether a parameter can only be positive: a length, a time, a speed."""
    return parameter.minimum > 0


def may_be_infinite(parameter: Parameter) -> bool:
    """Whether a time may be so long that what it times never comes: its greatest value is where it starts."""
    return is_logarithmic(parameter) and parameter.neutral == parameter.maximum


@dataclass(frozen=True)
class Fit:
    """One fitted set: names, parameters (size,) in the order zero, base shape, effects; cost: -2 log likelihood
    less a constant; chi_square: of the whitened residual; curvature: (size, size) J^T J in free variables.
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


def make_bounds(
    names: tuple[str, ...], base_low: Array, base_high: Array, base_scale: Array, base_prior: Array, base_centre: Array
) -> ParameterBounds:
    """The bounds of base parameters and the effects' own."""
    parameters = [p for effect in effects_of(names) for p in effect.parameters]
    known = {"missing_ball.size": (1.0, 0.1)}
    names_of = [f"{effect.name}.{p.name}" for effect in effects_of(names) for p in effect.parameters]
    # A ball is out or it is not: half a dip is something else.
    prior_mean = [known.get(name, (0.0, np.inf))[0] for name in names_of]
    prior_deviation = [known.get(name, (0.0, np.inf))[1] for name in names_of]
    return ParameterBounds(
        np.concatenate([base_low, [p.minimum for p in parameters]]),
        np.concatenate([base_high, [p.maximum for p in parameters]]),
        np.concatenate([base_scale, [p.nominal for p in parameters]]),
        np.concatenate([np.zeros(len(base_low), bool), np.array([is_logarithmic(p) for p in parameters], bool)]),
        np.concatenate([base_prior, prior_deviation]),
        np.concatenate([base_centre, prior_mean]),
    )


def fit(
    predictor: Predictor,
    torque: Array,
    weights: Weighting,
    bounds: ParameterBounds,
    start: Array,
    steps: int = 25,
    tolerance: float = 1e-3,
    refit_size: bool = True,
) -> Fit:
    """Fit all parameters of a predictor from `start` (size,) to measured torque (n,), N.m.

    tolerance: change of the cost, seen or promised by the slope, at which it ends. refit_size: let the size of the
    scatter follow.
    """
    p = np.clip(start, bounds.low, bounds.high)
    prediction = predictor(p)
    if refit_size:
        weights = weights.with_likeliest_size(torque - prediction.torque)
    residual = weights.whiten(torque - prediction.torque)
    chi_square = float(residual @ residual) + _prior_cost(p, bounds)
    damping = 1e-3
    jacobian = weights.whiten(prediction.sensitivities) * bounds.slope(p)
    for _ in range(steps):
        gradient, curvature = _normal_equations(jacobian, residual, p, bounds)
        # A parameter at its bound and pushed against it stays.
        held = ((p <= bounds.low) & (gradient < 0)) | ((p >= bounds.high) & (gradient > 0))
        free = np.flatnonzero(~held & (np.diag(curvature) > 0))
        if not free.size:
            break
        better: tuple[Array, Prediction, Array, float] | None = None
        for _ in range(6):
            inner = curvature[np.ix_(free, free)]
            diagonal = np.diag(inner)
            step = np.zeros(len(p))
            step[free] = np.linalg.solve(inner + np.diag(damping * diagonal + 1e-12 * diagonal.max()), gradient[free])
            step = np.where(bounds.logarithmic, np.clip(step, -1.5, 1.5), step)
            if float(gradient @ step) < tolerance:
                break  # as much as this step promises is nothing
            candidate = bounds.to_parameters(bounds.to_free(p) + step)
            new = predictor(candidate)
            new_residual = weights.whiten(torque - new.torque)
            new_chi_square = float(new_residual @ new_residual) + _prior_cost(candidate, bounds)
            if new_chi_square < chi_square:
                better = candidate, new, new_residual, new_chi_square
                break
            damping = max(damping * 8, 1e-4)
        if better is None:
            break
        gain = chi_square - better[3]
        p, prediction, residual, chi_square = better
        damping = max(damping / 10, 1e-9)
        if refit_size:
            resized = weights.with_likeliest_size(torque - prediction.torque)
            if resized.size != weights.size:
                weights = resized
                residual = weights.whiten(torque - prediction.torque)
                chi_square = float(residual @ residual) + _prior_cost(p, bounds)
                gain = np.inf
        jacobian = weights.whiten(prediction.sensitivities) * bounds.slope(p)
        if gain < tolerance:
            break
    _, curvature = _normal_equations(jacobian, residual, p, bounds)
    margin = 1e-6 * np.where(np.isfinite(bounds.high - bounds.low), bounds.high - bounds.low, 1.0)
    at_bound = (p <= bounds.low + np.minimum(margin, 1e-6 * bounds.scale)) | (p >= bounds.high - margin)
    return Fit(
        predictor.names,
        p,
        chi_square + weights.log_determinant,
        chi_square,
        weights,
        prediction,
        curvature,
        at_bound,
        bounds,
    )


def _prior_cost(p: Array, bounds: ParameterBounds) -> float:
    return float((((p - bounds.prior_mean) / bounds.prior_deviation) ** 2).sum())


def _normal_equations(jacobian: Array, residual: Array, p: Array, bounds: ParameterBounds) -> tuple[Array, Array]:
    prior_slope = bounds.slope(p) / bounds.prior_deviation
    gradient = jacobian.T @ residual - prior_slope * (p - bounds.prior_mean) / bounds.prior_deviation
    return gradient, jacobian.T @ jacobian + np.diag(prior_slope**2)
