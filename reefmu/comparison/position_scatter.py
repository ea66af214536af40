"""Posterior of the means of states whose positions scatter: a random-effects model with variances of their own.

The mean y_sp of the cycles of state s at position p is normal about the state's mean mu_s with the variance v_s,
which holds the scatter between positions and the cycles' noise that remains in the mean. The variances of the states
are scaled inverse chi-square about a common one, v_s ~ kappa v_0/chi2_kappa, so that states with few positions borrow
from the others as far as these agree (Smyth, Statistical Applications in Genetics and Molecular Biology 3(1), 2004,
eqs. 4 to 6). Priors: flat in mu_s, in log v_0 and over the grid of kappa. Given kappa and v_0 the sum of squares of a
state has a closed likelihood and mu_s is Student-t; kappa and v_0 are integrated over a grid instead of being
estimated.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from stiffness_model.numerics.arrays import Array

KAPPA = np.array([2.0, 4.0, 8.0, 16.0, 32.0, 64.0])
"""Grid of the degrees of freedom by which variances of states resemble each other. Chosen by judgement: from a factor
of about 3 to either side to practically equal."""
V0_POINTS = 161
V0_SPAN = 1e4
"""Points of the grid of v_0, and its extent beyond the least and the greatest variance of a state. Chosen so that the
likelihood is negligible at its ends with two or more degrees of freedom."""
DRAWS = 40_000
"""Draws of the posterior; the error of a probability is at most 0.0025."""
Basis = Literal["positions", "known spread", "cycles"]
"""What the variances rest on: the scatter between positions, a known one only, or cycles at one position each."""


@dataclass(frozen=True)
class KnownSpread:
    """Standard deviation between positions of one state, in the quantity's unit, from `degrees` degrees of freedom."""

    value: float
    degrees: float


@dataclass(frozen=True)
class ScatterPosterior:
    """draws: (DRAWS, states), posterior of the states' means; basis: see `Basis`; spread: of single positions, pooled
    over the states, None where it is not known; cycle_spread: standard deviation of cycles at one position, None
    without a repeat."""

    draws: Array
    basis: Basis
    spread: KnownSpread | None
    cycle_spread: KnownSpread | None


def state_means(
    states: Sequence[Sequence[Array]], known: KnownSpread | None = None, matched: bool = False
) -> ScatterPosterior | None:
    """The posterior of the states' means; None where nothing repeats, so that no interval exists.

    states: for each of them the cycles' values (cycles,) at each of its positions, in any unit. known: spread between
    positions from other records. matched: position k is the same in all states, so that its own effect cancels in
    differences; variances are then taken as equal.
    """
    cycles = _pooled([cycle for positions in states for cycle in positions])
    means = [np.array([cycle.mean() for cycle in positions]) for positions in states]
    if matched:
        table = np.stack(means)
        rest = table - table.mean(axis=0) - table.mean(axis=1, keepdims=True) + table.mean()
        degrees = (table.shape[0] - 1) * (table.shape[1] - 1)
        sums, degree = np.array([float((rest**2).sum())]), np.array([float(degrees)])
        if degrees:
            spread = KnownSpread(float(np.sqrt(sums[0] / degrees)), degrees)
            return ScatterPosterior(_equal_variances(means, spread), "positions", spread, cycles)
    sums = np.array([float(((mean - mean.mean()) ** 2).sum()) for mean in means])
    degree = np.array([len(mean) - 1.0 for mean in means])
    basis: Basis = "positions"
    if degree.sum() == 0:
        basis = "cycles" if known is None else "known spread"
    spread = _pooled(means)
    if basis == "cycles":
        if cycles is None:
            return None
        only = [positions[0] for positions in states]
        sums = np.array([float(((cycle - cycle.mean()) ** 2).sum()) for cycle in only])
        return ScatterPosterior(
            _draws([cycle.mean() for cycle in only], [len(cycle) for cycle in only], sums, None), basis, None, cycles
        )
    draws = _draws([mean.mean() for mean in means], [len(mean) for mean in means], sums, known)
    return ScatterPosterior(draws, basis, spread or known, cycles)


def _pooled(groups: Sequence[Array]) -> KnownSpread | None:
    degrees = sum(len(group) - 1 for group in groups)
    if degrees < 1:
        return None
    return KnownSpread(float(np.sqrt(sum(((g - g.mean()) ** 2).sum() for g in groups) / degrees)), degrees)


def _equal_variances(means: Sequence[Array], spread: KnownSpread) -> Array:
    """Draws (DRAWS, states) of means with one variance for all."""
    rng = np.random.default_rng(0)
    variance = spread.degrees * spread.value**2 / rng.chisquare(spread.degrees, (DRAWS, 1))
    count = np.array([len(mean) for mean in means])
    centre = np.array([mean.mean() for mean in means])
    return centre + np.sqrt(variance / count) * rng.standard_normal((DRAWS, len(means)))


def _draws(centre: Sequence[float], count: Sequence[int], sums: Array, known: KnownSpread | None) -> Array:
    """Draws (DRAWS, states) of the means of states with variances of their own.

    centre, count: mean and number of repeats of each state; sums: (states,) sums of squares about the means.
    """
    rng = np.random.default_rng(0)
    number = np.array(count, float)
    log_v0, weight = _common_variance(sums, number - 1, known)
    place = rng.choice(weight.size, DRAWS, p=weight.ravel())
    kappa = KAPPA[place // len(log_v0)][:, None]
    scale = kappa * np.exp(log_v0[place % len(log_v0)])[:, None] + sums
    variance = scale / rng.chisquare(kappa + number - 1)
    return np.array(centre) + np.sqrt(variance / number) * rng.standard_normal((DRAWS, len(centre)))


def _common_variance(sums: Array, degrees: Array, known: KnownSpread | None) -> tuple[Array, Array]:
    """log v_0 (V0_POINTS,) and posterior weights (KAPPA, V0_POINTS).

    The likelihood of a sum of squares SS with d degrees of freedom, v integrated, is proportional to
    G((kappa + d)/2)/G(kappa/2) (kappa v0)^(kappa/2) (kappa v0 + SS)^(-(kappa + d)/2).
    """
    from scipy.special import gammaln

    if known is not None:
        sums = np.append(sums, known.degrees * known.value**2)
        degrees = np.append(degrees, known.degrees)
    sums, degrees = sums[degrees > 0], degrees[degrees > 0]
    # Repeats that agree to the last digit have the variance of their rounding, so that the logarithm exists.
    variances = np.maximum(sums / degrees, np.finfo(float).tiny ** 0.5)
    log_v0 = np.linspace(np.log(variances.min() / V0_SPAN), np.log(variances.max() * V0_SPAN), V0_POINTS)
    kappa = KAPPA[:, None, None]
    scale = kappa * np.exp(log_v0)[:, None]
    log_likelihood = (
        gammaln((kappa + degrees) / 2)
        - gammaln(kappa / 2)
        + kappa / 2 * np.log(scale)
        - (kappa + degrees) / 2 * np.log(scale + sums)
    ).sum(axis=-1)
    weight = np.exp(log_likelihood - log_likelihood.max())
    return log_v0, weight / weight.sum()
