"""Evidence of combinations of variants from their scores: marginal likelihoods over Gaussian priors of amplitudes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_ndtr

from stiffness_model.numerics.arrays import Array

from .effect_columns import Variant


@dataclass(frozen=True)
class _Combinations:
    """g combinations of variants with c columns each, whose amplitudes have the prior N(mean, 1/precision).

    index: (g,), among all combinations; columns, one_sided: (g, c), indices of the columns and whether their amplitudes
    have one sign; pull: (g, c), precision times mean; covariance: (g, c, c), posterior one; constant: (g,), part of the
    log evidence that no score changes.
    """

    index: NDArray[np.intp]
    columns: NDArray[np.intp]
    one_sided: NDArray[np.bool_]
    pull: Array
    covariance: Array
    constant: Array

    @classmethod
    def of(
        cls, information: Array, index: NDArray[np.intp], combinations: Sequence[tuple[Variant, ...]]
    ) -> _Combinations:
        """The combinations of a number `index` each, of columns with an information (k, k)."""
        each = [[(v, k) for v in parts for k in range(len(v.columns))] for parts in combinations]
        columns = np.array([[v.columns[k] for v, k in own] for own in each])
        one_sided = np.array([[v.is_one_sided(k) for v, k in own] for own in each])
        prior = np.array([[v.prior(k) for v, k in own] for own in each])
        mean, precision = prior[:, :, 0], 1 / prior[:, :, 1] ** 2
        inside = information[columns[:, :, None], columns[:, None, :]]
        covariance = np.asarray(np.linalg.inv(inside + precision[:, :, None] * np.eye(columns.shape[1])), float)
        log_widths = np.linalg.slogdet(covariance)[1] + np.log(precision).sum(axis=1)
        constant = 0.5 * (log_widths - (precision * mean**2).sum(axis=1))
        return cls(index, columns, one_sided, precision * mean, covariance, constant)

    def log_evidence(self, scores: Array) -> Array:
        """(g, d) log marginal likelihood over that of nothing, for scores (d, k); half-normal priors of one sign.

        For several amplitudes of one sign the probabilities of their signs are multiplied as if independent.
        """
        b = scores.T[self.columns].transpose(0, 2, 1) + self.pull[:, None, :]
        mean = b @ self.covariance
        log = 0.5 * (b * mean).sum(axis=2) + self.constant[:, None]
        held, column = np.nonzero(self.one_sided)
        if held.size:
            z = mean[held, :, column] / np.sqrt(self.covariance[held, column, column])[:, None]
            np.add.at(log, held, np.log(2) + np.asarray(log_ndtr(z)))
        return log


class AmplitudeEvidence:
    """Log evidence of n combinations of variants, whose columns have an information (k, k), for scores of records."""

    def __init__(self, information: Array, combinations: Sequence[tuple[Variant, ...]]) -> None:
        self._information = information
        width = np.array([sum(len(v.columns) for v in parts) for parts in combinations], int)
        self._groups = [
            _Combinations.of(information, index, [combinations[k] for k in index.tolist()])
            for index in (np.flatnonzero(width == w) for w in np.unique(width))
        ]
        self._place = {n: (group, k) for group in self._groups for k, n in enumerate(group.index.tolist())}
        self._constant = np.zeros(len(combinations))
        for group in self._groups:
            self._constant[group.index] = group.constant

    def log_evidence(self, scores: Array) -> Array:
        """(n, d) log marginal likelihood over that of nothing, for scores (d, k)."""
        found = np.empty((len(self._constant), len(scores)))
        for group in self._groups:
            found[group.index] = group.log_evidence(scores)
        return found

    def gain(self, log_evidence: Array) -> Array:
        """(n, d) gain in -2 log likelihood of the fitted amplitudes, none of which has the wrong sign."""
        return 2 * (log_evidence - self._constant[:, None])

    def information_beside(self, n: int) -> Array:
        """(k, k) information of all columns beside combination n, whose amplitudes are fitted."""
        group, k = self._place[n]
        across = self._information[group.columns[k]]
        return self._information - across.T @ group.covariance[k] @ across

    def scores_beside(self, n: int, scores: Array) -> Array:
        """(d, k) scores of all columns beside combination n."""
        group, k = self._place[n]
        fitted = (scores[:, group.columns[k]] + group.pull[k]) @ group.covariance[k]
        return scores - fitted @ self._information[group.columns[k]]
