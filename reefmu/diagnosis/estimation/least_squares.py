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
class Box:
    """Scales and bounds of a parameter vector. Lengths, times and speeds are fitted by their logarithm."""

    low: Array
    high: Array
    scale: Array
    logarithmic: NDArray[np.bool_]
    prior: Array
    """Standard deviation of each parameter about `centre`; infinite where nothing is known."""
    centre: Array

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


def never(parameter: Parameter) -> bool:
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
    box: Box


def box_of(
    names: tuple[str, ...], base_low: Array, base_high: Array, base_scale: Array, base_prior: Array, base_centre: Array
) -> Box:
    """The box of base parameters and the effects' own."""
    parameters = [p for effect in effects_of(names) for p in effect.parameters]
    known = {"missing_ball.size": (1.0, 0.1)}
    names_of = [f"{effect.name}.{p.name}" for effect in effects_of(names) for p in effect.parameters]
    # A ball is out or it is not: half a dip is something else.
    centre = [known.get(name, (0.0, np.inf))[0] for name in names_of]
    prior = [known.get(name, (0.0, np.inf))[1] for name in names_of]
    return Box(
        np.concatenate([base_low, [p.minimum for p in parameters]]),
        np.concatenate([base_high, [p.maximum for p in parameters]]),
        np.concatenate([base_scale, [p.nominal for p in parameters]]),
        np.concatenate([np.zeros(len(base_low), bool), np.array([is_logarithmic(p) for p in parameters], bool)]),
        np.concatenate([base_prior, prior]),
        np.concatenate([base_centre, centre]),
    )


def fit(
    predictor: Predictor,
    torque: Array,
    weights: Weighting,
    box: Box,
    start: Array,
    steps: int = 25,
    tolerance: float = 1e-3,
    refit_size: bool = True,
) -> Fit:
    """Fit all parameters of a predictor from `start` (size,) to measured torque (n,), N.m.

    tolerance: change of the cost, seen or promised by the slope, at which it ends. refit_size: let the size of the
    scatter follow.
    """
    p = np.clip(start, box.low, box.high)
    prediction = predictor(p)
    if refit_size:
        weights = weights.best_size(torque - prediction.torque)
    residual = weights.white(torque - prediction.torque)
    chi = float(residual @ residual) + _prior_cost(p, box)
    damping = 1e-3
    jacobian = weights.white(prediction.sensitivities) * box.slope(p)
    for _ in range(steps):
        gradient, curvature = _with_prior(jacobian, residual, p, box)
        # A parameter at its bound and pushed against it stays.
        held = ((p <= box.low) & (gradient < 0)) | ((p >= box.high) & (gradient > 0))
        free = np.flatnonzero(~held & (np.diag(curvature) > 0))
        if not free.size:
            break
        better: tuple[Array, Prediction, Array, float] | None = None
        for _ in range(6):
            inner = curvature[np.ix_(free, free)]
            diagonal = np.diag(inner)
            step = np.zeros(len(p))
            step[free] = np.linalg.solve(inner + np.diag(damping * diagonal + 1e-12 * diagonal.max()), gradient[free])
            step = np.where(box.logarithmic, np.clip(step, -1.5, 1.5), step)
            if float(gradient @ step) < tolerance:
                break  # as much as this step promises is nothing
            trial = box.to_parameters(box.to_free(p) + step)
            new = predictor(trial)
            new_residual = weights.white(torque - new.torque)
            new_chi = float(new_residual @ new_residual) + _prior_cost(trial, box)
            if new_chi < chi:
                better = trial, new, new_residual, new_chi
                break
            damping = max(damping * 8, 1e-4)
        if better is None:
            break
        gain = chi - better[3]
        p, prediction, residual, chi = better
        damping = max(damping / 10, 1e-9)
        if refit_size:
            resized = weights.best_size(torque - prediction.torque)
            if resized.size != weights.size:
                weights = resized
                residual = weights.white(torque - prediction.torque)
                chi = float(residual @ residual) + _prior_cost(p, box)
                gain = np.inf
        jacobian = weights.white(prediction.sensitivities) * box.slope(p)
        if gain < tolerance:
            break
    _, curvature = _with_prior(jacobian, residual, p, box)
    margin = 1e-6 * np.where(np.isfinite(box.high - box.low), box.high - box.low, 1.0)
    at_bound = (p <= box.low + np.minimum(margin, 1e-6 * box.scale)) | (p >= box.high - margin)
    return Fit(predictor.names, p, chi + weights.log_determinant, chi, weights, prediction, curvature, at_bound, box)


def _prior_cost(p: Array, box: Box) -> float:
    return float((((p - box.centre) / box.prior) ** 2).sum())


def _with_prior(jacobian: Array, residual: Array, p: Array, box: Box) -> tuple[Array, Array]:
    pull = box.slope(p) / box.prior
    gradient = jacobian.T @ residual - pull * (p - box.centre) / box.prior
    return gradient, jacobian.T @ jacobian + np.diag(pull**2)
