"""Scores of the effects along simulated records: inner products of what a record shows with the effects' columns.

Records of drives without any effect are simulated along one record, with its noise and individuals of its population.
What effects would add to the scores follows from the information, so that a few numbers stand for a record.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..estimation.score_test import eliminate
from ..estimation.weighting import SCATTER_SIZES, Weighting
from ..inference.simulated_records import simulate_records
from .effect_columns import Sensitivities


@dataclass(frozen=True)
class ScoresAtSize:
    """m simulated records without effects, under the covariance with one size of the scatter.

    information: (k, k) of the effects' columns, orthogonal to the base model; scores: (m, k); cost: (m,), -2 log
    likelihood without effects; size: of the scatter, 0 where there is none.
    """

    information: Array
    scores: Array
    cost: Array
    size: float = 0.0


@dataclass(frozen=True)
class SimulatedScores:
    """information: (k, k) under the likeliest size; at: the simulated records under every size."""

    information: Array
    at: tuple[ScoresAtSize, ...]

    def __len__(self) -> int:
        return len(self.at[0].cost)


def scores_of_records(
    s: Sensitivities, weights: Weighting, count: int, seed: int, divided: float = 1.0
) -> SimulatedScores:
    """Scores along `count` simulated records like the one for which the columns are, of drives that scatter as widely
    as `weights` say; divided: dispersion by which a diagnosis of that record divides its evidence."""
    records = simulate_records(s.problem, count, seed).under(weights)
    k = s.columns.shape[1]
    values = np.concatenate([s.columns, records, s.base, s.held], axis=1)
    found: list[ScoresAtSize] = []
    # No hypothesis is likeliest under much less scatter than the drives have.
    sizes = [size for size in SCATTER_SIZES if size > weights.size / 3] if len(weights.eigenvalues) else [weights.size]
    for products, size in zip(weights.products(values, sizes), sizes, strict=True):
        own = eliminate(products, k + count, s.base.shape[1])
        cost = np.diag(own)[k:] + weights.with_size(size).log_determinant
        own_size = size if len(weights.eigenvalues) else 0.0
        found.append(ScoresAtSize(own[:k, :k] / divided, own[k:, :k] / divided, cost / divided, own_size))
    return SimulatedScores(information_under(s, weights) / divided, tuple(found))


def gaussian_scores(information: Array, count: int, seed: int) -> SimulatedScores:
    """Scores along `count` records with the covariance under which the effects' columns have an information (k, k)."""
    values, vectors = np.linalg.eigh(information)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    rng = np.random.default_rng(np.random.SeedSequence([seed, len(information)]))
    scores = rng.standard_normal((count, len(information))) @ root.T
    return SimulatedScores(information, (ScoresAtSize(information, scores, np.zeros(count)),))


def information_under(s: Sensitivities, weights: Weighting) -> Array:
    """(k, k) information of the columns under a covariance, orthogonal to the base model."""
    values = np.concatenate([s.columns, s.base, s.held], axis=1)
    return eliminate(weights.products(values, [weights.size])[0], s.columns.shape[1], s.base.shape[1])
