"""Probabilities of the hypotheses, calibrated on simulated records: of 100 hypotheses with 80 %, about 80 are true.

Evidence alone is overconfident, because no covariance is quite right. The log posterior of a hypothesis is therefore
a weighted sum of what is known of it, a conditional logit model (McFadden, Conditional Logit Analysis of Qualitative
Choice Behavior, 1974): its evidence, less than that of the best; its number of effects; whether something unnamed is
part of it, and how large that is; how far the scatter that it needs is from the drawing's; and whether, or how nearly,
the tests of significance arrive at it.
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
"""Size of something unnamed, over full torque or over what individuals show, below which it is invisible whatever it
is; chosen by judgement, because its logarithm must stay finite."""


@dataclass(frozen=True)
class Verdict:
    """What the tests of significance arrive at. name: of the verdict; sets: of effects that it gives, several where it
    is ambiguous."""

    name: str
    sets: tuple[frozenset[str], ...]

    def gives(self, row: Row) -> bool:
        """Whether the verdict gives the effects of a row."""
        if not row.effects or row.effects not in self.sets:
            return False
        return self.name in ("named", "partly") or (self.name == "ambiguous" and not row.unnamed)

    def finds_unnamed(self, row: Row) -> bool:
        """Whether the verdict and the row have something unnamed. Tests of significance tell it from the scatter of an
        individual no better than the evidence does, so that only the row of a mean drive counts."""
        return self.name in ("unknown", "partly") and row.unnamed and not row.scatter

    def is_nothing(self, row: Row) -> bool:
        """Whether the verdict and the row are both that nothing is missing, of a mean drive as well."""
        return self.name == "none" and not row.effects and not row.unnamed and not row.scatter

    def difference(self, row: Row) -> int:
        """Number of effects that only one of the row and the nearest set of the verdict has."""
        return min(len(row.effects ^ effects) for effects in self.sets)


@dataclass(frozen=True)
class HypothesisWeights:
    """Change of the log posterior of a hypothesis.

    evidence: by the square root of the difference of the log evidence from the best; effect: by each
    effect; unnamed, unnamed_beside: by something unnamed, and by that beside effects; scatter: by the squared logarithm
    of the scatter over the drawing's; verdict: by a verdict that gives the effects; differing: by each effect in which
    the verdict differs; unnamed_size, unnamed_excess: by the logarithm of the rms of what is unnamed, over full torque
    and, on an individual, over the rms that individuals without effects show; verdict_unnamed, verdict_nothing: by a
    verdict on a mean drive that finds something unnamed, or nothing, as the hypothesis does.
    """

    evidence: float
    effect: float
    unnamed: float
    unnamed_beside: float
    scatter: float
    verdict: float
    differing: float
    unnamed_size: float
    unnamed_excess: float
    verdict_unnamed: float
    verdict_nothing: float


CALIBRATED = HypothesisWeights(0.48, -2.33, 0.48, -0.17, -0.42, 0.89, -0.48, 0.86, -0.22, 1.79, 1.85)
"""Fitted by `tests/benchmarks/diagnosis/calibrate_probabilities.py` to 555 records. Log odds fall with the root
of the difference of the log evidence and not with the difference, as a covariance that is wrong in unknown directions
makes them; among powers from 0.3 to 1 and the logarithm the root was best."""


def probabilities(
    rows: Sequence[Row], verdict: Verdict, priors: Priors = NO_PRIORS, weights: HypothesisWeights = CALIBRATED
) -> tuple[Hypothesis, ...]:
    """The hypotheses of a table with their probabilities, which sum to 1; priors: of a user, which change the odds of
    effects."""
    log_odds = np.array([priors.log_odds(row.effects, row.unnamed) for row in rows])
    log_posterior = features(rows, verdict) @ np.array(astuple(weights)) + log_odds
    share = np.exp(log_posterior - log_posterior.max())
    share /= share.sum()
    return tuple(
        Hypothesis(tuple(sorted(row.effects)), row.unnamed, float(p)) for row, p in zip(rows, share, strict=True)
    )


def features(rows: Sequence[Row], verdict: Verdict) -> Array:
    """(r, 11) what is known of each row, in the order of `HypothesisWeights`."""
    best = max(row.log_evidence for row in rows)
    return np.array([_features(row, best - row.log_evidence, verdict) for row in rows], float)


def _features(row: Row, below: float, verdict: Verdict) -> tuple[float, ...]:
    """below: difference of the log evidence from the best."""
    return (
        -math.sqrt(below),
        len(row.effects),
        row.unnamed,
        row.unnamed and len(row.effects) > 0,
        math.log(row.scatter) ** 2 if row.scatter else 0.0,
        verdict.gives(row),
        verdict.difference(row),
        math.log(max(row.unnamed_share, SMALLEST_UNNAMED)) if row.unnamed else 0.0,
        math.log(max(row.unnamed_excess, SMALLEST_UNNAMED)) if row.unnamed and row.scatter else 0.0,
        verdict.finds_unnamed(row),
        verdict.is_nothing(row),
    )


def verdict_of(name: str, chosen: Collection[str], alternatives: Collection[Collection[str]]) -> Verdict:
    """A verdict by its name, the effects that were chosen and, where it is ambiguous, the sets that may be instead."""
    others = alternatives if name == "ambiguous" else ()
    return Verdict(name, (frozenset(chosen), *(frozenset(names) for names in others)))
