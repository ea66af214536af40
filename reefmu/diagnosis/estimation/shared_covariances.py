"""Costs of several fits, each under whichever of their covariances is likeliest for it.

Every fit of an individual has the scatter of its own contacts, and that of elements at other places on the profile is
likelier or less likely by chance, whatever the effects: steps of single elements fall on blocks or between them. A fit
must gain by its effects and not by such a covariance, which is therefore open to all.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..forward.parameter_layout import N_RIG
from .least_squares import Fit
from .problem import Problem
from .score_test import absorbing_basis
from .weighting import INDIVIDUAL_SIZE, SAME_GAIN, Weighting


def least_costs(problem: Problem, fits: Sequence[Fit], others: Sequence[Fit] = ()) -> list[float]:
    """The least cost of each fit under its own covariance and those of all fits, `others` among them.

    Under another covariance the parameters of the rig and of the base curve follow, to first order, those of effects do
    not; the gain of the scatter by effects stays that of the fit. A covariance at another clearance is that of drives
    whose mean clearance deviates as much, by their tolerances: the cost grows by the square of that deviation over its
    standard deviation. Fits of a mean drive keep their cost: their covariance is the noise.
    """
    sources = {id(fit.weighting.basis): fit for fit in (*fits, *others) if fit.weighting.is_individual}
    known: dict[int, list[tuple[Array, Weighting]]] = {
        key: [(at.prediction.contacts.gain, at.weighting)] for key, at in sources.items()
    }

    def weights_at_gain(key: int, gain: Array) -> Weighting:
        """Those of a source, with the gain of a fit."""
        for at, weights in known[key]:
            if np.abs(gain / at - 1).max() < SAME_GAIN:
                return weights.with_gain(gain / at)
        at, weights = known[key][0]
        known[key].append((gain, weights.with_gain(gain / at)))
        return known[key][-1][1]

    found: list[float] = []
    for fit in fits:
        own = fit.weighting
        foreign = [key for key in sources if own.is_individual and key != id(own.basis)]
        gain = fit.prediction.contacts.gain
        costs = [_cost_under(problem, fit, sources[key], weights_at_gain(key, gain)) for key in foreign]
        found.append(min([fit.cost, *costs]))
    return found


def _cost_under(problem: Problem, fit: Fit, other: Fit, weights: Weighting) -> float:
    """The cost of a fit under the covariance of another one; weights: of that, with the gain of the fit."""
    residual = problem.torque - fit.prediction.torque
    weights = weights.with_likeliest_scatter(residual, INDIVIDUAL_SIZE)
    # A parameter at its bound does not follow: beyond it there is another record.
    own = np.flatnonzero(~fit.at_bound[: N_RIG + problem.base.shape.size])
    basis = absorbing_basis(weights, fit.prediction.sensitivities[:, own], fit.bounds.prior_deviation[own])
    white = weights.whiten(residual)
    of_priors = fit.chi_square - float((fit.weighting.whiten(residual) ** 2).sum())
    left = float(((white - basis @ (basis.T @ white)) ** 2).sum())
    return left + of_priors + cost_of_clearance(problem, fit, other) + weights.log_determinant


def cost_of_clearance(problem: Problem, fit: Fit, other: Fit) -> float:
    """What the covariance of another fit of an individual costs a fit, in -2 log likelihood: the square of the mean
    deviation of the clearance that it takes, over its standard deviation."""
    assert problem.scatter is not None, "without scatter there is one covariance"
    deviation = (
        fit.prediction.contacts.clearance - other.prediction.contacts.clearance
    ) / problem.scatter.mean_clearance_deviation
    return float(np.mean(deviation**2))
