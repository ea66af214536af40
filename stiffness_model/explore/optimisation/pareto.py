"""Feasible designs, the Pareto front among them, and the chosen member of the front."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...numerics.arrays import Array
from ..definition.metrics import METRICS
from ..definition.study import BEST, SENSES, Limit, Study
from ..evaluation.evaluate import Evaluations, Outcome, relative_violation

NOT_SIMULATED = 10.0
"""Violation added for a design that was not simulated: simulated ones rank before it unless they exceed their limits by
more than ten times the limits. Chosen by judgement."""


def minimised_objectives(study: Study, found: Evaluations) -> Array:
    """The objectives, (n, n_objectives), with the sign for which less is better."""
    return np.column_stack([SENSES[sense] * found.column(name) for name, sense in study.objectives.items()])


def violations(study: Study, found: Evaluations) -> Array:
    """The sum of the relative violations of all limits, (n,); 0 for feasible designs."""
    total = np.where(found.outcome == Outcome.SIMULATED, 0.0, NOT_SIMULATED * (1.0 + found.outcome))
    for limit in study.limits:
        column = found.column(limit.metric)
        total += [0.0 if np.isnan(value) else relative_violation(limit, float(value)) for value in column]
    return total


def non_dominated(values: ArrayLike) -> NDArray[np.bool_]:
    """Which rows of (n, k) no other row dominates, that is, is nowhere greater and somewhere smaller.

    Equal rows do not dominate each other. Rows with NaN are never in the front.

    >>> non_dominated([[1, 4], [2, 2], [3, 3], [4, 1]]).tolist()
    [True, True, False, True]
    """
    rows = np.asarray(values, float)
    alive = np.flatnonzero(~np.isnan(rows).any(axis=1))
    # Sorted by their sums, a row is dominated only by one before it (or of the same sum, by rounding).
    alive = alive[np.argsort(rows[alive].sum(axis=1), kind="stable")]
    k = 0
    while k < len(alive):
        pivot, others = rows[alive[k]], rows[alive]
        kept = np.logical_not((pivot <= others).all(axis=1) & (pivot < others).any(axis=1))
        # The rows that remain before the pivot give the position of the next one.
        alive, k = alive[kept], int(kept[:k].sum()) + 1
    front = np.zeros(len(rows), bool)
    front[alive] = True
    return front


def front(study: Study, found: Evaluations) -> NDArray[np.intp]:
    """Indices of the feasible designs that no other feasible one dominates, along the first objective.

    Of several designs with the same objectives (an optimiser may ask for one twice) the first is a member.
    """
    values = minimised_objectives(study, found)
    feasible = np.flatnonzero(violations(study, found) == 0)
    best = feasible[non_dominated(values[feasible])]
    # np.unique sorts the rows, by the first objective first.
    _, first = np.unique(values[best], axis=0, return_index=True)
    return best[first]


def choose(study: Study, found: Evaluations, members: NDArray[np.intp]) -> int | None:
    """The member of the front that [choose] selects; None if no member keeps within the rule's limits.

    "knee": with the objectives scaled to 0 (best) to 1 over the front, the member farthest from the plane through the
    front's extremes, where the sum of the scaled objectives is least (Das, Structural Optimization 18, 1999, for two
    objectives). "best": the best in one objective.
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
