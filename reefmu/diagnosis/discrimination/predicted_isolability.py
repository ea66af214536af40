"""Predicted probabilities: which effect a diagnosis would name while another is true, and from which size.

The score statistics of all hypotheses are jointly Gaussian, with the information matrix of their columns as covariance
and its product with the true trace as mean. A Monte Carlo simulation therefore draws a few numbers instead of a record.
A hypothesis' evidence is its marginal likelihood over Gaussian priors on its amplitudes, in closed form, averaged over
its variants; probabilities follow from it as in the diagnosis, and a hypothesis is named as there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr, logsumexp

from stiffness_model.numerics.arrays import Array

from ..calibrated_odds import NAMED, log_odds
from .effect_columns import Variant
from .rival_hypotheses import RivalHypothesis

SIZES = tuple(float(x) for x in 10.0 ** np.linspace(-2.0, 1.0, 13))
"""Sizes, over the typical ones, at which the probability of a name is computed: a factor of 1.8 apart, interpolated."""
DRAWS, DRAWS_BY_SIZE = 100, 40
"""Draws of the noise for each true trace, at the typical size and at the others. With four traces and two records the
standard errors of a probability are below 1.8 and 2.8 percentage points."""


@dataclass(frozen=True)
class PredictedIsolability:
    """names: of the hypotheses that are named, columns of the matrix before the last; true: of those that are true,
    rows of the matrix after the first; matrix: (1 + t, h + 1), probability of each name (last column: of none) while
    nothing (first row) or a hypothesis is true; sizes: (f,); power: (t, f), probability of the right name by size, in
    typical sizes; standard_error: (t,) of the amplitude, in typical sizes, without rivals, median over the traces.
    """

    names: tuple[str, ...]
    true: tuple[str, ...]
    matrix: Array
    sizes: Array
    power: Array
    standard_error: Array

    def named_right(self, label: str) -> float:
        """Probability of the right name at the typical size."""
        return float(self.matrix[1 + self.true.index(label), self.names.index(label)])

    def named_from(self, label: str, power: float) -> float | None:
        """Least size, in typical sizes, at which the right name has this probability; None where none does."""
        curve = self.power[self.true.index(label)]
        above = np.flatnonzero(curve >= power)
        if not above.size:
            return None
        k = int(above[0])
        if k == 0:
            return float(self.sizes[0])
        share = (power - curve[k - 1]) / max(curve[k] - curve[k - 1], 1e-12)
        return float(np.exp(np.interp(share, [0, 1], np.log(self.sizes[k - 1 : k + 1]))))


def isolability(
    information: Array,
    true: Sequence[RivalHypothesis],
    candidates: Sequence[RivalHypothesis],
    sizes: Sequence[float] = SIZES,
    draws: tuple[int, int] = (DRAWS, DRAWS_BY_SIZE),
    seed: int = 0,
) -> PredictedIsolability:
    """The probabilities for hypotheses `true`, each of which is among the `candidates`.

    information: (k, k) of the effects' columns, orthogonal to the base model. draws: of the noise, at the typical size
    and at each of `sizes`.
    """
    rng = np.random.default_rng(np.random.SeedSequence([seed, len(information)]))
    values, vectors = np.linalg.eigh(information)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    evidence = [_Evidence(information, h) for h in candidates]
    count = np.array([0, *(len(h.names) for h in candidates)])

    def names(traces: Array) -> NDArray[np.intp]:
        """(d,) name, an index of the candidates or their number for none, for one draw of each true trace (d, k)."""
        scores = traces @ information + rng.standard_normal(traces.shape) @ root.T
        log = np.stack([np.zeros(len(traces)), *(e.log_evidence(scores) for e in evidence)], axis=1)
        odds = log_odds(log.max(axis=1, keepdims=True) - log, count)
        log_posterior = odds[:, 1:] - np.asarray(logsumexp(odds, axis=1, keepdims=True))
        best = log_posterior.argmax(axis=1)
        return np.where(log_posterior[np.arange(len(best)), best] >= np.log(NAMED), best, len(candidates))

    def shares(found: NDArray[np.intp]) -> Array:
        return np.bincount(found, minlength=len(candidates) + 1) / len(found)

    matrix = [shares(names(np.zeros((4 * draws[0], len(root)))))]
    power, errors = np.zeros((len(true), len(sizes))), np.zeros(len(true))
    labels = [h.label for h in candidates]
    for row, h in enumerate(true):
        traces = np.zeros((len(h.truths), len(root)))
        for k, columns in enumerate(h.truths):
            traces[k, list(columns)] = 1.0
        strength = np.maximum(((traces @ information) * traces).sum(axis=1), 0.0)
        errors[row] = 1 / np.sqrt(max(float(np.median(strength)), 1e-30))
        scaled = [np.repeat(traces, draws[0], axis=0)]
        scaled += [size * np.repeat(traces, draws[1], axis=0) for size in sizes]
        found = np.split(names(np.concatenate(scaled)), np.cumsum([len(part) for part in scaled])[:-1])
        matrix.append(shares(found[0]))
        own = labels.index(h.label)
        power[row] = [float(np.mean(part == own)) for part in found[1:]]
    return PredictedIsolability(
        tuple(labels), tuple(h.label for h in true), np.array(matrix), np.array(sizes), power, errors
    )


def mean_isolability(found: Sequence[PredictedIsolability]) -> PredictedIsolability:
    """The mean over several records with the same hypotheses."""
    return replace(
        found[0],
        matrix=np.mean([f.matrix for f in found], axis=0),
        power=np.mean([f.power for f in found], axis=0),
        standard_error=np.mean([f.standard_error for f in found], axis=0),
    )


class _Evidence:
    """Log evidence of one hypothesis over that of nothing, for many draws of the scores."""

    def __init__(self, information: Array, hypothesis: RivalHypothesis) -> None:
        self._parts = [_Marginal.of(information, parts) for parts in hypothesis.variants]

    def log_evidence(self, scores: Array) -> Array:
        """(d,) for scores (d, k)."""
        log = np.stack([part.log_evidence(scores) for part in self._parts])
        return np.asarray(logsumexp(log, axis=0)) - np.log(len(self._parts))


@dataclass(frozen=True)
class _Marginal:
    """Marginal likelihood of one combination of variants: amplitudes a with prior N(mean, 1/precision)."""

    columns: list[int]
    one_sided: NDArray[np.bool_]
    pull: Array
    covariance: Array
    constant: float

    @classmethod
    def of(cls, information: Array, parts: tuple[Variant, ...]) -> _Marginal:
        columns = [k for v in parts for k in v.columns]
        # Changes of shape have standard deviation 1 too, in `SHAPE_STEP`, as the amplitude that they are products with.
        prior = [v.prior(k) for v in parts for k in range(len(v.columns))]
        one_sided = np.array([v.is_one_sided(k) for v in parts for k in range(len(v.columns))])
        mean, precision = np.array([m for m, _ in prior]), np.array([1 / s**2 for _, s in prior])
        covariance = np.asarray(np.linalg.inv(information[np.ix_(columns, columns)] + np.diag(precision)), float)
        constant = 0.5 * float(np.linalg.slogdet(covariance)[1] + np.log(precision).sum() - precision @ mean**2)
        return cls(columns, one_sided, precision * mean, covariance, constant)

    def log_evidence(self, scores: Array) -> Array:
        """(d,) log marginal likelihood over that of nothing; half-normal priors for amplitudes of one sign.

        For several amplitudes of one sign the probabilities of their signs are multiplied as if independent.
        """
        b = scores[:, self.columns] + self.pull
        mean = b @ self.covariance
        log = 0.5 * (b * mean).sum(axis=1) + self.constant
        if self.one_sided.any():
            held = np.flatnonzero(self.one_sided)
            z = mean[:, held] / np.sqrt(np.diag(self.covariance))[held]
            log = log + (np.log(2) + np.asarray(log_ndtr(z))).sum(axis=1)
        return log
