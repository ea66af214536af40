"""Covariance of the residuals: noise of every block, and the scatter of the population as a random effect.

The covariance of n blocks is diag(variance) + size^2 U U^T; the columns of U are what one standard deviation of each
random effect does. It is inverted by the Woodbury identity. `size` is 1 for an individual drive of the population and
is estimated with every fit: a record without scatter (of the mean drive, or of a drive better than its tolerances)
shows smaller effects. An individual drive also deviates in ways that the columns do not span; from `INDIVIDUAL_SIZE`
on, the diagonal holds that variance too, and how large it is, the roughness, is estimated with the size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from stiffness_model.numerics.arrays import Array

SCATTER_SIZES = (0.007, 0.02, 0.06, 0.12, 0.25, 0.5, 0.75, 1.0, 1.4, 2.0, 2.8)
"""Grid on which the size of the scatter is estimated. The mean of N drives scatters by 1/sqrt(N): 0.06 stands for 250
drives, 0.02 for 2500; 0.007 is about the error of the tables. The spacing was chosen by judgement."""
MEAN_DRIVE_SIZE = 0.15
"""Greatest size of the scatter at which a drive counts as the mean drive. Chosen by judgement, between the mean of a
few dozen drives and an individual drive."""
INDIVIDUAL_SIZE = 0.25
"""Least size of the scatter at which a drive counts as an individual drive, with the variance beyond the columns.
Chosen by judgement."""
MIN_EIGENVALUE = 0.3
"""Least variance of a principal component, over that of the noise, that is kept. Chosen by judgement: a component well
below the noise changes no decision."""


@dataclass(frozen=True)
class Covariance:
    """Diagonal plus low rank, in units of the diagonal.

    scale: (n,) 1/(N.m), reciprocal standard deviations of the diagonal; basis: (n, m), orthonormal principal components
    of the whitened scatter; eigenvalues: (m,), their variances at size 1; log_determinant: of the diagonal over that
    of the noise; noise_share: (n,), share of the noise in the diagonal.
    """

    scale: Array
    basis: Array
    eigenvalues: Array
    log_determinant: float
    noise_share: Array


@dataclass(frozen=True)
class Projection:
    """Values over their standard deviations, and their damped coordinates along the scatter.

    scaled: (n,) or (n, k); along: (m,) or (m, k).
    """

    scaled: Array
    along: Array

    def inner(self, other: Projection) -> Array:
        """Inner products (), (k,) or (k, l) of the whitened values."""
        return self.scaled.T @ other.scaled - self.along.T @ other.along


@dataclass(frozen=True)
class Weighting:
    """mean: covariance for (nearly) the mean drive; individual: for an individual drive, by roughness; size: of the
    scatter; roughness: index of the covariance that holds for an individual drive."""

    mean: Covariance
    individual: tuple[Covariance, ...]
    size: float
    roughness: int = 0

    @property
    def _active(self) -> Covariance:
        return self.individual[self.roughness] if self.size >= INDIVIDUAL_SIZE else self.mean

    @property
    def scale(self) -> Array:
        """(n,) 1/(N.m), reciprocal standard deviations of the diagonal."""
        return self._active.scale

    @property
    def basis(self) -> Array:
        """(n, m), orthonormal principal components of the whitened scatter."""
        return self._active.basis

    @property
    def eigenvalues(self) -> Array:
        """(m,), variances of the principal components at size 1, in units of the diagonal."""
        return self._active.eigenvalues

    def whiten(self, values: Array) -> Array:
        """Values (n,) or (n, k), N.m, transformed so that residuals are independent with variance 1."""
        covariance = self._active
        v = values * (covariance.scale if values.ndim == 1 else covariance.scale[:, None])
        shrink = 1 - 1 / np.sqrt(1 + self.size**2 * covariance.eigenvalues)
        along = covariance.basis.T @ v
        return v - covariance.basis @ (along * (shrink if values.ndim == 1 else shrink[:, None]))

    def project(self, values: Array) -> Projection:
        """Values (n,) or (n, k), N.m, prepared for inner products of what `whiten` makes of them, in half its time."""
        covariance = self._active
        scaled = values * (covariance.scale if values.ndim == 1 else covariance.scale[:, None])
        spread = self.size**2 * covariance.eigenvalues
        damping = np.sqrt(spread / (1 + spread))
        along = covariance.basis.T @ scaled
        return Projection(scaled, along * (damping if values.ndim == 1 else damping[:, None]))

    def products(self, values: Array, sizes: Sequence[float]) -> list[Array]:
        """Inner products (k, k) of whitened values (n, k), N.m, under every size of the scatter."""
        by_kind: dict[bool, tuple[Array, Array, Array]] = {}
        found: list[Array] = []
        for size in sizes:
            kind = size >= INDIVIDUAL_SIZE
            if kind not in by_kind:
                covariance = self.with_size(size)._active
                scaled = values * covariance.scale[:, None]
                by_kind[kind] = scaled.T @ scaled, covariance.basis.T @ scaled, covariance.eigenvalues
            across, along, eigenvalues = by_kind[kind]
            spread = size**2 * eigenvalues
            found.append(across - along.T @ (along * (spread / (1 + spread))[:, None]))
        return found

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of the covariance over that of the noise alone."""
        return float(np.log1p(self.size**2 * self.eigenvalues).sum()) + self._active.log_determinant

    @property
    def noise_share(self) -> Array:
        """(n,), share of the noise in the diagonal."""
        return self._active.noise_share

    def cost(self, residual: Array) -> float:
        """-2 log likelihood of a residual (n,), N.m, up to a constant of the noise."""
        return float((self.whiten(residual) ** 2).sum()) + self.log_determinant

    def with_size(self, size: float) -> Weighting:
        """The same with another size of the scatter."""
        return replace(self, size=size)

    def like(self, other: Weighting) -> Weighting:
        """The same with the size and the roughness of another weighting."""
        return replace(self, size=other.size, roughness=min(other.roughness, len(self.individual) - 1))

    def for_mean_drive(self) -> Weighting:
        """For a drive known to be the mean drive: the least scatter of the grid and no individual's variance."""
        return Weighting(self.mean, (self.mean,), SCATTER_SIZES[0])

    def with_likeliest_scatter(
        self, residuals: Array, least: float = SCATTER_SIZES[0], most: float = SCATTER_SIZES[-1]
    ) -> Weighting:
        """With the size on the grid, from `least` to `most`, and the roughness that maximise the likelihood of
        residuals (n,) or (n, k), N.m; unchanged without scatter, or where a mean drive has no such size."""
        if not len(self.mean.eigenvalues):
            return self
        kinds = [(0, self.mean, [s for s in SCATTER_SIZES if least <= s < INDIVIDUAL_SIZE])]
        if self.individual[0] is not self.mean:
            sizes = [s for s in SCATTER_SIZES if max(least, INDIVIDUAL_SIZE) <= s <= most]
            kinds += [(k, covariance, sizes) for k, covariance in enumerate(self.individual)]
        costs = [
            (cost, size, roughness)
            for roughness, covariance, sizes in kinds
            for cost, size in zip(_costs(covariance, residuals, sizes), sizes, strict=True)
        ]
        _, size, roughness = min(costs, default=(0.0, self.size, self.roughness))
        return replace(self, size=size, roughness=roughness)


def _costs(covariance: Covariance, residuals: Array, sizes: Sequence[float]) -> list[float]:
    """-2 log likelihood of residuals (n,) or (n, k), N.m, at each size, up to a constant of the noise."""
    if not sizes:
        return []
    v = (residuals.T * covariance.scale).T
    along = (covariance.basis.T @ v) ** 2
    # Residuals of several drives have the same size, so that their likelihoods multiply.
    count, along = (1, along) if v.ndim == 1 else (v.shape[1], along.sum(axis=1))
    spread = 1 + np.array(sizes)[:, None] ** 2 * covariance.eigenvalues
    # All sizes of one diagonal share the part of the residual that is orthogonal to the basis.
    across = float((v**2).sum()) + count * covariance.log_determinant
    return (across - (along * (1 - 1 / spread)).sum(axis=1) + count * np.log(spread).sum(axis=1)).tolist()


def without_blocks(weights: Weighting) -> Weighting:
    """A weighting of no blocks that only holds size and roughness: the receiver has the rest itself."""
    none = make_weighting(np.zeros(0), np.zeros((0, 0)))
    return replace(none, size=weights.size, roughness=weights.roughness)


def has_no_blocks(weights: Weighting) -> bool:
    """Whether a weighting only holds size and roughness."""
    return len(weights.mean.scale) == 0


def make_weighting(
    variance: Array, scatter: Array, residual_variances: Array | None = None, size: float = 1.0
) -> Weighting:
    """The weighting of n blocks.

    variance: (n,) (N.m)^2, of the noise; scatter: (m, n) N.m, what one standard deviation of each random effect does,
    or (0, n); residual_variances: (r, n) (N.m)^2, of an individual drive beyond these columns, by roughness.
    """
    mean = _covariance(variance, scatter, 0.0, np.ones(len(variance)))
    if residual_variances is None or not len(scatter):
        return Weighting(mean, (mean,), size)
    # The principal components that are kept beside the noise alone are the only ones that are kept beside more.
    components = (mean.basis * np.sqrt(mean.eigenvalues)).T / mean.scale
    individual = [
        _covariance(variance + rest, components, float(np.log1p(rest / variance).sum()), variance / (variance + rest))
        for rest in residual_variances
    ]
    return Weighting(mean, tuple(individual), size)


def _covariance(variance: Array, scatter: Array, log_determinant: float, noise_share: Array) -> Covariance:
    scale = 1 / np.sqrt(variance)
    if not len(scatter):
        return Covariance(scale, np.zeros((len(scale), 0)), np.zeros(0), log_determinant, noise_share)
    rows = scatter * scale
    # All eigenvalues by divide and conquer take a fifth of the time of a part of them by bisection.
    values, vectors = np.linalg.eigh(rows @ rows.T)
    kept = values > MIN_EIGENVALUE
    values = values[kept]
    basis = np.ascontiguousarray((vectors[:, kept].T @ rows).T / np.sqrt(values))
    return Covariance(scale, basis, values, log_determinant, noise_share)
