"""Whitening by a diagonal and a few random effects, compared with the dense covariance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reefmu.diagnosis.estimation.weighting import INDIVIDUAL_SIZE, MIN_EIGENVALUE, Weighting, make_weighting
from stiffness_model.numerics.arrays import Array

N = 30
SIZES = st.sampled_from([0.0, 0.12, 1.0, 2.8])


def example(seed: int, size: float) -> tuple[Weighting, Array, Array]:
    """A weighting, its dense covariance (N, N), and three columns of values (N, 3)."""
    rng = np.random.default_rng(seed)
    variance, beyond = rng.uniform(0.5, 2.0, N), rng.uniform(0.0, 1.0, N)
    columns = np.array([[5.0], [3.0], [2.0]]) * rng.standard_normal((3, N))
    diagonal = variance + (beyond if size >= INDIVIDUAL_SIZE else 0.0)
    dense = np.diag(diagonal) + size**2 * columns.T @ columns
    return make_weighting(variance, columns, beyond, size), dense, rng.standard_normal((N, 3))


@given(st.integers(0, 1000), SIZES)
def test_whitened_values_have_the_inner_product_of_the_covariance(seed: int, size: float) -> None:
    weights, dense, values = example(seed, size)
    expected = values.T @ np.linalg.solve(dense, values)
    white = weights.whiten(values)
    np.testing.assert_allclose(white.T @ white, expected, rtol=1e-9, atol=1e-9)
    both = weights.project(values)
    np.testing.assert_allclose(both.inner(both), expected, rtol=1e-9, atol=1e-9)
    first = weights.project(values[:, 0])
    np.testing.assert_allclose(both.inner(first), expected[:, 0], rtol=1e-9, atol=1e-9)


@given(st.integers(0, 1000), SIZES)
def test_the_cost_is_the_likelihood_of_the_covariance(seed: int, size: float) -> None:
    """Up to the determinant of the noise, which is common to all sizes."""
    weights, dense, values = example(seed, size)
    noise = 1 / weights.with_size(0.0).scale ** 2
    expected = values[:, 0] @ np.linalg.solve(dense, values[:, 0]) + np.linalg.slogdet(dense)[1] - np.log(noise).sum()
    cost = float((weights.whiten(values[:, 0]) ** 2).sum()) + weights.log_determinant
    assert cost == pytest.approx(expected, rel=1e-9)


def test_components_far_below_the_noise_are_left_out() -> None:
    rng = np.random.default_rng(3)
    weak = np.sqrt(0.5 * MIN_EIGENVALUE / N) * rng.choice([-1.0, 1.0], (1, N))
    strong = 10 * rng.standard_normal((1, N))
    weights = make_weighting(np.ones(N), np.concatenate([strong, weak]))
    assert len(weights.eigenvalues) == 1
    assert weights.eigenvalues[0] == pytest.approx(float(strong[0] @ strong[0]), rel=0.01)
