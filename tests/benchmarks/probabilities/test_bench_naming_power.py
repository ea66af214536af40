"""The greatest share of names, compared with a judge who knows everything but which of two sets is missing."""

from __future__ import annotations

import numpy as np
import pytest

from tests.benchmarks.probabilities.bench_naming_power import bound

N_RECORDS = 20_000


@pytest.mark.parametrize(("separation", "advantage", "least"), [(2.0, 0.0, 0.6), (3.0, -2.0, 0.95), (1.0, 1.5, 0.6)])
def test_the_bound_is_what_a_judge_reaches_who_knows_both_sets(
    separation: float, advantage: float, least: float
) -> None:
    """Bayes' rule on simulated records of six blocks with noise of 1."""
    rng = np.random.default_rng(0)
    direction = rng.standard_normal(6)
    true, other = separation * direction / np.linalg.norm(direction), np.zeros(6)
    records = true + rng.standard_normal((N_RECORDS, 6))
    likelihood, rival = (np.exp(-((records - mean) ** 2).sum(axis=1) / 2) for mean in (true, other))
    prior = np.exp(advantage)
    probability = prior * likelihood / (prior * likelihood + rival)
    assert float(np.mean(probability >= least)) == pytest.approx(bound(separation, advantage, least), abs=0.015)
