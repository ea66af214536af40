"""Marginal likelihoods over amplitudes, compared with quadrature and with the chain rule."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.stats import norm

from reefmu.diagnosis.discrimination.amplitude_evidence import AmplitudeEvidence
from reefmu.diagnosis.discrimination.effect_columns import AMPLITUDE_DEVIATION, Variant
from stiffness_model.numerics.arrays import Array


def variant(effect: str, columns: tuple[int, ...], one_sided: bool = False) -> Variant:
    return Variant(effect, columns, len(columns), one_sided, False, 1.0)


def information(seed: int) -> Array:
    rows = np.random.default_rng(seed).standard_normal((8, 4))
    return rows.T @ rows


@pytest.mark.parametrize("one_sided", [False, True])
@pytest.mark.parametrize("score", [-3.0, 0.5, 12.0])
def test_the_evidence_is_the_integral_over_the_prior(one_sided: bool, score: float) -> None:
    found = AmplitudeEvidence(np.array([[4.0]]), [(variant("creep", (0,), one_sided),)])

    def density(a: float) -> float:
        return float(np.exp(score * a - 2.0 * a**2) * norm.pdf(a, 0, AMPLITUDE_DEVIATION)) * (1 + one_sided)

    integral, _ = quad(density, 0.0 if one_sided else -20.0, 20.0, points=[0.0, score / 4])
    assert found.log_evidence(np.array([[score]]))[0, 0] == pytest.approx(np.log(integral), abs=1e-6)


def test_an_effect_that_is_present_or_absent_has_its_own_prior() -> None:
    """A missing ball has the size 1, give or take a tenth: data that fit it are evidence without a loss for freedom."""
    ball, other = (
        AmplitudeEvidence(np.array([[100.0]]), [(variant(name, (0,)),)]).log_evidence(np.array([[100.0]]))[0, 0]
        for name in ("missing_ball", "creep")
    )
    assert ball == pytest.approx(50.0, abs=0.5)
    prior = 0.5 / AMPLITUDE_DEVIATION**2 + np.log(10 * AMPLITUDE_DEVIATION)
    assert other == pytest.approx(50.0 - prior, abs=0.1)


@given(st.integers(0, 10**6))
def test_the_evidence_of_two_is_that_of_one_and_of_the_other_beside_it(seed: int) -> None:
    one, other = variant("creep", (0, 2)), variant("damping", (1, 3))
    columns, scores = information(seed), 3 * np.random.default_rng(seed + 1).standard_normal((5, 4))
    found = AmplitudeEvidence(columns, [(one,), (one, other)])
    log = found.log_evidence(scores)
    beside = AmplitudeEvidence(found.information_beside(0), [(other,)])
    np.testing.assert_allclose(log[1], log[0] + beside.log_evidence(found.scores_beside(0, scores))[0], atol=1e-8)


@given(st.integers(0, 10**6))
def test_the_gain_is_that_of_the_fitted_amplitudes(seed: int) -> None:
    """Twice the log likelihood of the posterior mean, with the prior."""
    columns, scores = information(seed), 3 * np.random.default_rng(seed + 1).standard_normal((5, 4))
    found = AmplitudeEvidence(columns, [(variant("creep", (0, 2)),)])
    inside = columns[np.ix_([0, 2], [0, 2])] + np.eye(2) / AMPLITUDE_DEVIATION**2
    mean = np.linalg.solve(inside, scores[:, [0, 2]].T)
    expected = 2 * (mean * scores[:, [0, 2]].T).sum(axis=0) - (mean * (inside @ mean)).sum(axis=0)
    np.testing.assert_allclose(found.gain(found.log_evidence(scores))[0], expected, atol=1e-8)
