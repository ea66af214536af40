"""Intervals of differences hold the truth as often as they say, and probabilities are those of the sign."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from reefmu.comparison.position_scatter import KnownSpread, state_means
from stiffness_model.numerics.arrays import Array

TRIALS = 150
"""The standard error of a coverage is 1.8 %."""
POSITION, CYCLE = 1.0, 0.3
"""Standard deviations between positions of one state, and between cycles at one of them."""


def states(
    rng: np.random.Generator, number: int, positions: int, unequal: float = 0.0, common: float = 0.0
) -> list[list[Array]]:
    """Three cycles at each position; unequal: standard deviation of the logarithm of the states' scatter; common: that
    of effects which a position has in all states."""
    shared = common * rng.standard_normal(positions)
    scatter = POSITION * np.exp(unequal * rng.standard_normal(number))
    means = shared + scatter[:, None] * rng.standard_normal((number, positions))
    return [[mean + CYCLE * rng.standard_normal(3) for mean in state] for state in means]


def outcomes(make: Callable[[np.random.Generator], list[list[Array]]], matched: bool = False) -> tuple[Array, Array]:
    """Whether the interval of the second state minus the first holds zero, the truth; and the probability of up."""
    rng = np.random.default_rng(5)
    covered, up = [], []
    for _ in range(TRIALS):
        found = state_means(make(rng), None, matched)
        assert found is not None
        difference = found.draws[:, 1] - found.draws[:, 0]
        low, high = np.quantile(difference, [0.025, 0.975])
        covered.append(low <= 0 <= high)
        up.append((difference > 0).mean())
    return np.array(covered), np.array(up)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "positions", "unequal", "common", "matched"),
    [
        (2, 2, 0.0, 0.0, False),
        (2, 3, 0.0, 0.0, False),
        (7, 3, 0.0, 0.0, False),
        (7, 3, 0.7, 0.0, False),
        (2, 3, 0.0, 3.0, True),
        (4, 3, 0.3, 3.0, True),
    ],
)
def test_intervals_and_probabilities_are_calibrated(
    number: int, positions: int, unequal: float, common: float, matched: bool
) -> None:
    covered, up = outcomes(lambda rng: states(rng, number, positions, unequal, common), matched)
    assert 0.905 <= covered.mean() <= 0.985
    # Without a change the probability of up is uniform: a tenth of the comparisons beyond each tenth.
    assert (up < 0.1).mean() == pytest.approx(0.1, abs=0.065)
    assert (up > 0.9).mean() == pytest.approx(0.1, abs=0.065)


@pytest.mark.slow
def test_the_scatter_of_cycles_alone_is_no_interval_of_states() -> None:
    """At one position each, the interval counts cycles only and says so; a known spread widens it to the truth."""
    rng = np.random.default_rng(2)
    alone, known = [], []
    for _ in range(TRIALS):
        one = states(rng, 2, 1)
        for covered, spread, basis in ((alone, None, "cycles"), (known, KnownSpread(POSITION, 20), "known spread")):
            found = state_means(one, spread)
            assert found is not None
            assert found.basis == basis
            low, high = np.quantile(found.draws[:, 1] - found.draws[:, 0], [0.025, 0.975])
            covered.append(low <= 0 <= high)
    assert np.mean(alone) < 0.6
    assert np.mean(known) > 0.93


@pytest.mark.slow
def test_a_state_with_one_position_borrows_the_scatter_of_the_others() -> None:
    rng = np.random.default_rng(3)
    covered = []
    for _ in range(TRIALS):
        found = state_means([states(rng, 1, 1)[0], *states(rng, 3, 3)])
        assert found is not None
        assert found.basis == "positions"
        low, high = np.quantile(found.draws[:, 1] - found.draws[:, 0], [0.025, 0.975])
        covered.append(low <= 0 <= high)
    assert 0.905 <= np.mean(covered) <= 0.995


@pytest.mark.slow
def test_more_states_narrow_the_interval() -> None:
    rng = np.random.default_rng(4)
    widths = {2: [], 7: []}
    for number, of_number in widths.items():
        for _ in range(60):
            found = state_means(states(rng, number, 3))
            assert found is not None
            of_number.append(np.ptp(np.quantile(found.draws[:, 1] - found.draws[:, 0], [0.025, 0.975])))
    assert np.median(widths[7]) < 0.9 * np.median(widths[2])


def test_spreads_are_the_pooled_standard_deviations() -> None:
    found = state_means([[np.array([1.0, 3.0]), np.array([4.0, 4.0])], [np.array([0.0, 0.0]), np.array([0.0, 2.0])]])
    assert found is not None
    assert found.spread == KnownSpread(pytest.approx(np.sqrt((2.0 + 0.5) / 2)), 2)
    assert found.cycle_spread == KnownSpread(pytest.approx(1.0), 4)


def test_nothing_that_repeats_has_no_interval() -> None:
    assert state_means([[np.array([1.0])], [np.array([2.0])]]) is None


def test_repeats_that_agree_to_the_last_digit_have_a_finite_interval() -> None:
    found = state_means([[np.full(3, 1.0)] * 3, [np.full(3, 2.0)] * 3])
    assert found is not None
    assert np.quantile(found.draws[:, 1] - found.draws[:, 0], [0.025, 0.975]) == pytest.approx([1.0, 1.0])
