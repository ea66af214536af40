"""Whether a smooth deviation of the curve of torque over twist is one that individual drives of the population have."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import EFFECTS, Place, ToleranceSignature
from ..estimation.intervals import NORMAL_QUANTILE, standard_errors
from ..estimation.least_squares import HELD_SIZE, Fit
from ..estimation.problem import Problem
from ..estimation.residuals import torque_without
from ..estimation.score_test import absorbing_basis
from .nonparametric import TermFit

CURVE_EFFECTS = frozenset(
    e.name
    for e in EFFECTS.values()
    if e.identification.tolerance_signature is ToleranceSignature.CURVE and e.place is not Place.SENSOR
)
"""Effects that change the drive's own curve alone, as its tolerances do."""
MAX_CURVE_DEVIATIONS = 1.8
"""Standard deviations of the population within which a deviation of the curve counts as tolerance: a scale at the limit
of its tolerance together with a change of curvature reaches 1.6."""
MAX_EVEN_SHARE = 0.1
"""Mean square of the even part of a curve, over that of the odd part, up to which tolerances make it, unless it is
noise; tolerances act alike on both flanks. Chosen by judgement."""
SIGNIFICANT_GAIN = 30.0
"""Gain in -2 log likelihood that noise does not reach: simulated records without effects stay below 7."""
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


def tolerances_in(problem: Problem, fit: Fit, beside: Array | float = 0.0) -> Iterator[frozenset[str]]:
    """Effects of a fit that together do no more to the curve than tolerances; beside: (n,) N.m, by which the curve
    deviates as well."""
    own = CURVE_EFFECTS & set(fit.names)
    for names in itertools.chain.from_iterable(itertools.combinations(sorted(own), k + 1) for k in range(len(own))):
        change = fit.prediction.torque - torque_without(problem, fit, names) + beside
        if population_deviations(problem, fit, change) < MAX_CURVE_DEVIATIONS:
            yield frozenset(names)


def is_within_tolerances(problem: Problem, fit: Fit, curve: TermFit) -> bool:
    """Whether a curve over the torque is as small, and as odd, as those of individuals of the population."""
    torque, part = problem.torque, curve.torque
    order = np.argsort(torque)
    mirrored = np.interp(-torque, torque[order], part[order])
    inside = (-torque > torque.min()) & (-torque < torque.max())
    if not len(problem.individuals) or not inside.any():
        return False
    even = np.where(inside, (part + mirrored) / 2, 0.0)
    even_share = float(np.mean(even[inside] ** 2)) / max(float(np.mean((part - even)[inside] ** 2)), 1e-300)
    seen = fit.weighting.whiten(even)
    basis = absorbing_basis(fit.weighting, fit.prediction.sensitivities, fit.bounds.prior_deviation)
    seen = seen - basis @ (basis.T @ seen)
    is_odd = even_share < MAX_EVEN_SHARE or float((seen**2).sum()) < SIGNIFICANT_GAIN
    return is_odd and population_deviations(problem, fit, part) < MAX_CURVE_DEVIATIONS


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
