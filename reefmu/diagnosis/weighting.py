"""How residuals are weighed: noise at each sample, and what the population scatters as a random effect.

Covariance of n samples: diag(variance) + size^2 U U^T, with U the principal components of the scatter. The
inverse is Woodbury's; `size` is 1 for a drive of the population. It is fitted too: a record that shows no
scatter (the mean drive, or a perfect one) shows small effects all the better.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

SIZES = (0.06, 0.12, 0.25, 0.5, 0.75, 1.0, 1.4)
"""Sizes of the scatter that are tried. The least is the error of a mean of some 250 drives."""
MOST_COMPONENTS = 420
LEAST_STRENGTH = 0.3
"""Variance of a component, in units of the noise, below which it no longer matters."""


@dataclass(frozen=True)
class Weighting:
    """scale: (n,) one over the standard deviation; basis: (n, m) orthonormal; strength: (m,) variances of the
    scatter along it at size 1, in units of the noise; size: of the scatter."""

    scale: Array
    basis: Array
    strength: Array
    size: float

    def white(self, values: Array) -> Array:
        """Values (n,) or (n, k), N.m, as independent ones of variance 1."""
        v = values * (self.scale if values.ndim == 1 else self.scale[:, None])
        shrink = 1 - 1 / np.sqrt(1 + self.size**2 * self.strength)
        along = self.basis.T @ v
        return v - self.basis @ (along * (shrink if values.ndim == 1 else shrink[:, None]))

    @property
    def log_determinant(self) -> float:
        """Of the covariance over the noise's."""
        return float(np.log1p(self.size**2 * self.strength).sum())

    def with_size(self, size: float) -> Weighting:
        """The same with another size of the scatter."""
        return replace(self, size=size)

    def best_size(self, residual: Array) -> Weighting:
        """With the size under which the residual (n,), N.m, is most likely."""
        if not len(self.strength):
            return self
        v = residual * self.scale
        along = (self.basis.T @ v) ** 2
        sizes = np.array(SIZES)
        spread = 1 + sizes[:, None] ** 2 * self.strength
        cost = (along / spread + np.log(spread)).sum(axis=1)
        return self.with_size(float(sizes[cost.argmin()]))


def weighting(variance: Array, scatter: Array, size: float = 1.0) -> Weighting:
    """From variances (n,) of the samples' noise, (N.m)^2, and components of the scatter (m, n), N.m, or (0, n)."""
    scale = 1 / np.sqrt(variance)
    if not len(scatter):
        return Weighting(scale, np.zeros((len(scale), 0)), np.zeros(0), size)
    rows = scatter * scale
    values, vectors = np.linalg.eigh(rows @ rows.T)
    values, vectors = values[::-1], vectors[:, ::-1]
    keep = min(MOST_COMPONENTS, max(1, int((values > LEAST_STRENGTH).sum())))
    basis = (vectors[:, :keep].T @ rows).T / np.sqrt(values[:keep])
    return Weighting(scale, basis, values[:keep], size)
