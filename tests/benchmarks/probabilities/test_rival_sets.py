"""The greatest share of names, compared with a judge who knows everything but which of two sets is missing."""

from __future__ import annotations

import numpy as np
import pytest

from reefmu.diagnosis.estimation.weighting import make_weighting
from tests.benchmarks.probabilities.likelihood_ratio import log_ratio
from tests.benchmarks.probabilities.rival_sets import bound

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


@pytest.mark.parametrize("wider", [1.0, 3.0])
def test_the_log_ratio_of_two_sets_is_that_of_simulated_records(wider: float) -> None:
    """Twenty blocks with four random effects, those of the other set wider or not; with one covariance the mean is half
    the squared separation, which is the variance."""
    rng = np.random.default_rng(1)
    noise, columns, apart = np.full(20, 0.5), rng.standard_normal((4, 20)), 0.2 * rng.standard_normal(20)
    true, other = make_weighting(noise, columns, 0.7), make_weighting(noise, wider * columns, 0.7)
    records = 0.7 * rng.standard_normal((N_RECORDS, 4)) @ columns
    records += np.sqrt(noise) * rng.standard_normal((N_RECORDS, 20))
    ratio = [(other.cost(record + apart) - true.cost(record)) / 2 for record in records]
    mean, deviation = log_ratio(true, other, apart)
    assert float(np.mean(ratio)) == pytest.approx(mean, abs=0.02 * deviation)
    assert float(np.std(ratio)) == pytest.approx(deviation, rel=0.03)
    if wider == 1.0:
        assert mean == pytest.approx(deviation**2 / 2)
