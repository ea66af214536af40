"""Costs of several fits, each under whichever of their covariances is likeliest for it.

Every fit of an individual has the scatter of its own contacts, and that of elements at other places on the profile is
likelier or less likely by chance, whatever the effects: steps of single elements fall on blocks or between them. A fit
must gain by its effects and not by such a covariance, which is therefore open to all.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..forward.parameter_layout import N_RIG
from .least_squares import Fit
from .problem import Problem
from .score_test import absorbing_basis
from .weighting import INDIVIDUAL_SIZE, Weighting, are_gains_alike


@dataclass(frozen=True)
class _Covariance:
    """The covariance of a fit of an individual; known: what it is at several gains of the scatter."""

    source: Fit
    known: list[tuple[Array, Weighting]]

    def is_that_of(self, fit: Fit) -> bool:
        """Whether another fit has it, with its own gain."""
        return self.source.weighting.basis is fit.weighting.basis and are_gains_alike(_gain(fit), self.known[0][0])

    def with_gain_of(self, fit: Fit) -> Weighting:
        """What it would be for a drive with the effects of another fit."""
        wanted, (first, own) = _gain(fit), self.known[0]
        for gain, weights in self.known:
            if are_gains_alike(wanted, gain):
                return weights.with_gain(wanted / gain)
        self.known.append((wanted, own.with_gain(wanted / first)))
        return self.known[-1][1]


def _gain(fit: Fit) -> Array:
    return fit.prediction.contacts.gain


def least_costs(problem: Problem, fits: Sequence[Fit], others: Sequence[Fit] = ()) -> list[float]:
    """The least cost of each fit under its own covariance and those of all fits, `others` among them.

    Of several fits under one covariance it is that at the contacts of the set of fewest effects, which the others
    extend. Under another covariance the parameters of the rig and of the base curve follow, to first order, those of
    effects do not; the gain of the scatter by effects stays that of the fit. A covariance at another clearance is that
    of drives whose mean clearance deviates as much, by their tolerances: the cost grows by the square of that deviation
    over its standard deviation. Fits of a mean drive keep their cost: their covariance is the noise.
    """
    covariances: dict[int, _Covariance] = {}
    for fit in sorted((*others, *fits), key=lambda fit: len(fit.names)):
        if fit.weighting.is_individual:
            covariances.setdefault(id(fit.weighting.basis), _Covariance(fit, [(_gain(fit), fit.weighting)]))
    return [
        min(fit.cost if known.is_that_of(fit) else _cost_under(problem, fit, known) for known in covariances.values())
        if fit.weighting.is_individual
        else fit.cost
        for fit in fits
    ]


def _cost_under(problem: Problem, fit: Fit, covariance: _Covariance) -> float:
    """The cost of a fit under the covariance of another one."""
    residual = problem.torque - fit.prediction.torque
    weights = covariance.with_gain_of(fit).with_likeliest_scatter(residual, INDIVIDUAL_SIZE)
    # A parameter at its bound does not follow: beyond it there is another record.
    own = np.flatnonzero(~fit.at_bound[: N_RIG + problem.base.shape.size])
    basis = absorbing_basis(weights, fit.prediction.sensitivities[:, own], fit.bounds.prior_deviation[own])
    white = weights.whiten(residual)
    of_priors = fit.chi_square - float((fit.weighting.whiten(residual) ** 2).sum())
    left = float(((white - basis @ (basis.T @ white)) ** 2).sum())
    return left + of_priors + cost_of_clearance(problem, fit, covariance.source) + weights.log_determinant


def cost_of_clearance(problem: Problem, fit: Fit, other: Fit) -> float:
    """What the covariance of another fit of an individual costs a fit, in -2 log likelihood: the square of the mean
    deviation of the clearance that it takes, over its standard deviation."""
    assert problem.scatter is not None, "without scatter there is one covariance"
    beside = fit.prediction.contacts.clearance - other.prediction.contacts.clearance
    return float(np.mean((beside / problem.scatter.mean_clearance_deviation) ** 2))
