"""Whitening by a diagonal and a few random effects, compared with the dense covariance."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reefmu.diagnosis.estimation.score_test import absorbing_basis
from reefmu.diagnosis.estimation.weighting import (
    MIN_EIGENVALUE,
    SCATTER_SIZES,
    UNKNOWN_FORMS,
    Weighting,
    make_weighting,
    weighting_of_covariance,
)
from stiffness_model.numerics.arrays import Array

N = 30
SIZES = st.sampled_from([0.0, 0.12, 1.0, 2.8])


def example(seed: int, size: float) -> tuple[Weighting, Array, Array]:
    """A weighting, its dense covariance (N, N), and three columns of values (N, 3)."""
    rng = np.random.default_rng(seed)
    variance = rng.uniform(0.5, 2.0, N)
    columns = np.array([[5.0], [3.0], [2.0]]) * rng.standard_normal((3, N))
    dense = np.diag(variance) + size**2 * columns.T @ columns
    return make_weighting(variance, columns, size), dense, rng.standard_normal((N, 3))


def dense_cost(weights: Weighting, dense: Array, values: Array) -> float:
    """-2 log likelihood of values (N,), up to the determinant of the noise, which is common to all weightings."""
    noise = 1 / weights.scale**2
    return float(values @ np.linalg.solve(dense, values) + np.linalg.slogdet(dense)[1] - np.log(noise).sum())


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


@given(st.integers(0, 1000))
def test_products_under_every_size_are_those_of_whitened_values(seed: int) -> None:
    weights, _, values = example(seed, 1.0)
    for size, found in zip(SCATTER_SIZES, weights.products(values, SCATTER_SIZES), strict=True):
        white = weights.with_size(size).whiten(values)
        np.testing.assert_allclose(found, white.T @ white, rtol=1e-9, atol=1e-9)


@given(st.integers(0, 1000), SIZES)
def test_the_cost_is_the_likelihood_of_the_covariance(seed: int, size: float) -> None:
    weights, dense, values = example(seed, size)
    assert weights.cost(values[:, 0]) == pytest.approx(dense_cost(weights, dense, values[:, 0]), rel=1e-9)


@given(st.integers(0, 1000), SIZES, st.sampled_from([0.1, 1.0]))
def test_expected_squares_are_those_of_noise_and_scatter(seed: int, size: float, noise: float) -> None:
    """Against the dense covariance of blocks whose noise alone is that share of what the weights count."""
    weights, dense, _ = example(seed, size)
    of_noise = np.diag(1 / weights.scale**2)
    covariance = dense - (1 - noise) * of_noise
    whitening = weights.whiten(np.eye(N))
    expected = np.diag(whitening @ covariance @ whitening.T)
    np.testing.assert_allclose(weights.expected_squares(np.full(N, noise)), expected, rtol=1e-9, atol=1e-9)


@given(st.integers(0, 1000), st.sampled_from([0.1, 0.5, 2.0]), st.sampled_from([0.02, 0.5, 1.0]))
def test_the_size_is_that_of_the_greatest_likelihood(seed: int, largest: float, least: float) -> None:
    """Against the likelihood of every size by itself, for one residual and for several at once."""
    weights, _, values = example(seed, 1.0)
    values *= largest
    tried = [weights.with_size(size) for size in SCATTER_SIZES if size >= least]
    for residuals in (values[:, :1], values):
        found = weights.with_likeliest_scatter(residuals[:, 0] if residuals.shape[1] == 1 else residuals, least)
        cost = min(sum(w.cost(r) for r in residuals.T) for w in tried)
        assert sum(found.cost(r) for r in residuals.T) == pytest.approx(cost, rel=1e-9)


@given(st.integers(0, 1000), SIZES)
def test_random_effects_and_their_covariance_make_the_same_weighting(seed: int, size: float) -> None:
    weights, _, values = example(seed, size)
    components, variance = weights.components, 1 / weights.scale**2
    found = weighting_of_covariance(variance, components.T @ components).with_size(size)
    np.testing.assert_allclose(found.eigenvalues, weights.eigenvalues, rtol=1e-9)
    white = found.whiten(values)
    np.testing.assert_allclose(white.T @ white, weights.whiten(values).T @ weights.whiten(values), rtol=1e-9, atol=1e-9)


def test_components_of_a_covariance_of_full_rank_are_those_of_its_eigenvalues() -> None:
    """Many of them lie about the least one that is kept: -2 log likelihoods are those of all eigenvalues."""
    place = np.arange(200.0)
    apart = np.abs(place[:, None] - place) / 5
    covariance = 20 * (1 + apart + apart**2 / 3) * np.exp(-apart)
    values, vectors = np.linalg.eigh(covariance)
    kept = values > MIN_EIGENVALUE
    assert 0 < values[~kept].max() < MIN_EIGENVALUE < values[kept].min() < 2 * MIN_EIGENVALUE
    expected = Weighting(np.ones(len(place)), vectors[:, kept], values[kept], 1.0)
    found = weighting_of_covariance(np.ones(len(place)), covariance)
    for residual in np.random.default_rng(0).standard_normal((5, len(place))):
        assert found.cost(residual) == pytest.approx(expected.cost(residual), abs=0.01)


def test_a_covariance_without_scatter_is_that_of_the_noise() -> None:
    found = weighting_of_covariance(np.full(N, 4.0), np.zeros((N, N)))
    assert len(found.eigenvalues) == 0
    assert found.cost(np.full(N, 2.0)) == pytest.approx(N)


@pytest.mark.parametrize("noise", [0.5, 1.5])
def test_other_forms_widen_small_components_the_most(noise: float) -> None:
    """Two components of 1 and 100 N.m at a full torque of 200 N.m, whatever the noise."""
    columns = np.zeros((2, N))
    columns[0, 0], columns[1, 1] = 1.0, 100.0
    weights = make_weighting(np.full(N, noise**2), columns)
    found = weights.with_unknown_forms(200.0)
    variances = np.sort(found.eigenvalues * noise**2)
    np.testing.assert_allclose(variances, [1.0 + UNKNOWN_FORMS * 200.0, 1e4 + UNKNOWN_FORMS * 200.0 * 100.0])
    assert found.basis is weights.basis


@given(st.integers(0, 1000), SIZES)
def test_another_noise_leaves_the_scatter_as_it_is(seed: int, size: float) -> None:
    weights, dense, values = example(seed, size)
    more = np.random.default_rng(seed + 1).uniform(1.0, 3.0, N)
    found = weights.with_variance(1 / weights.scale**2 + more)
    expected = values.T @ np.linalg.solve(dense + np.diag(more), values)
    white = found.whiten(values)
    # Components that are then below the noise are left out.
    if len(found.eigenvalues) == len(weights.eigenvalues):
        np.testing.assert_allclose(white.T @ white, expected, rtol=1e-9, atol=1e-9)
    assert found.size == size


def test_components_far_below_the_noise_are_left_out() -> None:
    rng = np.random.default_rng(3)
    weak = np.sqrt(0.5 * MIN_EIGENVALUE / N) * rng.choice([-1.0, 1.0], (1, N))
    strong = 10 * rng.standard_normal((1, N))
    weights = make_weighting(np.ones(N), np.concatenate([strong, weak]))
    assert len(weights.eigenvalues) == 1
    assert weights.eigenvalues[0] == pytest.approx(float(strong[0] @ strong[0]), rel=0.01)


@given(st.integers(0, 1000))
def test_parameters_with_priors_absorb_what_is_plausible(seed: int) -> None:
    """Against the dense covariance: a free column is projected out, one with a prior is a further random effect."""
    weights, dense, values = example(seed, 1.0)
    rng = np.random.default_rng(seed + 1)
    columns, deviation = rng.standard_normal((N, 3)), np.array([np.inf, 0.5, 2.0])
    basis = absorbing_basis(weights, columns, deviation)
    white = weights.whiten(values)
    left = white - basis @ (basis.T @ white)
    whole = dense + columns[:, 1:] * deviation[1:] ** 2 @ columns[:, 1:].T
    inverse = np.linalg.inv(whole)
    free = columns[:, :1]
    projected = inverse - inverse @ free @ np.linalg.solve(free.T @ inverse @ free, free.T @ inverse)
    np.testing.assert_allclose(left.T @ left, values.T @ projected @ values, rtol=1e-8, atol=1e-8)


@given(st.integers(0, 1000), SIZES)
def test_further_random_effects_add_to_the_covariance(seed: int, size: float) -> None:
    weights, dense, values = example(seed, size)
    columns = 2.0 * np.random.default_rng(seed + 1).standard_normal((N, 4))
    white = weights.with_random_effects(columns).whiten(values)
    expected = values.T @ np.linalg.solve(dense + columns @ columns.T, values)
    np.testing.assert_allclose(white.T @ white, expected, rtol=1e-8, atol=1e-9)


@given(st.integers(0, 1000), st.sampled_from([0.004, 0.2]))
def test_a_gain_multiplies_the_scatter(seed: int, greatest: float) -> None:
    """The torque of an effect in proportion to that of the contacts scatters with it, noise does not. The covariance of
    a small gain is right to first order: -2 log likelihoods under it are greater by less than 0.0002 in the mean."""
    weights, dense, _ = example(seed, 1.0)
    log = np.random.default_rng(seed).uniform(-greatest, greatest, N)
    gain = np.exp((log - log.mean()) / 2)
    noise = np.diag(weights.scale**-2)
    expected = noise + gain[:, None] * (dense - noise) * gain
    white = weights.with_gain(gain).whiten(np.eye(N))
    over = white @ expected @ white.T
    divergence = float(np.trace(over)) - N - float(np.linalg.slogdet(over)[1])
    assert -1e-9 < divergence < (2e-4 if greatest < 0.1 else 1e-9)
    mean_drive = weights.for_mean_drive()
    assert mean_drive.with_gain(gain) is mean_drive
