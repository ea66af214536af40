"""Probabilities of the hypotheses, calibrated on simulated records: of 100 hypotheses with 80 %, about 80 are true.

How what is known of a hypothesis changes its odds stands in `reefmu.diagnosis.calibrated_odds`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..calibrated_odds import CALIBRATED, HypothesisWeights, flattened
from ..hypotheses import Hypothesis
from .hypothesis_table import Row
from .priors import NO_PRIORS, Priors

SMALLEST_UNNAMED = 1e-3
"""Size of something unnamed, over full torque, below which it is invisible whatever it is; chosen by judgement, because
its logarithm must stay finite."""


def probabilities(
    rows: Sequence[Row], priors: Priors = NO_PRIORS, weights: HypothesisWeights = CALIBRATED
) -> tuple[Hypothesis, ...]:
    """The hypotheses of a table with their probabilities, which sum to 1.

    priors: of a user, which change the odds of effects.
    """
    log_odds = np.array([priors.log_odds(row.effects, row.unnamed) for row in rows])
    log_posterior = features(rows) @ np.array(astuple(weights)) + log_odds
    share = np.exp(log_posterior - log_posterior.max())
    share /= share.sum()
    return tuple(
        Hypothesis(tuple(sorted(row.effects)), row.unnamed, float(p)) for row, p in zip(rows, share, strict=True)
    )


def features(rows: Sequence[Row]) -> Array:
    """(r, 5) what is known of each row, in the order of `HypothesisWeights`."""
    best = max(row.log_evidence for row in rows)
    return np.array([_features(row, best - row.log_evidence) for row in rows], float)


def _features(row: Row, below: float) -> tuple[float, ...]:
    """below: difference of the log evidence from the best."""
    return (
        -float(flattened(below)),
        len(row.effects),
        math.log(max(row.unnamed_share, SMALLEST_UNNAMED)) if row.unnamed_share else 0.0,
        float(row.is_hidden),
        float(not row.effects and not row.unnamed),
    )
