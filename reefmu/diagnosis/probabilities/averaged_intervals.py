"""Intervals of parameters that count which other effects could have been named.

Beside other effects a parameter has another estimate. Given a record, its distribution is the average over the
explanations that contain it, with their probabilities as weights (Hoeting, Madigan, Raftery, Volinsky, Bayesian Model
Averaging: A Tutorial, Statistical Science 14, 1999). Each explanation contributes a normal distribution of the fitted
variable.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import brentq
from scipy.special import ndtr

from stiffness_model.numerics.arrays import Array

from ..estimation.intervals import CONFIDENCE, NORMAL_QUANTILE, standard_errors
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..hypotheses import Hypothesis
from .hypothesis_table import Row

LEAST_ODDS = 1e-3
"""Odds of an explanation, to the chosen one, below which it hardly moves an end of a 95 % interval: each tail of that
has 0.025."""
REACH = 10.0
"""Standard errors around the centres within which the ends of an interval are sought: a normal distribution has nothing
beyond them."""
ERRORS = (1e-12, 1e6)
"""Range of standard errors of fitted variables, which are logarithms or in nominal sizes: beyond it a parameter is
exact, or not determined at all, and its interval is the range of the parameter."""


@dataclass(frozen=True)
class Rival:
    """Another explanation of a record. odds: of it to the chosen one; at: position of the first parameter of
    each of its effects; variables, errors: (k,) fitted variables with their standard errors."""

    odds: float
    at: dict[str, int]
    variables: Array
    errors: Array


def rivals_of(problem: Problem, chosen: Fit, rows: Sequence[Row], hypotheses: Sequence[Hypothesis]) -> list[Rival]:
    """The explanations of the rows of a table that share effects with the chosen one and are not negligible beside it.

    hypotheses: of the rows, with their probabilities.
    """
    if not chosen.names:
        return []
    own = sum(h.probability for h in hypotheses if set(h.effects) == set(chosen.names))
    found: list[Rival] = []
    for row, hypothesis in zip(rows, hypotheses, strict=True):
        odds = hypothesis.probability / own
        if row.effects != frozenset(chosen.names) and row.effects & set(chosen.names) and odds > LEAST_ODDS:
            fit = row.fit
            at = {name: problem.layout(fit.names).effects[name].start for name in row.effects & set(fit.names)}
            found.append(Rival(odds, at, fit.bounds.to_free(fit.parameters), standard_errors(problem, fit)))
    return found


def averaged_interval(
    variable: float, error: float, rivals: Sequence[Rival], effect: str, index: int
) -> tuple[float, float]:
    """Ends of the 95 % interval of the fitted variable of parameter `index` of an effect.

    variable, error: of the chosen explanation, whose own interval is inside, since its estimate is what is reported;
    rivals: explanations without the effect say nothing of it.

    >>> low, high = averaged_interval(2.0, 0.1, [], "hysteresis", 0)
    >>> round(low, 3), round(high, 3)
    (1.804, 2.196)
    """
    parts = [(1.0, variable, error)]
    for rival in rivals:
        if effect in rival.at:
            k = rival.at[effect] + index
            parts.append((rival.odds, float(rival.variables[k]), float(rival.errors[k])))
    low, high = mixture_interval(*np.transpose(parts))
    half = NORMAL_QUANTILE * error
    return min(low, variable - half), max(high, variable + half)


def mixture_interval(weights: Array, centres: Array, errors: Array) -> tuple[float, float]:
    """95 % interval with equal tails of a mixture of normal distributions; weights: (n,), of any sum.

    >>> low, high = mixture_interval(np.ones(2), np.array([0.0, 10.0]), np.ones(2))
    >>> round(low, 3), round(high, 3)
    (-1.645, 11.645)
    """
    share, tail, errors = weights / weights.sum(), (1 - CONFIDENCE) / 2, np.clip(errors, *ERRORS)
    ends = float((centres - REACH * errors).min()), float((centres + REACH * errors).max())

    def quantile(probability: float) -> float:
        root: Any = brentq(lambda x: float(share @ ndtr((x - centres) / errors)) - probability, *ends)
        return float(root)

    return quantile(tail), quantile(1 - tail)
