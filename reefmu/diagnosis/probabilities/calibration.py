"""Probabilities of the hypotheses, calibrated on simulated records: of 100 hypotheses with 80 %, about 80 are true.

Evidence alone is overconfident, because no covariance is quite right. The log posterior of a hypothesis is therefore
a weighted sum of what is known of it, a conditional logit model (McFadden, Conditional Logit Analysis of Qualitative
Choice Behavior, 1974): its evidence, less than that of the best; its number of effects; in how many effects the tests
of significance differ from it; and how large what is unnamed is, if anything.
The weights maximise the likelihood of the truths of simulated records whose kind of effect, rig and drive are known.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import astuple, dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..hypotheses import Hypothesis
from .hypothesis_table import Row
from .priors import NO_PRIORS, Priors

SMALLEST_UNNAMED = 1e-3
"""Size of something unnamed, over full torque, below which it is invisible whatever it is; chosen by judgement, because
its logarithm must stay finite."""


@dataclass(frozen=True)
class HypothesisWeights:
    """Change of the log posterior of a hypothesis.

    evidence: by the square root of the difference of the log evidence from the best; effect: by each effect; differing:
    by each effect in which the nearest set that the tests of significance arrive at differs; unnamed_size: by the
    logarithm of the rms of what is unnamed, over full torque.
    """

    evidence: float
    effect: float
    differing: float
    unnamed_size: float


CALIBRATED = HypothesisWeights(0.47, -2.07, -1.06, 0.61)
"""Fitted by `tests/benchmarks/diagnosis/calibrate_probabilities.py` to 326 records. Log odds fall with the root of the
difference of the log evidence and not with the difference, as a covariance that is wrong in unknown directions makes
them; among the logarithm and powers from 0.3 to 1 those from 0.3 to 0.5 are alike, and the others worse. Seven further
features did not improve the cross-validated likelihood."""


def probabilities(
    rows: Sequence[Row],
    tested: Collection[frozenset[str]],
    priors: Priors = NO_PRIORS,
    weights: HypothesisWeights = CALIBRATED,
) -> tuple[Hypothesis, ...]:
    """The hypotheses of a table with their probabilities, which sum to 1.

    tested: the sets of effects at which the tests of significance arrive, several where they are ambiguous; priors: of
    a user, which change the odds of effects.
    """
    log_odds = np.array([priors.log_odds(row.effects, row.unnamed) for row in rows])
    log_posterior = features(rows, tested) @ np.array(astuple(weights)) + log_odds
    share = np.exp(log_posterior - log_posterior.max())
    share /= share.sum()
    return tuple(
        Hypothesis(tuple(sorted(row.effects)), row.unnamed, float(p)) for row, p in zip(rows, share, strict=True)
    )


def features(rows: Sequence[Row], tested: Collection[frozenset[str]]) -> Array:
    """(r, 4) what is known of each row, in the order of `HypothesisWeights`."""
    best = max(row.log_evidence for row in rows)
    return np.array([_features(row, best - row.log_evidence, tested) for row in rows], float)


def _features(row: Row, below: float, tested: Collection[frozenset[str]]) -> tuple[float, ...]:
    """below: difference of the log evidence from the best."""
    return (
        -math.sqrt(below),
        len(row.effects),
        min(len(row.effects ^ effects) for effects in tested),
        math.log(max(row.unnamed_share, SMALLEST_UNNAMED)) if row.unnamed else 0.0,
    )
