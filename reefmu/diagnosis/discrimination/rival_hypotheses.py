"""Sets of effects as hypotheses: their columns, and how far their traces are from those of other hypotheses."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from .effect_columns import Sensitivities, Variant

MAX_COMBINATIONS = 32
"""Combinations of the variants of a set's effects that are examined, evenly chosen. Chosen by judgement to bound the
time; single effects have at most 28 variants."""
SINGULAR = 1e-9
"""Relative size of an eigenvalue below which columns are linearly dependent: rounding."""


@dataclass(frozen=True)
class RivalHypothesis:
    """A set of effects. variants: combinations of variants of its effects; truths: columns of random traces, whose sum
    is the trace of the set, one tuple for each draw.
    """

    names: tuple[str, ...]
    variants: tuple[tuple[Variant, ...], ...]
    truths: tuple[tuple[int, ...], ...]

    @property
    def label(self) -> str:
        """Its effects, joined."""
        return " + ".join(self.names)


def make_hypotheses(s: Sensitivities, sets: Sequence[Sequence[str]]) -> list[RivalHypothesis]:
    """The hypotheses of sets of candidates; sets with an effect that is no candidate are left out."""
    found: list[RivalHypothesis] = []
    for names in sets:
        if not all(name in s.candidates for name in names):
            continue
        by_effect = [[v for v in s.variants if v.effect == name] for name in names]
        if len(names) == 1 and not any(v.paired for v in by_effect[0]):
            # A fit follows the trace of a large effect and of shapes between those of the variants.
            by_effect[0] += [v for v in s.truths if v.effect == names[0]]
        draws = [[v.columns[0] for v in s.truths if v.effect == name] for name in names]
        found.append(
            RivalHypothesis(
                tuple(names),
                tuple(_evenly(list(itertools.product(*by_effect)))),
                tuple(zip(*draws, strict=True)),
            )
        )
    return found


def _evenly(items: list[tuple[Variant, ...]]) -> list[tuple[Variant, ...]]:
    if len(items) <= MAX_COMBINATIONS:
        return items
    return [items[k] for k in np.linspace(0, len(items) - 1, MAX_COMBINATIONS).round().astype(int).tolist()]


def separations(information: Array, true: Sequence[RivalHypothesis], rivals: Sequence[RivalHypothesis]) -> list[Array]:
    """Squared distances, in standard deviations, of the traces of hypotheses from the nearest of each rival.

    information: (k, k) of the effects' columns. For every hypothesis of `true` an array (d, r + 1): of each of its
    traces, from "nothing" (column 0) and from the spans of all variants of the r rivals, 0 from itself (T-optimality:
    Atkinson and Fedorov, The Design of Experiments for Discriminating between Two Rival Models, 1975). The amplitude of
    a single effect keeps its sign where it has one; those of sets do not.
    """
    traces = np.zeros((sum(len(h.truths) for h in true), len(information)))
    for row, columns in enumerate(columns for h in true for columns in h.truths):
        traces[row, list(columns)] = 1.0
    scores = traces @ information
    own = np.maximum((scores * traces).sum(axis=1), 0.0)
    found = np.empty((len(traces), len(rivals) + 1))
    found[:, 0] = own
    for j, rival in enumerate(rivals):
        best = np.zeros(len(traces))
        for parts in rival.variants:
            columns = [k for v in parts for k in v.columns]
            inner = information[np.ix_(columns, columns)]
            if len(columns) == 1:
                score = scores[:, columns[0]]
                score = np.maximum(score, 0.0) if parts[0].one_sided else score
                best = np.maximum(best, score**2 / max(float(inner[0, 0]), 1e-300))
                continue
            values, vectors = np.linalg.eigh(inner)
            keep = values > SINGULAR * max(float(values.max()), 1e-300)
            along = scores[:, columns] @ (vectors[:, keep] / np.sqrt(values[keep]))
            best = np.maximum(best, (along**2).sum(axis=1))
        found[:, j + 1] = np.maximum(own - best, 0.0)
    edges = np.cumsum([0, *(len(h.truths) for h in true)])
    parts = [found[a:b] for a, b in itertools.pairwise(edges.tolist())]
    for part, h in zip(parts, true, strict=True):
        for j, rival in enumerate(rivals):
            if rival.names == h.names:
                part[:, j + 1] = 0.0
    return parts
