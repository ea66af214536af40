"""Isolability: which effects this excitation cannot show, and which it cannot tell apart, before anything is fitted.

The trace of an effect is the change of the torque, to first order, that its parameters make along the record.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect, separating_test
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.score_test import Direction, absorbing_basis

MIN_TRACE_SHARE = 0.03
"""Share of a trace, by norm, that the base parameters must not absorb, or the effect is invisible; by judgement."""
INDISTINGUISHABLE_COSINE = 0.995
"""Cosine of the angle between two traces from which effects are indistinguishable. Chosen by judgement: the angle does
not depend on the noise, although detectability does."""
MIN_SINGULAR_VALUE = 1e-3
"""Singular value of a trace, over the largest, below which a column is linearly dependent; chosen by judgement."""
MAX_EXPERIMENTS = 6
"""Experiments that are proposed at most, for a reader's sake."""


@dataclass(frozen=True)
class Isolability:
    """invisible: effects that leave no trace, by name with the reason; indistinguishable: pairs of effects whose traces
    coincide."""

    invisible: dict[str, str]
    indistinguishable: tuple[tuple[str, str], ...]


def isolability(problem: Problem, base: Fit, traces: Mapping[str, Sequence[Direction]]) -> Isolability:
    """From the traces of all variants of the candidates, whitened by the noise alone; base: the fit without effects."""
    weights = problem.weights.with_size(0.0)
    basis = absorbing_basis(weights, base.prediction.sensitivities, base.bounds.prior_deviation)
    visible: dict[str, list[Array]] = {}
    invisible: dict[str, str] = {}
    for name, variants in traces.items():
        spans: list[Array] = []
        for direction in variants:
            white = weights.whiten(direction.columns)
            rest = white - basis @ (basis.T @ white)
            if np.linalg.norm(white) > 0 and np.linalg.norm(rest) > MIN_TRACE_SHARE * np.linalg.norm(white):
                sizes = [find_effect(name).parameters[k].nominal for k in direction.sizes]
                spans.append(_span(rest * np.array(sizes * (2 if direction.paired else 1))))
        if spans:
            visible[name] = spans
        else:
            invisible[name] = "leaves no trace in this record; a test that shows it: " + find_effect(name).experiment
    names = list(visible)
    pairs = [(first, second) for i, first in enumerate(names) for second in names[i + 1 :]]
    return Isolability(invisible, tuple(pair for pair in pairs if _are_indistinguishable(pair, visible)))


def _are_indistinguishable(pair: tuple[str, str], visible: Mapping[str, Sequence[Array]]) -> bool:
    """Whether any variants of two effects have the same trace, unless they are one quantity with two signs."""
    first, second = pair
    if find_effect(first).identification.sign_pair == second:
        return False
    return max(_cosine(a, b) for a in visible[first] for b in visible[second]) > INDISTINGUISHABLE_COSINE


def _span(columns: Array) -> Array:
    """Orthonormal basis (n, m) of columns (n, k) without those that are linearly dependent."""
    if columns.shape[1] == 1:
        return np.linalg.qr(columns)[0][:, :1]
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    return u[:, s > MIN_SINGULAR_VALUE * max(float(s[0]), 1e-300)]


def _cosine(a: Array, b: Array) -> float:
    """Cosine of the largest principal angle between the smaller of two spaces and the other; 0 where their dimensions
    differ and one exceeds two, since a space of many dimensions contains nearly anything."""
    smaller = min(a.shape[1], b.shape[1])
    if a.shape[1] != b.shape[1] and max(a.shape[1], b.shape[1]) > 2:
        return 0.0
    return float(np.linalg.svd(a.T @ b, compute_uv=False)[:smaller].min(initial=1.0))


def separating_line(first: str, second: str) -> str:
    """What tells two effects apart, in a line that does not depend on their order."""
    a, b = sorted((first, second))
    return f"{a} or {b}: {separating_test(a, b)}"


def separating_experiments(sets: Sequence[Sequence[str]]) -> list[str]:
    """Experiments that tell the first set from the others, one for each pair of effects in which they differ."""
    found: list[str] = []
    first = set(sets[0])
    for other in sets[1:]:
        mine, theirs = first - set(other), set(other) - first
        for a in sorted(mine) or sorted(first):
            for b in sorted(theirs):
                line = separating_line(a, b)
                if line not in found:
                    found.append(line)
    return found[:MAX_EXPERIMENTS]
