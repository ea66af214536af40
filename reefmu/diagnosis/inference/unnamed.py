"""Effects and something unnamed that are fitted beside each other."""

from __future__ import annotations

from dataclasses import replace

from ..estimation.least_squares import HELD_SIZE, Fit, fit
from ..estimation.problem import Problem
from ..estimation.weighting import INDIVIDUAL_SIZE
from .nonparametric import TermFit, fit_terms


def fit_beside_term(problem: Problem, found: Fit) -> tuple[Fit, TermFit]:
    """The set of effects of a fit and the nonparametric term that gains most, each fitted beside the other.

    A large term distorts the parameters of a fit that does not know it, and widens its scatter. The cost of the fit is
    that of the whole residual, of which the term is a part. Without a gain the fit is as it was; a mean drive remains
    one.
    """
    beside = fit_terms(problem, found)[0]
    if beside.gain <= 0:
        return found, beside
    own = _fit_without(problem, found, beside)
    again = fit_terms(problem, own)[0]
    return (own, again) if own.cost - again.gain < found.cost - beside.gain else (found, beside)


def _fit_without(problem: Problem, found: Fit, beside: TermFit) -> Fit:
    """The set of effects of a fit, fitted to the torque without a term, with the cost of the whole residual."""
    rest, options = problem.torque - beside.torque, HELD_SIZE if found.weighting.size < INDIVIDUAL_SIZE else None
    own = fit(problem.predictor(found.names), rest, found.weighting, found.bounds, found.parameters, options)
    left, whiten = rest - own.prediction.torque, own.weighting.whiten
    added = float((whiten(left + beside.torque) ** 2).sum() - (whiten(left) ** 2).sum())
    return replace(own, cost=own.cost + added, chi_square=own.chi_square + added)
