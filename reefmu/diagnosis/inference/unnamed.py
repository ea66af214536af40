"""Something unnamed: what no named effect explains, and the effects that are fitted beside it.

Either it varies with something that the record holds, as one of the nonparametric terms, or it shows in no coordinate
but only as more than noise and tolerances allow. Neither noise nor scatter may grow for a set of effects: the noise is
estimated from the record, and tolerances are limits. What exceeds them is therefore evidence of something unnamed, but
for what the uncertainty of that estimate explains as well.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import logsumexp

from stiffness_model.numerics.arrays import Array

from ..estimation.least_squares import HELD_SIZE, Fit, FitOptions, fit
from ..estimation.problem import Problem
from ..estimation.search import MIN_GAIN
from ..estimation.weighting import Weighting
from .law_errors import beyond_law_errors, law_columns
from .nonparametric import NonparametricTerm, TermFit, fit_terms_to

FURTHER_SCATTER = (0.0, 1.0, 1.7, 2.6)
"""Standard deviations, over those that the tolerances allow, of deviations beyond the tolerances that are tried. Chosen
by judgement: with those of the tolerances they come to 1, 1.4, 2 and 2.8."""
FURTHER_NOISE = (0.0, *np.geomspace(0.3, 30.0, 9).tolist())
"""The same of deviations from block to block, over the noise. Chosen by judgement, from what barely shows to what
exceeds the noise by far; the likelihood changes little between neighbours."""
LEVEL_REACH, N_LEVELS = 5.0, 4000
"""Standard deviations about the levels of the noise that are averaged over, and their number; chosen by judgement: the
likelihoods lie well within, and are wider than a step."""


def _no_columns(torque: Array) -> Array:
    return np.zeros((len(torque), 0))


EXCESS = NonparametricTerm("no coordinate of the record", _no_columns)
"""What exceeds noise and tolerances."""


def varies_with_something(found: TermFit) -> bool:
    """Whether what is unnamed varies with something that the record holds, and is no mere excess."""
    return found.term.coordinate != EXCESS.coordinate


@dataclass(frozen=True)
class Excess:
    """Standard deviations beyond noise and tolerances, over those of the noise (`noise`, of every block) and over those
    that the tolerances allow (`further`, of elements and lobes)."""

    further: float
    noise: float

    def spread(self, weights: Weighting) -> Array:
        """(m,) variances beyond those of a weighting along its principal components, in units of the noise."""
        return self.noise**2 + self.further**2 * weights.eigenvalues

    def added_to(self, weights: Weighting) -> Weighting:
        """The weighting of all deviations together."""
        wider, noise = 1 + (self.further / weights.size) ** 2, 1 + self.noise**2
        return replace(weights, scale=weights.scale / np.sqrt(noise), eigenvalues=weights.eigenvalues * wider / noise)


AS_IT_IS = FitOptions(steps=0, estimate_size=False)
"""No step of a fit: the cost of the parameters that are given."""
NO_EXCESS = Excess(0.0, 0.0)
"""Noise and tolerances alone."""


@dataclass(frozen=True)
class UnnamedFit(TermFit):
    """Something unnamed fitted beside a set of effects: a nonparametric term, an excess, or both."""

    excess: Excess = NO_EXCESS

    def weighting(self, problem: Problem, found: Fit) -> Weighting:
        """The weighting of a fit with what is unnamed among its random effects."""
        weights, full_torque = self.excess.added_to(found.weighting), problem.base.full_torque
        if not self.strength:
            return weights
        columns = self.term.columns(found.prediction.torque / full_torque)
        return weights.with_random_effects(columns * full_torque * self.strength)


@dataclass(frozen=True)
class Squares:
    """Squares of a residual, in units of the variance that the noise has in sums over many blocks.

    along: (m,), along the principal components of the scatter; across: sum of all others; expected: what the noise
    alone leaves of that, in slow noise less than 1 for each of the other dimensions; dimensions: their number. Under
    every excess the covariance stays diagonal.
    """

    along: Array
    across: float
    expected: float
    dimensions: int


def squares(weights: Weighting, residual: Array, noise: Array) -> Squares:
    """The squares of a residual (n,), N.m; noise: (n,) variance of each block alone, over that of the weights."""
    scaled = residual * weights.scale
    along = (weights.basis.T @ scaled) ** 2
    expected = float(noise @ (1 - (weights.basis**2).sum(axis=1)))
    return Squares(along, float(scaled @ scaled - along.sum()), expected, len(scaled) - len(along))


def strongest_term(problem: Problem, found: Fit, residual: Array) -> UnnamedFit:
    """What gains most as something unnamed beside a fit; residual: (n,) N.m.

    It is a nonparametric term, an excess over noise and tolerances, or both, where the term gains beside the excess,
    and in either case beyond errors of the laws of the fit's effects.
    """
    errors, weights = law_columns(problem, found), found.weighting
    residual = beyond_law_errors(problem, found, residual, errors)
    term = fit_terms_to(problem, found, residual, errors)[0]
    of_residual = squares(weights, residual, problem.noise_of_blocks)
    gain, alone = likeliest_excess(weights, of_residual)
    fits = [
        UnnamedFit(term.term, term.gain, term.torque, term.strength),
        UnnamedFit(EXCESS, gain, excess_part(weights, residual, alone), 0.0, alone),
    ]
    beyond = squares(weights, residual - term.torque, problem.noise_of_blocks)
    left = likeliest_excess(weights, beyond)[1] if term.gain > 0 else NO_EXCESS
    if left != NO_EXCESS:
        beside = fit_terms_to(problem, replace(found, weighting=left.added_to(weights)), residual, errors)[0]
        if beside.gain > MIN_GAIN:
            torque = beside.torque + excess_part(weights, residual - beside.torque, left)
            both = beside.gain + excess_gain(weights, of_residual, left)
            fits.append(UnnamedFit(beside.term, both, torque, beside.strength, left))
    return max(fits, key=lambda f: f.gain)


def likeliest_excess(weights: Weighting, of_residual: Squares) -> tuple[float, Excess]:
    """The excess of a residual with these squares that is likeliest, and its gain in -2 log likelihood."""
    further = FURTHER_SCATTER if weights.is_individual else FURTHER_SCATTER[:1]
    tried = [Excess(scatter, noise) for scatter in further for noise in FURTHER_NOISE]
    gains = [excess_gain(weights, of_residual, excess) for excess in tried]
    best = int(np.argmax(gains))
    return gains[best], tried[best]


def excess_gain(weights: Weighting, of_residual: Squares, excess: Excess) -> float:
    """Gain in -2 log likelihood of a residual with these squares by an excess.

    What slow noise leaves less than 1 in every dimension across counts as if it were left: the likeliest excess makes
    the squares what they are expected to be with it, and in white noise the likelihood is exact.
    """
    allowed, spread = 1 + weights.size**2 * weights.eigenvalues, excess.spread(weights)
    along, noise = of_residual.along, excess.noise**2
    inside = float((along * spread / (allowed * (allowed + spread)) - np.log1p(spread / allowed)).sum())
    across = of_residual.across + of_residual.dimensions - of_residual.expected
    return inside + across * noise / (1 + noise) - of_residual.dimensions * float(np.log1p(noise))


def gain_by_level(problem: Problem, found: Fit, residual: Array) -> float:
    """What of the gain of an excess of noise beside a fit the uncertain level of the noise explains as well, and
    anything unnamed must exceed; residual: (n,) N.m.

    The logarithm of the level is Gaussian about that of the estimate. Squares of noise count for as many independent
    values as they are expected to be. Averaged over the level, their likelihoods with and without an excess that makes
    them as large as they are differ by what is left of the gain.
    """
    residual = beyond_law_errors(problem, found, residual, law_columns(problem, found))
    of_residual = squares(found.weighting, residual, problem.noise_of_blocks)
    expected, deviation = of_residual.expected, level_deviation(problem)
    ratio = of_residual.across / expected
    if ratio <= 1:
        return 0.0
    excess = (of_residual.across - expected) / of_residual.dimensions
    reach = LEVEL_REACH * deviation
    level = np.linspace(-reach, np.log(ratio) + reach, N_LEVELS)

    def cost(squares_left: float) -> float:
        log_likelihood = -((level / deviation) ** 2 + expected * (squares_left * np.exp(-level) + level)) / 2
        return -2 * float(logsumexp(log_likelihood))

    left = cost(ratio) - cost(1.0) - expected * np.log(ratio)
    return max(0.0, of_residual.dimensions * (excess - np.log1p(excess)) - max(left, 0.0))


def level_deviation(problem: Problem) -> float:
    """Standard deviation of the logarithm of the variance of noise and scatter between cycles in the blocks."""
    own = problem.noise.correlation.level_deviation(typical_samples(problem), problem.noise.samples)
    between = problem.cycle_scatter
    if between is None:
        return own
    share = between.variance / float(problem.block_variance.mean())
    return float(np.hypot((1 - share) * own, share * between.level_deviation))


def typical_samples(problem: Problem) -> int:
    """Samples of most blocks."""
    return round(float(np.median(problem.blocks.count)))


def excess_part(weights: Weighting, residual: Array, excess: Excess) -> Array:
    """(n,) N.m, the part of a residual (n,) that an excess is expected to have."""
    scaled = residual * weights.scale
    along = weights.basis.T @ scaled
    allowed, spread = 1 + weights.size**2 * weights.eigenvalues, excess.spread(weights)
    share = excess.noise**2 / (1 + excess.noise**2)
    return (share * scaled + weights.basis @ ((spread / (allowed + spread) - share) * along)) / weights.scale


def strongest_beside(problem: Problem, found: Fit) -> UnnamedFit:
    """What gains most as something unnamed beside a fit."""
    return strongest_term(problem, found, problem.torque - found.prediction.torque)


def fit_beside(problem: Problem, found: Fit, beside: UnnamedFit) -> tuple[Fit, UnnamedFit]:
    """The set of effects of a fit and what gains most as something unnamed, each fitted beside the other; beside: what
    gains most beside the fit that is given.

    What is unnamed distorts the parameters of a fit that does not know it, and widens its scatter: here they are fitted
    with it among the random effects. The cost of the fit remains that without it, from which its gain is taken. Where
    that is no better, the fit is as it was; a mean drive remains one.
    """
    best = found, beside
    if beside.gain <= MIN_GAIN:
        return best
    predictor, bounds, weights = problem.predictor(found.names), found.bounds, found.weighting
    joint = fit(predictor, problem.torque, beside.weighting(problem, found), bounds, found.parameters, HELD_SIZE)
    # Once more where the scatter is narrower beside what is unnamed.
    for _ in range(2):
        own = fit(predictor, problem.torque, weights, bounds, joint.parameters, AS_IT_IS)
        again = strongest_beside(problem, own)
        best = min(best, (own, again), key=lambda b: b[0].cost - b[1].gain)
        narrower = weights.with_likeliest_scatter(problem.torque - own.prediction.torque - again.torque)
        if not weights.is_individual or narrower.size == weights.size:
            break
        weights = narrower
    return best
