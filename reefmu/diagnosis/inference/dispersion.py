"""By how much evidence exceeds what the covariance of a record allows: its dispersion.

Gains in -2 log likelihood are divided by what even the likeliest explanation leaves beyond noise and scatter.
"""

from __future__ import annotations

from collections.abc import Sequence

from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.residuals import estimate_overdispersion
from .nonparametric import TermFit


def dispersion(problem: Problem, explanations: Sequence[tuple[Fit, TermFit | None]]) -> float:
    """Variance of the residual over that of the weights, at least 1: what the likeliest explanation leaves in all over
    what it should (Pearson's estimate: McCullagh and Nelder, Generalized Linear Models, 1989, section 4.5), or what any
    leaves everywhere, where noise is larger or slower than estimated, whichever is more.

    explanations: fits with or without a nonparametric term beside.
    """

    def explained(beside: TermFit | None) -> float:
        return max(0.0, beside.gain) if beside else 0.0

    fit, beside = min(explanations, key=lambda e: e[0].cost - explained(e[1]))
    in_all = (fit.chi_square - explained(beside)) / problem.expected_chi_square(fit.weighting)
    everywhere = min(
        estimate_overdispersion(problem, one, problem.torque - one.prediction.torque - (term.torque if term else 0))
        for one, term in explanations
    )
    return max(in_all, everywhere)
