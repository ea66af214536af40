"""From evidence to odds: how much less likely a hypothesis is whose evidence falls short of the best.

Evidence alone is overconfident, because no covariance is quite right. The log posterior of a hypothesis is therefore
a weighted sum of what is known of it, a conditional logit model (McFadden, Conditional Logit Analysis of Qualitative
Choice Behavior, 1974): its evidence, less than that of the best; its number of effects; how large what is unnamed is;
or that something unnamed is too small to show. The weights follow from the truths of simulated records whose kind of
effect, rig and drive are known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array


@dataclass(frozen=True)
class HypothesisWeights:
    """Change of the log posterior of a hypothesis.

    evidence: by `flattened` of the difference of the log evidence from the best, with a minus; effect: by each effect;
    unnamed_size: by the logarithm of the rms of what is unnamed, over full torque; hidden: where something unnamed is
    missing that the record does not show.
    """

    evidence: float
    effect: float
    unnamed_size: float
    hidden: float


CALIBRATED = HypothesisWeights(1.05, -2.65, 1.62, -2.50)
"""Fitted by `tests/benchmarks/probabilities/calibrate_probabilities.py --count 93 --second 90` to 93 records of one
generator and 90 of another, whose individuals deviate in other ways: by themselves they give 0.97, -2.79, 2.30 and
-2.51, and 1.29, -2.26, 1.24 and -2.23. Further weights, of nothing missing, of something unnamed that shows and of
effects beside what does not, change the log score by 0.00, 0.01 and 0.00."""
DEGREES_OF_FREEDOM = 4.0
"""Of Student's distribution, by which log odds grow with the logarithm of a large difference of the log evidence: the
variance of noise and scatter, and the laws of effects, are known no better than from so many residuals. Chosen among 1,
2, 4, 8, 16 and 32 by the log score of the same records: -1.13, -1.12, -1.12, -1.14, -1.16 and -1.17; the root of the
evidence in its place has -1.15, the evidence itself -1.30."""
PRIOR_WIDTH = 1.0
"""Half-width of the prior of an amplitude, over its typical size: by definition of that size."""
NAMED = 0.6
"""Probability from which effects are named. A wrong name is taken to cost as much as one and a half records that are
left undecided, so that naming pays where it is wrong in less than two cases of five; chosen by judgement."""


def flattened(below: Array | float) -> Array:
    """Differences of the log evidence, of any shape, as they count in log odds: themselves where they are small, and
    their logarithms where they are large."""
    half = DEGREES_OF_FREEDOM / 2
    return half * np.log1p(np.asarray(below, float) / half)


def log_odds(below: Array | float, effects: Array | int) -> Array:
    """Log odds of sets of effects with nothing unnamed beside, up to a constant.

    below: differences of their log evidence from the best, any shape; effects: their numbers of effects, which
    broadcast.
    """
    return CALIBRATED.effect * effects - CALIBRATED.evidence * flattened(below)


def least_evidence(wanted: float) -> float:
    """Difference of the log evidence that gives some log odds, 0 for those below 0.

    >>> round(CALIBRATED.evidence * float(flattened(least_evidence(3.0))), 6)
    3.0
    """
    half = DEGREES_OF_FREEDOM / 2
    return half * float(np.expm1(max(wanted, 0.0) / (half * CALIBRATED.evidence)))
