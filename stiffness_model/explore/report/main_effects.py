"""Main effects: the mean of each metric over each parameter alone, from the designs of the Sobol sample."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ...numerics.arrays import Array
from ..evaluation.evaluate import Outcome
from .results import Results

MAX_BINS = 20
"""Greatest number of bins of a continuous parameter; chosen by judgement."""
MIN_DESIGNS_PER_BIN = 16
"""Fewest designs from which the 10th and 90th percentiles of a bin are taken; chosen by judgement."""


@dataclass(frozen=True, eq=False)
class MainEffect:
    """A metric over one parameter, in bins.

    centre: mean parameter value, (bins,); mean, low, high: mean, P10 and P90 of the metric, (bins,); index: first-order
    share of the variance, 0 to 1.
    """

    centre: Array
    mean: Array
    low: Array
    high: Array
    index: float


def main_effect(position: ArrayLike, value: ArrayLike) -> MainEffect:
    """The effect of a parameter at positions (n,) on values (n,), where all other parameters vary at random.

    Bins hold similar numbers of designs, or one discrete value each. index is the first-order Sobol index
    Var(E(y|x))/Var(y), estimated by Kelley's epsilon squared, which is unbiased for a parameter without effect
    (Proc. Nat. Acad. Sci. 21, 1935).

    >>> x, noise = np.random.default_rng(1).random((2, 4000))
    >>> f"{main_effect(x, x + noise).index:.1f}", f"{main_effect(x, noise).index:.1f}"
    ('0.5', '0.0')
    """
    x, y = np.asarray(position, float), np.asarray(value, float)
    cells = np.unique(x)
    if len(cells) > MAX_BINS:
        bins = max(1, min(MAX_BINS, len(x) // MIN_DESIGNS_PER_BIN))
        member = np.minimum(np.argsort(np.argsort(x, kind="stable"), kind="stable") * bins // max(1, len(x)), bins - 1)
    else:
        member = np.searchsorted(cells, x)
    groups = [np.flatnonzero(member == k) for k in range(int(member.max(initial=-1)) + 1)]
    mean = np.array([y[g].mean() for g in groups])
    within = sum(float(((y[g] - y[g].mean()) ** 2).sum()) for g in groups)
    total = float(((y - y.mean()) ** 2).sum()) if len(y) else 0.0
    freedom = len(y) - len(groups)
    per_group = within / freedom if freedom > 0 else 0.0
    index = (total - within - (len(groups) - 1) * per_group) / total if total > 0 and freedom > 0 else 0.0
    band = np.array([np.percentile(y[g], (10, 90)) for g in groups]).reshape(-1, 2).T
    return MainEffect(np.array([x[g].mean() for g in groups]), mean, band[0], band[1], min(1.0, max(0.0, index)))


def sampled_designs(results: Results) -> NDArray[np.intp]:
    """Indices of the designs from which effects are taken: those of the sample that were simulated."""
    return np.flatnonzero((results.generation == 0) & (results.evaluations.outcome == Outcome.SIMULATED))


def parameter_effect(results: Results, parameter: int, metric: str) -> MainEffect:
    """The effect of a study's parameter on a metric, in its display unit, over the simulated part of the sample.

    If limits exclude designs from simulation, the parameters are correlated, and an index includes a part of the
    effects of others.
    """
    some = sampled_designs(results)
    return main_effect(results.parameter_values(parameter)[some], results.display_values(metric)[some])
