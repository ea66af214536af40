"""How residuals are weighed: noise at each sample, and what the population scatters as a random effect.

Covariance of n samples: diag(variance) + size^2 U U^T, with U the columns of the scatter. The inverse is Woodbury's;
`size` is 1 for a drive of the population. It is fitted too: a record that shows no scatter (the mean drive, or a
perfect one) shows small effects all the better. A drive that scatters is also rough beyond the columns: from
`INDIVIDUAL_SIZE` on, the samples' own variance holds that too.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import eigh

from stiffness_model.numerics.arrays import Array

SCATTER_SIZES = (0.007, 0.02, 0.06, 0.12, 0.25, 0.5, 0.75, 1.0, 1.4, 2.0, 2.8)
"""Sizes of the scatter that are tried. Those of means of 250 and 2500 drives are among them; the
least is what numbers leave."""
MEAN_DRIVE_SIZE = 0.15
"""Size of the scatter below which a drive counts as the mean drive."""
INDIVIDUAL_SIZE = 0.25
"""Size from which a drive counts as an individual, rough beyond the columns."""
MIN_STRENGTH = 0.3
"""Variance of a component, in units of the noise, below which it no longer matters."""


@dataclass(frozen=True)
class Covariance:
    """scale: (n,) one over the standard deviation of the samples alone; basis: (n, m) orthonormal; strength: (m,)
    variances of the scatter along it at size 1, in units of the samples' own; level: log of the determinant of the
    samples' own covariance, over that of the noise; ratio: (n,) of the noise's variance in it."""

    scale: Array
    basis: Array
    strength: Array
    level: float
    ratio: Array


@dataclass(frozen=True)
class Weighting:
    """mean: for a drive that is (almost) the mean one; individual: for one that scatters; size: of the scatter."""

    mean: Covariance
    individual: Covariance
    size: float

    @property
    def _active(self) -> Covariance:
        return self.individual if self.size >= INDIVIDUAL_SIZE else self.mean

    @property
    def scale(self) -> Array:
        """(n,) one over the standard deviation of the samples alone."""
        return self._active.scale

    @property
    def basis(self) -> Array:
        """(n, m) orthonormal, of the whitened scatter."""
        return self._active.basis

    @property
    def strength(self) -> Array:
        """(m,) variances along the basis at size 1."""
        return self._active.strength

    def whiten(self, values: Array) -> Array:
        """Values (n,) or (n, k), N.m, as independent ones of variance 1."""
        own = self._active
        v = values * (own.scale if values.ndim == 1 else own.scale[:, None])
        shrink = 1 - 1 / np.sqrt(1 + self.size**2 * own.strength)
        along = own.basis.T @ v
        return v - own.basis @ (along * (shrink if values.ndim == 1 else shrink[:, None]))

    @property
    def log_determinant(self) -> float:
        """Of the covariance over the noise's."""
        return float(np.log1p(self.size**2 * self.strength).sum()) + self._active.level

    @property
    def noise_ratio(self) -> Array:
        """Share (n,) of the noise in the variance of the samples alone."""
        return self._active.ratio

    def with_size(self, size: float) -> Weighting:
        """The same with another size of the scatter."""
        return replace(self, size=size)

    def for_mean_drive(self) -> Weighting:
        """For a drive that is known to be no individual: only what a mean of a few drives may be off is left."""
        return replace(self, individual=self.mean, size=SCATTER_SIZES[0])

    def with_likeliest_size(self, residual: Array) -> Weighting:
        """With the size under which the residual (n,), N.m, is most likely."""
        if not len(self.mean.strength):
            return self
        costs = []
        kinds = [(self.mean, [s for s in SCATTER_SIZES if s < INDIVIDUAL_SIZE])]
        if self.individual is not self.mean:
            kinds.append((self.individual, [s for s in SCATTER_SIZES if s >= INDIVIDUAL_SIZE]))
        for own, sizes in kinds:
            v = residual * own.scale
            along = (own.basis.T @ v) ** 2
            spread = 1 + np.array(sizes)[:, None] ** 2 * own.strength
            # The part across the basis is the same for all sizes that share one.
            across = float(v @ v) + own.level
            costs += (across - (along * (1 - 1 / spread)).sum(axis=1) + np.log(spread).sum(axis=1)).tolist()
        return self.with_size(SCATTER_SIZES[int(np.argmin(costs))])


def size_only(size: float) -> Weighting:
    """A size alone, of no samples."""
    none = weighting(np.zeros(0), np.zeros((0, 0)))
    return none.with_size(size)


def is_size_only(weights: Weighting) -> bool:
    """Whether weights are a size alone."""
    return len(weights.scale) == 0


def weighting(variance: Array, scatter: Array, residual_variance: Array | None = None, size: float = 1.0) -> Weighting:
    """From variances (n,) of the samples' noise, (N.m)^2, columns of the scatter (m, n), N.m, or (0, n), and the
    variance (n,) by which an individual is rough beyond them.
    """
    mean = _covariance(variance, scatter, 0.0, np.ones(len(variance)))
    if residual_variance is None or not len(scatter):
        return Weighting(mean, mean, size)
    level = float(np.log1p(residual_variance / variance).sum())
    return Weighting(
        mean, _covariance(variance + residual_variance, scatter, level, variance / (variance + residual_variance)), size
    )


def _covariance(variance: Array, scatter: Array, level: float, ratio: Array) -> Covariance:
    scale = 1 / np.sqrt(variance)
    if not len(scatter):
        return Covariance(scale, np.zeros((len(scale), 0)), np.zeros(0), level, ratio)
    rows = scatter * scale
    values, vectors = eigh(rows @ rows.T, subset_by_value=(MIN_STRENGTH, np.inf), check_finite=False)
    basis = np.ascontiguousarray((vectors.T @ rows).T / np.sqrt(values))
    return Covariance(scale, basis, values, level, ratio)
