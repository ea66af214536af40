"""How far tolerances let the curve of torque over twist deviate: that of a mean drive whose parts are all off alike,
and the modulus that would make the same deviation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import EFFECTS, Place, ToleranceSignature
from ..estimation.intervals import NORMAL_QUANTILE, standard_errors
from ..estimation.least_squares import HELD_SIZE, Fit
from ..estimation.problem import Problem
from ..estimation.residuals import torque_without
from ..estimation.weighting import SCATTER_SIZES, Weighting, make_weighting
from ..random_effects.curve_columns import curve_columns

CURVE_EFFECTS = frozenset(
    e.name
    for e in EFFECTS.values()
    if e.identification.tolerance_signature is ToleranceSignature.CURVE and e.place is not Place.SENSOR
)
"""Effects that change the drive's own curve alone, as its tolerances do."""
MODULUS = "modulus_error"
"""The effect by whose size a deviation of the curve is told."""
MOST_DEVIATIONS = 2.576
"""Standard deviations within which 99 % of a normal population are: what a tolerance may still explain."""


@dataclass(frozen=True)
class CurveDeviation:
    """By what the curve of a drive deviates from that of its drawing: a modulus that is off, or its tolerances.

    rms: N.m; modulus_error: that would make it; population: standard deviation of that error over individual drives.
    """

    rms: float
    modulus_error: float
    population: float


def weights_of_curve_within_tolerance(problem: Problem, torque: Array) -> Weighting | None:
    """Weights of a mean drive whose curve as a whole is off, by as much as the curves of individual drives differ; None
    where no drawing states tolerances. torque: (n,) N.m, of the base curve."""
    if problem.scatter is None or not len(problem.individuals):
        return None
    individuals = problem.individuals
    curves = curve_columns(torque, individuals.T @ individuals / len(individuals))
    # The mean drive has the least scatter, by which all random effects are multiplied.
    random_effects = np.concatenate([curves / SCATTER_SIZES[0], problem.weights.components])
    return make_weighting(problem.variance, random_effects).for_mean_drive()


def curve_deviation(problem: Problem, fit: Fit) -> CurveDeviation | None:
    """The deviation of the curve beside the other effects of a fit; None where the record shows none, where it is
    beyond 99 % of individual drives, where no drawing states tolerances, and where another effect of the fit changes
    the curve."""
    if MODULUS not in problem.candidates or not len(problem.individuals) or CURVE_EFFECTS & set(fit.names) - {MODULUS}:
        return None
    found = fit if MODULUS in fit.names else _with_modulus(problem, fit)
    at = problem.layout(found.names).effects[MODULUS].start
    if abs(found.bounds.to_free(found.parameters)[at]) < NORMAL_QUANTILE * standard_errors(problem, found)[at]:
        return None
    change, error = found.prediction.torque - torque_without(problem, found, [MODULUS]), float(found.parameters[at])
    deviations = population_deviations(problem, found, change)
    if deviations > MOST_DEVIATIONS:
        return None
    return CurveDeviation(float(np.sqrt(np.mean(change**2))), error, abs(error) / deviations)


def _with_modulus(problem: Problem, fit: Fit) -> Fit:
    """The fit with a modulus error beside its effects, where no scatter takes a part of it."""
    start = np.append(fit.parameters, 0.0)
    return problem.fit_from((*fit.names, MODULUS), start, problem.weights.for_mean_drive(), HELD_SIZE)


def population_deviations(problem: Problem, fit: Fit, change: Array) -> float:
    """Size of a torque change (n,), N.m, in standard deviations of the population in the direction of that change.

    Where an effect is only a few deviations large, a misfit of some per cent in the scatter would decide about it. The
    twist's zero, which is free, does not count. Infinite where no drawing states tolerances.
    """
    if not len(problem.individuals):
        return float("inf")
    scale = 1 / np.sqrt(problem.variance)
    zero = fit.prediction.sensitivities[:, 0] * scale
    zero = zero / max(float(np.linalg.norm(zero)), 1e-300)
    along = change * scale
    along = along - zero * float(zero @ along)
    size = float(along @ along)
    # Individuals deviate from the mean drive's curve also where the elements' passing is the same for all of them.
    deviation = float(np.sqrt(np.mean((problem.individuals @ (along * scale)) ** 2)))
    return size / max(deviation, 1e-300)
