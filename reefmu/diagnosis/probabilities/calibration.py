"""Probabilities of the hypotheses, calibrated on simulated records: of 100 hypotheses with 80 %, about 80 are true.

How what is known of a hypothesis changes its odds stands in `reefmu.diagnosis.calibrated_odds`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import astuple

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..calibrated_odds import CALIBRATED, DEGREES_OF_FREEDOM, HypothesisWeights, flattened
from ..hypotheses import Hypothesis
from .hypothesis_table import Row
from .priors import NO_PRIORS, Priors


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


def features(rows: Sequence[Row], degrees_of_freedom: float = DEGREES_OF_FREEDOM) -> Array:
    """(r, 6) what is known of each row, in the order of `HypothesisWeights`; degrees_of_freedom: of `flattened`."""
    log_evidence = np.array([row.log_evidence for row in rows], float)
    shows = np.array([row.unnamed and not row.is_hidden for row in rows])
    best = {shown: float(log_evidence[shows == shown].max()) for shown in set(shows.tolist())}
    below = np.array([best[shown] for shown in shows.tolist()]) - log_evidence
    ahead = best[True] - best[False] if len(best) == 2 else 0.0
    beside = math.copysign(float(flattened(abs(ahead), degrees_of_freedom)), ahead)
    known = [
        -flattened(below, degrees_of_freedom),
        beside * shows,
        [len(row.effects) for row in rows],
        shows,
        [row.is_hidden for row in rows],
        [not row.effects and not row.unnamed for row in rows],
    ]
    return np.array(known, float).T
