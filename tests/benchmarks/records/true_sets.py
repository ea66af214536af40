"""Records of individuals of the second generator with their true sets of effects, as benchmarks of the scatter fit
them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reefmu.diagnosis.estimation.least_squares import Fit
from reefmu.diagnosis.estimation.problem import Problem
from reefmu.diagnosis.estimation.weighting import INDIVIDUAL_SIZE, MIN_EIGENVALUE, Weighting, weighting_of_covariance
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem
from reefmu.diagnosis.preprocessing.trace import make_trace
from reefmu.diagnosis.random_effects.scatter import Scatter
from stiffness_model.numerics.arrays import Array
from tests.benchmarks.probabilities.observed_records import second_record
from tests.benchmarks.probabilities.rival_sets import true_fit

FAST = 10.0
"""rad/s, speed of the crank from which a run counts as fast."""


@dataclass(frozen=True)
class TrueSet:
    """problem: of a record; scatter: of its drawing; fit: of its true set of effects; true: parameters of these, SI."""

    problem: Problem
    scatter: Scatter
    fit: Fit
    true: Mapping[str, Mapping[str, float]]

    def weights(self, covariance: Array, least: float = MIN_EIGENVALUE) -> Weighting:
        """Those of a covariance (n, n), (N.m)^2, of the drawing's contacts, at its likeliest size; least: see
        `weighting_of_covariance`."""
        problem, gain = self.problem, self.fit.prediction.contacts.gain
        weights = weighting_of_covariance(problem.variance, covariance * gain * gain[:, None], least)
        weights = weights.with_unknown_forms(problem.base.full_torque)
        return weights.with_likeliest_scatter(problem.torque - self.fit.prediction.torque, INDIVIDUAL_SIZE)

    def fitted(self, scatter: Scatter) -> Fit:
        """The set fitted under another scatter."""
        at, names = self.fit.prediction.contacts, self.fit.names
        beside = self.problem.predictor(names).twist_beside_sensors(self.fit.parameters)
        weights = self.weights(scatter.covariance_at(at.twist, at.clearance, beside))
        return self.problem.fit_from(names, self.fit.parameters, weights)


def true_set(number: int, seed: int) -> TrueSet | None:
    """That of one record; None of a mean drive, where something unnamed or an effect is missing that is no candidate,
    and without tolerances of a drawing."""
    record, drive, truth = second_record(number, seed)
    if truth["foreign"] or not truth["individual"]:
        return None
    source = BaseCurveSource(drive)
    trace = make_trace(record, source.ratio(record))
    problem = prepare_problem(record, trace, source.base_curve(trace))
    if set(truth["names"]) - set(problem.candidates) or not isinstance(problem.scatter, Scatter):
        return None
    true = truth["parameters"]
    return TrueSet(problem, problem.scatter, true_fit(problem, tuple(truth["names"]), true), true)


def left_in_fast_runs(problem: Problem, fit: Fit) -> float:
    """Squares that a fit leaves of fast runs over those expected; 0 without fast runs."""
    return left_in(problem, fit, np.abs(problem.blocks.mean(problem.trace.crank_speed)) > FAST)


def left_in(problem: Problem, fit: Fit, some: NDArray[np.bool_]) -> float:
    """Squares that a fit leaves of some blocks (n,) over those expected; 0 without such blocks."""
    squares = fit.weighting.whiten(problem.torque - fit.prediction.torque) ** 2
    expected = float(problem.expected_squares(fit.weighting)[some].sum())
    return float(squares[some].sum()) / expected if some.any() else 0.0
