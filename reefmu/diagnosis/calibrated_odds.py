"""From evidence to odds: how much less likely a hypothesis is whose evidence falls short of the best.

Evidence alone is overconfident, because no covariance is quite right. The log posterior of a hypothesis is therefore
a weighted sum of what is known of it, a conditional logit model (McFadden, Conditional Logit Analysis of Qualitative
Choice Behavior, 1974): its evidence, less than that of the best; its number of effects; and how large what is unnamed
is, if anything. The weights follow from the truths of simulated records whose kind of effect, rig and drive are known.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array


@dataclass(frozen=True)
class HypothesisWeights:
    """Change of the log posterior of a hypothesis.

    evidence: by `flattened` of the difference of the log evidence from the best, with a minus; effect: by each effect;
    unnamed_size: by the logarithm of the rms of what is unnamed, over full torque.
    """

    evidence: float
    effect: float
    unnamed_size: float


CALIBRATED = HypothesisWeights(1.1, -2.15, 1.15)
"""Halfway between the weights that are fitted to the first 70 records of
`tests/benchmarks/probabilities/calibrate_probabilities.py --count 127`, 1.61, -1.67 and 1.68, and those that were
fitted to 179 under a covariance that was less right, 0.62, -2.63 and 0.62: gears whose parts deviate in other ways than
the simulated ones are known less well. Log odds fall with small differences of the log evidence, and with the root of
large ones, as a covariance or laws that are wrong in unknown directions make them: the root is as good as the power
0.35 and better than 0.7 and 1. The size of the scatter, and whether the curve of the mean drive would have to be off,
have weights that change no score by 0.01."""
PRIOR_WIDTH = 20.0
"""Half-width of the prior of an amplitude, over its typical size. Chosen among 1, 5, 20 and 50 by the calibration of
the probabilities, where 20 and 50 are alike and smaller widths worse: a prior that hardly prefers any size."""
NAMED = 0.6
"""Probability from which effects are named. A wrong name is taken to cost as much as one and a half records that are
left undecided, so that naming pays where it is wrong in less than two cases of five; chosen by judgement."""


def flattened(below: Array | float) -> Array:
    """Differences of the log evidence, of any shape, as they count in log odds: half of those that are small, and the
    root of those that are large."""
    return np.sqrt(1.0 + np.asarray(below, float)) - 1.0


def log_odds(below: Array, effects: Array) -> Array:
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
    return (1.0 + max(wanted, 0.0) / CALIBRATED.evidence) ** 2 - 1.0
