"""Predicted probabilities: which effect a diagnosis would name while another is true, and from which size.

To first order a record enters the evidence of all hypotheses by its inner products with their columns alone, to which
a true trace adds that of the information matrix. A Monte Carlo simulation therefore needs a few numbers instead of a
record (`simulated_scores`). Of these the table of hypotheses is made, and a hypothesis is named, as in the diagnosis
(`simulated_table`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from .rival_hypotheses import RivalHypothesis
from .simulated_scores import SimulatedScores
from .simulated_table import SimulatedTable

SIZES = tuple(float(x) for x in 10.0 ** np.linspace(-2.0, 1.0, 13))
"""Sizes, over the typical ones, at which the probability of a name is computed: a factor of 1.8 apart, interpolated."""
BY_SIZE = 20
"""Simulated records from which the probability at each size is computed. With four traces and four drives the standard
error is below 6 percentage points, besides what those drives have in common."""


@dataclass(frozen=True)
class PredictedIsolability:
    """names: of the hypotheses that are named, columns of the matrix before the last; true: of those that are true,
    rows of the matrix after the first; matrix: (1 + t, h + 1), probability of each name (last column: of none) while
    nothing (first row) or a hypothesis is true; sizes: (f,); power: (t, f), probability of the right name by size, in
    typical sizes; standard_error: (t,) of the amplitude, in typical sizes, without rivals, median over the traces.
    """

    names: tuple[str, ...]
    true: tuple[str, ...]
    matrix: Array
    sizes: Array
    power: Array
    standard_error: Array

    def named_right(self, label: str) -> float:
        """Probability of the right name at the typical size."""
        return float(self.matrix[1 + self.true.index(label), self.names.index(label)])

    def named_from(self, label: str, power: float) -> float | None:
        """Least size, in typical sizes, at which the right name has this probability; None where none does."""
        curve = self.power[self.true.index(label)]
        above = np.flatnonzero(curve >= power)
        if not above.size:
            return None
        k = int(above[0])
        if k == 0:
            return float(self.sizes[0])
        share = (power - curve[k - 1]) / max(curve[k] - curve[k - 1], 1e-12)
        return float(np.exp(np.interp(share, [0, 1], np.log(self.sizes[k - 1 : k + 1]))))


def isolability(
    simulated: SimulatedScores,
    true: Sequence[RivalHypothesis],
    candidates: Sequence[RivalHypothesis],
    sizes: Sequence[float] = (),
) -> PredictedIsolability:
    """The probabilities for hypotheses `true`, each of which is among the `candidates`, along simulated records.

    sizes: at which the probability of the right name is computed beside the typical one, from the first `BY_SIZE` of
    the records.
    """
    table, labels = SimulatedTable(simulated, candidates), [h.label for h in candidates]
    effect = np.repeat(np.arange(len(true)), [len(h.truths) for h in true])
    traces = np.zeros((len(effect), len(simulated.information)))
    for trace, columns in zip(traces, (columns for h in true for columns in h.truths), strict=True):
        trace[list(columns)] = 1.0
    nothing = table.names(np.zeros((len(simulated), traces.shape[1])), np.arange(len(simulated)))
    at_typical_size = _by_trace(table, traces, len(simulated))
    by_size = [_by_trace(table, size * traces, min(len(simulated), BY_SIZE)) for size in sizes]

    def shares(found: NDArray[np.intp]) -> Array:
        return np.bincount(found.ravel(), minlength=len(candidates) + 1) / found.size

    strength = np.maximum(((traces @ simulated.information) * traces).sum(axis=1), 1e-60)
    right = np.array([labels.index(h.label) for h in true])
    return PredictedIsolability(
        tuple(labels),
        tuple(h.label for h in true),
        np.array([shares(nothing), *(shares(at_typical_size[effect == row]) for row in range(len(true)))]),
        np.array(sizes),
        np.array([[np.mean(found[effect == row] == own) for found in by_size] for row, own in enumerate(right)]),
        np.array([1 / np.sqrt(np.median(strength[effect == row])) for row in range(len(true))]),
    )


def _by_trace(table: SimulatedTable, traces: Array, count: int) -> NDArray[np.intp]:
    """(t, count) name that each of some traces (t, k) gets in the first `count` simulated records."""
    records = np.tile(np.arange(count), len(traces))
    return table.names(np.repeat(traces, count, axis=0), records).reshape(len(traces), count)


def mean_isolability(found: Sequence[PredictedIsolability]) -> PredictedIsolability:
    """The mean over several records with the same hypotheses."""
    return replace(
        found[0],
        matrix=np.mean([f.matrix for f in found], axis=0),
        power=np.mean([f.power for f in found], axis=0),
        standard_error=np.mean([f.standard_error for f in found], axis=0),
    )
