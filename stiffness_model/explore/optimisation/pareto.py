"""Which designs are feasible, which of them no other dominates, and which of those is chosen."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...numerics.arrays import Array
from ..definition.metrics import METRICS
from ..definition.study import BEST, SENSES, Limit, Study
from ..evaluation.evaluate import Evaluations, Outcome, relative_violation

NOT_SIMULATED = 10.0
"""Violation on top of the rest for a design without metrics: every simulated one ranks before it."""


def minimised_objectives(study: Study, found: Evaluations) -> Array:
    """(n, n_objectives), the objectives turned so that less is better."""
    return np.column_stack([SENSES[sense] * found.column(name) for name, sense in study.objectives.items()])


def violations(study: Study, found: Evaluations) -> Array:
    """(n,), 0 for feasible designs: the sum of the excesses over the limits, as shares of the limits."""
    total = np.where(found.outcome == Outcome.SIMULATED, 0.0, NOT_SIMULATED * (1.0 + found.outcome))
    for limit in study.limits:
        column = found.column(limit.metric)
        total += [0.0 if np.isnan(value) else relative_violation(limit, float(value)) for value in column]
    return total


def non_dominated(values: ArrayLike) -> NDArray[np.bool_]:
    """Which rows of (n, k) no other row dominates: none is as small everywhere and smaller somewhere.

    Equal rows do not dominate each other. Rows with NaN are never in the front.

    >>> non_dominated([[1, 4], [2, 2], [3, 3], [4, 1]]).tolist()
    [True, True, False, True]
    """
    rows = np.asarray(values, float)
    alive = np.flatnonzero(~np.isnan(rows).any(axis=1))
    # By the sum, a row can only be dominated by one before it (or, where rounding makes sums equal, beside it).
    alive = alive[np.argsort(rows[alive].sum(axis=1), kind="stable")]
    k = 0
    while k < len(alive):
        pivot, rest = rows[alive[k]], rows[alive]
        kept = np.logical_not((pivot <= rest).all(axis=1) & (pivot < rest).any(axis=1))
        # What stays before the pivot tells where the next one is.
        alive, k = alive[kept], int(kept[:k].sum()) + 1
    front = np.zeros(len(rows), bool)
    front[alive] = True
    return front


def front(study: Study, found: Evaluations) -> NDArray[np.intp]:
    """Indices of the feasible designs that no other feasible one dominates, along the first objective.

    Of designs alike in all objectives (an optimiser may ask for one twice) the first stays.
    """
    values = minimised_objectives(study, found)
    feasible = np.flatnonzero(violations(study, found) == 0)
    best = feasible[non_dominated(values[feasible])]
    # np.unique sorts the rows, by the first objective first.
    _, first = np.unique(values[best], axis=0, return_index=True)
    return best[first]


def choose(study: Study, found: Evaluations, members: NDArray[np.intp]) -> int | None:
    """The member that [choose] asks for; None if the front is empty or none keeps within the rule's limits.

    "knee": scaled by the front's range, with 0 the best, the member farthest below the plane through the
    front's extremes, where the sum of the scaled objectives is least (Das, Structural Optimization 18, 1999,
    for two objectives). "best": least (or greatest) in one objective.
    """
    rule = study.choice
    allowed = np.array([k for k in members if all(_within(limit, found, int(k)) for limit in rule.limits)], np.intp)
    if not len(allowed):
        return None
    values = minimised_objectives(study, found)
    if rule.rule == BEST:
        score = values[allowed, list(study.objectives).index(rule.objective)]
    else:
        low, high = values[members].min(axis=0), values[members].max(axis=0)
        score = ((values[allowed] - low) / np.where(high > low, high - low, 1.0)).sum(axis=1)
    return int(allowed[int(np.argmin(score))])


def _within(limit: Limit, found: Evaluations, design: int) -> bool:
    return relative_violation(limit, float(found.metrics[design, list(METRICS).index(limit.metric)])) == 0
