"""From evidence to odds: how much less likely a hypothesis is whose evidence falls short of the best.

Evidence alone is overconfident, because no covariance is quite right. The log posterior of a hypothesis is therefore
a weighted sum of what is known of it, a nested logit model (McFadden, Modelling the Choice of Residential Location,
1978): whether something unnamed shows, by the best evidence with and without it; among such hypotheses, the evidence of
each, less than that of the best of them; its number of effects; that something unnamed shows, or that it is too small
to show; or that nothing is missing. What no covariance holds is alike beside every set of effects: it must not decide
between them. The weights follow from the truths of simulated records whose kind of effect, rig and drive are known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array


@dataclass(frozen=True)
class HypothesisWeights:
    """Change of the log posterior of a hypothesis.

    evidence: by `flattened` of the difference of the log evidence from the best of those with something unnamed that
    shows, or of those without, with a minus; unnamed_evidence: where it shows, by `flattened` of that by which the best
    of them is better, with its sign; effect: by each effect; unnamed: where something unnamed shows; hidden: where
    something unnamed is missing that the record does not show; nothing: where nothing is missing.
    """

    evidence: float
    unnamed_evidence: float
    effect: float
    unnamed: float
    hidden: float
    nothing: float

    @property
    def first_effect(self) -> float:
        """Change of the log posterior of one effect over that of nothing."""
        return self.effect - self.nothing


CALIBRATED = HypothesisWeights(1.09, 0.56, -3.54, -3.45, -3.68, -1.53)
"""Fitted by `tests/benchmarks/probabilities/calibrate_probabilities.py --count 49 --second 90` to 49 records of one
generator and 359 of another, whose individuals deviate in other ways: by themselves they give 1.16, 0.55, -2.44, -2.70,
-2.80 and 1.24, and 1.08, 0.56, -3.57, -3.29, -3.68 and -1.74. Without the second weight the log score is less by 0.10,
without the last one by 0.05."""
DEGREES_OF_FREEDOM = 4.0
"""Of Student's distribution, by which log odds grow with the logarithm of a large difference of the log evidence: the
variance of noise and scatter, and the laws of effects, are known no better than from so many residuals. Chosen among 1,
2, 4, 8, 16 and 32 by the log score of 229 other records; that of the records above is -0.961, -0.936, -0.922, -0.919,
-0.926 and -0.940."""
PRIOR_WIDTH = 1.0
"""Half-width of the prior of an amplitude, over its typical size: by definition of that size."""
NAMED = 0.6
"""Probability from which effects are named. A wrong name is taken to cost as much as one and a half records that are
left undecided, so that naming pays where it is wrong in less than two cases of five; chosen by judgement."""


def flattened(below: Array | float, degrees_of_freedom: float = DEGREES_OF_FREEDOM) -> Array:
    """Differences of the log evidence, of any shape, as they count in log odds: themselves where they are small, and
    their logarithms where they are large."""
    half = degrees_of_freedom / 2
    return half * np.log1p(np.asarray(below, float) / half)


def log_odds(below: Array | float, effects: Array | int) -> Array:
    """Log odds of sets of effects with nothing unnamed beside, up to a constant.

    below: differences of their log evidence from the best, any shape; effects: their numbers of effects, which
    broadcast.
    """
    count = np.asarray(effects, float)
    prior = CALIBRATED.effect * count + CALIBRATED.nothing * (count == 0)
    return prior - CALIBRATED.evidence * flattened(below)


def least_evidence(wanted: float) -> float:
    """Difference of the log evidence that gives some log odds, 0 for those below 0.

    >>> round(CALIBRATED.evidence * float(flattened(least_evidence(3.0))), 6)
    3.0
    """
    half = DEGREES_OF_FREEDOM / 2
    return half * float(np.expm1(max(wanted, 0.0) / (half * CALIBRATED.evidence)))
