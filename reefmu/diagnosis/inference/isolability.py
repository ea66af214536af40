"""Isolability: before anything is fitted, what this excitation cannot show and what it cannot tell apart."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect, separating_test
from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.score_test import Direction, orthonormal_basis

MIN_TRACE_SHARE = 0.03
"""Share of a candidate's trace that the base parameters must leave, or it is called invisible."""
INDISTINGUISHABLE_COSINE = 0.995
"""Cosine of the angle between two traces above which they are indistinguishable."""


@dataclass(frozen=True)
class Isolability:
    """invisible: candidates that leave no trace, by name with the reason; indistinguishable: pairs of candidates that
    this record cannot tell apart."""

    invisible: dict[str, str]
    indistinguishable: tuple[tuple[str, str], ...]


def isolability(problem: Problem, base: Fit, traces: dict[str, list[Direction]]) -> Isolability:
    """From linearised traces of all candidates under the noise alone."""
    weights = problem.weights.with_size(0.0)
    basis = orthonormal_basis(weights, base.prediction.sensitivities)
    visible: dict[str, list[Array]] = {}
    invisible = {}
    for name, variants in traces.items():
        kept = []
        for direction in variants:
            white = weights.whiten(direction.columns)
            rest = white - basis @ (basis.T @ white)
            sizes = [find_effect(name).parameters[k].nominal for k in direction.sizes]
            nominal = np.array(sizes * (2 if direction.paired else 1))
            if np.linalg.norm(white) > 0 and np.linalg.norm(rest) > MIN_TRACE_SHARE * np.linalg.norm(white):
                kept.append(np.linalg.qr(rest * nominal)[0][:, :1] if rest.shape[1] == 1 else _span(rest * nominal))
        if kept:
            visible[name] = kept
        else:
            invisible[name] = "leaves no trace in this record; it would take: " + find_effect(name).experiment
    names = list(visible)
    indistinguishable = []
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            if find_effect(first).identification.sign_pair == second:
                continue  # one quantity; the sign that fits is the name
            like = max(_alike(a, b) for a in visible[first] for b in visible[second])
            if like > INDISTINGUISHABLE_COSINE:
                indistinguishable.append((first, second))
    return Isolability(invisible, tuple(indistinguishable))


def _span(columns: Array) -> Array:
    u, s, _ = np.linalg.svd(columns, full_matrices=False)
    return u[:, s > 1e-3 * max(float(s[0]), 1e-300)]


def _alike(a: Array, b: Array) -> float:
    """Cosine of the greatest angle between the smaller of two spaces and the other."""
    small = min(a.shape[1], b.shape[1])
    if a.shape[1] != b.shape[1] and max(a.shape[1], b.shape[1]) > 2:
        return 0.0
    return float(np.linalg.svd(a.T @ b, compute_uv=False)[:small].min(initial=1.0))


def separating_experiments(sets: Sequence[Sequence[str]]) -> list[str]:
    """Experiments that tell the sets apart, one for each pair of effects in which they differ."""
    found: list[str] = []
    best = set(sets[0])
    for other in sets[1:]:
        mine, theirs = best - set(other), set(other) - best
        for a in sorted(mine) or sorted(best):
            for b in sorted(theirs):
                line = f"{a} or {b}: {separating_test(a, b)}"
                if line not in found:
                    found.append(line)
    return found[:6]
