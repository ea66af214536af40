"""Probabilities of the hypotheses, calibrated on simulated records: of 100 hypotheses with 80 %, about 80 are true.

Evidence alone is overconfident, because no covariance is quite right. The log posterior of a hypothesis is therefore
a weighted sum of what is known of it, a conditional logit model (McFadden, Conditional Logit Analysis of Qualitative
Choice Behavior, 1974): its evidence, less than that of the best; its number of effects; whether something unnamed is
part of it; how far the scatter that it needs is from the drawing's; and whether the tests of significance arrive at it.
The weights maximise the likelihood of the truths of simulated records whose kind of effect, rig and drive are known.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import astuple, dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ..hypotheses import Hypothesis
from .hypothesis_table import Row
from .priors import NO_PRIORS, Priors


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

    def is_nothing(self, row: Row) -> bool:
        """Whether the verdict and the row are both that nothing is missing."""
        return self.name == "none" and not row.effects and not row.unnamed


@dataclass(frozen=True)
class HypothesisWeights:
    """Change of the log posterior: by the logarithm of one more than the difference of the log evidence from the best,
    by each effect, by something unnamed, by that beside effects, by the squared logarithm of the scatter over the
    drawing's, by a verdict that gives the effects, and by one that nothing is missing."""

    evidence: float
    effect: float
    unnamed: float
    unnamed_beside: float
    scatter: float
    verdict: float
    nothing: float


CALIBRATED = HypothesisWeights(1.55, -1.38, -4.44, -1.52, -1.25, 2.62, 1.44)
"""Fitted by `tests/benchmarks/diagnosis/calibrate_probabilities.py --count 240`. Odds fall with a power of the
difference of the log evidence and not exponentially, as a covariance that is wrong in unknown directions makes them."""


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
    """(r, 7) what is known of each row, in the order of `HypothesisWeights`."""
    below = np.array([row.log_evidence for row in rows])
    below = below - below.max()
    return np.array(
        [
            (
                -np.log1p(-difference),
                len(row.effects),
                row.unnamed,
                row.unnamed and len(row.effects) > 0,
                np.log(row.scatter) ** 2 if row.scatter else 0.0,
                verdict.gives(row),
                verdict.is_nothing(row),
            )
            for row, difference in zip(rows, below.tolist(), strict=True)
        ],
        float,
    )


def verdict_of(name: str, chosen: Collection[str], alternatives: Collection[Collection[str]]) -> Verdict:
    """A verdict by its name, the effects that were chosen and, where it is ambiguous, the sets that may be instead."""
    others = alternatives if name == "ambiguous" else ()
    return Verdict(name, (frozenset(chosen), *(frozenset(names) for names in others)))
