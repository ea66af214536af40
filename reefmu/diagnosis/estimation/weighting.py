"""Covariance of the residuals: noise of every block, and the scatter of the population as a random effect.

The covariance of n blocks is diag(variance) + size^2 U U^T; the columns of U are the principal components of the
scatter, what one standard deviation of each does. It is inverted by the Woodbury identity. `size` is 1 for an
individual drive of the population and is estimated with every fit: a record without scatter (of the mean drive, or of a
drive better than its tolerances) shows smaller effects.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import get_lapack_funcs

from stiffness_model.numerics.arrays import Array

SCATTER_SIZES = (0.007, 0.02, 0.06, 0.12, 0.25, 0.5, 0.75, 1.0)
"""Grid on which the size of the scatter is estimated. The mean of N drives scatters by 1/sqrt(N): 0.06 stands for 250
drives, 0.02 for 2500; 0.007 is about the error of the tables. It ends at 1: a tolerance is a limit, and a drive that
scatters more than its drawing allows has something that is missing. The spacing was chosen by judgement."""
MEAN_DRIVE_SIZE = 0.15
"""Greatest size of the scatter at which a drive counts as the mean drive. Chosen by judgement, between the mean of a
few dozen drives and an individual drive."""
INDIVIDUAL_SIZE = 0.25
"""Least size of the scatter at which a drive counts as an individual drive. Chosen by judgement."""
MIN_EIGENVALUE = 0.1
"""Least variance of a principal component, over that of the noise, that is kept. Chosen among 0.3, 0.1 and 0.03 by the
likelihood of records of individuals (`tests/benchmarks/scatter/bench_common_deviations.py`)."""
UNKNOWN_FORMS = 0.001
"""Torque, over full torque, that times a principal component's standard deviation is added to its variance: tolerances
say how much parts deviate and not in which forms, and what is not as it is taken to be shows most in small components.
Chosen among 0, 0.0003, 0.0006, 0.001, 0.002, 0.003 and 0.005 by the likelihood of records of individuals
(`tests/benchmarks/scatter/bench_unknown_forms.py`), which is greatest for it in two catalogues."""
SAME_GAIN = 0.005
"""Change of the gain of the scatter up to which that of the noise is taken to change as well, which saves a
decomposition and changes -2 log likelihoods by a few units at most; chosen by judgement."""
LEFT_OUT = MIN_EIGENVALUE / 300
"""Variance of every block, over that of the noise, below which the decomposition of a covariance ends. -2 log
likelihoods change by less than 0.01, and by up to 0.6 where it is ten times as large."""


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
    """Diagonal plus low rank, in units of the diagonal.

    scale: (n,) 1/(N.m), reciprocal standard deviations of the noise; basis: (n, m), orthonormal principal components of
    the whitened scatter; eigenvalues: (m,), their variances at size 1; size: of the scatter.
    """

    scale: Array
    basis: Array
    eigenvalues: Array
    size: float

    @property
    def components(self) -> Array:
        """(m, n) N.m, what one standard deviation of each principal component of the scatter does."""
        return (self.basis * np.sqrt(self.eigenvalues)).T / self.scale

    @property
    def is_individual(self) -> bool:
        """Whether there are random effects, as wide as those of an individual drive."""
        return len(self.eigenvalues) > 0 and self.size >= INDIVIDUAL_SIZE

    def whiten(self, values: Array) -> Array:
        """Values (n,) or (n, k), N.m, transformed so that residuals are independent with variance 1."""
        v = values * (self.scale if values.ndim == 1 else self.scale[:, None])
        shrink = 1 - 1 / np.sqrt(1 + self.size**2 * self.eigenvalues)
        along = self.basis.T @ v
        return v - self.basis @ (along * (shrink if values.ndim == 1 else shrink[:, None]))

    def project(self, values: Array) -> Projection:
        """Values (n,) or (n, k), N.m, prepared for inner products of what `whiten` makes of them, in half its time."""
        scaled = values * (self.scale if values.ndim == 1 else self.scale[:, None])
        spread = self.size**2 * self.eigenvalues
        damping = np.sqrt(spread / (1 + spread))
        along = self.basis.T @ scaled
        return Projection(scaled, along * (damping if values.ndim == 1 else damping[:, None]))

    def products(self, values: Array, sizes: Sequence[float]) -> list[Array]:
        """Inner products (k, k) of whitened values (n, k), N.m, under every size of the scatter."""
        scaled = values * self.scale[:, None]
        across, along = scaled.T @ scaled, self.basis.T @ scaled
        spreads = [size**2 * self.eigenvalues for size in sizes]
        return [across - along.T @ (along * (spread / (1 + spread))[:, None]) for spread in spreads]

    def expected_squares(self, noise: Array) -> Array:
        """(n,) expected squares of what `whiten` makes of noise and scatter.

        noise: (n,) variance of each block alone, over that of the weights, which count the whole autocorrelation; taken
        as alike in the blocks that a principal component joins. What the scatter spans has the variance 1 of noise and
        scatter together, whatever the noise there; the rest has that of the noise.
        """
        spread = self.size**2 * self.eigenvalues
        spanned = self.basis**2 @ (spread / (1 + spread))
        return noise * (1 - spanned) + spanned

    @property
    def log_determinant(self) -> float:
        """Logarithm of the determinant of the covariance over that of the noise alone."""
        return float(np.log1p(self.size**2 * self.eigenvalues).sum())

    def cost(self, residual: Array) -> float:
        """-2 log likelihood of a residual (n,), N.m, up to a constant of the noise."""
        return float((self.whiten(residual) ** 2).sum()) + self.log_determinant

    def with_gain(self, gain: Array) -> Weighting:
        """For a scatter that is `gain` (n,) times as large in the torque, 1 in the geometric mean; unchanged unless it
        is that of an individual drive."""
        if not self.is_individual:
            return self
        if are_gains_alike(gain, np.ones(1)):
            return replace(self, scale=self.scale / gain)
        return make_weighting(self.scale**-2, self.components * gain, self.size)

    def with_size(self, size: float) -> Weighting:
        """The same with another size of the scatter."""
        return replace(self, size=size)

    def for_mean_drive(self) -> Weighting:
        """For a drive known to be the mean drive: the least scatter of the grid."""
        return self.with_size(SCATTER_SIZES[0])

    def with_unknown_forms(self, full_torque: float) -> Weighting:
        """With wider small components, as of parts that deviate in other forms (`UNKNOWN_FORMS`); full_torque: N.m."""
        return replace(self, eigenvalues=self.eigenvalues + self._forms(full_torque) * np.sqrt(self.eigenvalues))

    def without_unknown_forms(self, full_torque: float) -> Weighting:
        """What `with_unknown_forms` made this of: the components as tolerances of size and place make them."""
        half = self._forms(full_torque) / 2
        return replace(self, eigenvalues=(np.sqrt(half**2 + self.eigenvalues) - half) ** 2)

    def _forms(self, full_torque: float) -> float:
        """`UNKNOWN_FORMS` of full torque, N.m, over the standard deviation of the noise."""
        return UNKNOWN_FORMS * full_torque * float(np.sqrt(np.mean(self.scale**2)))

    def with_variance(self, variance: Array) -> Weighting:
        """With another noise, variance (n,) in (N.m)^2."""
        return make_weighting(variance, self.components, self.size)

    def with_random_effects(self, columns: Array) -> Weighting:
        """With further random effects, whose standard deviations do `columns` (n, k), N.m; at size 1."""
        scaled = columns * self.scale[:, None]
        inside = self.basis.T @ scaled
        across, outside = np.linalg.qr(scaled - self.basis @ inside)
        both = np.concatenate([inside, outside])
        spread = np.concatenate([self.size**2 * self.eigenvalues, np.zeros(len(outside))])
        values, vectors = np.linalg.eigh(np.diag(spread) + both @ both.T)
        basis = np.concatenate([self.basis, across], axis=1) @ vectors
        return replace(self, basis=basis, eigenvalues=values.clip(0.0), size=1.0)

    def with_likeliest_scatter(
        self, residuals: Array, least: float = SCATTER_SIZES[0], most: float = SCATTER_SIZES[-1]
    ) -> Weighting:
        """With the size on the grid, from `least` to `most`, that maximises the likelihood of residuals (n,) or (n, k),
        N.m; unchanged without scatter."""
        sizes = [s for s in SCATTER_SIZES if least <= s <= most]
        if not len(self.eigenvalues) or not sizes:
            return self
        along = (self.basis.T @ (residuals.T * self.scale).T) ** 2
        # Residuals of several drives have the same size, so that their likelihoods multiply.
        count, along = (1, along) if residuals.ndim == 1 else (residuals.shape[1], along.sum(axis=1))
        spread = 1 + np.array(sizes)[:, None] ** 2 * self.eigenvalues
        # All sizes share the part of the residual that is orthogonal to the basis.
        costs = (along / spread).sum(axis=1) + count * np.log(spread).sum(axis=1)
        return self.with_size(sizes[int(costs.argmin())])


def are_gains_alike(gain: Array, other: Array) -> bool:
    """Whether two gains (n,) of the scatter differ by less than `SAME_GAIN` everywhere."""
    return bool(np.abs(gain / other - 1).max() < SAME_GAIN)


def without_blocks(weights: Weighting) -> Weighting:
    """A weighting of no blocks that only holds the size: the receiver has the rest itself."""
    return make_weighting(np.zeros(0), np.zeros((0, 0)), weights.size)


def has_no_blocks(weights: Weighting) -> bool:
    """Whether a weighting only holds the size."""
    return len(weights.scale) == 0


def make_weighting(variance: Array, scatter: Array, size: float = 1.0) -> Weighting:
    """The weighting of n blocks from the random effects of the scatter.

    variance: (n,) (N.m)^2, of the noise; scatter: (m, n) N.m, what one standard deviation of each random effect does,
    or (0, n).
    """
    scale = 1 / np.sqrt(variance)
    rows = scatter * scale
    # All eigenvalues by divide and conquer take a fifth of the time of a part of them by bisection.
    values, vectors = np.linalg.eigh(rows @ rows.T)
    kept = values > MIN_EIGENVALUE
    basis = np.ascontiguousarray((vectors[:, kept].T @ rows).T / np.sqrt(values[kept]))
    return Weighting(scale, basis, values[kept], size)


def weighting_of_covariance(variance: Array, scatter: Array, least: float = MIN_EIGENVALUE) -> Weighting:
    """The same at size 1 from the covariance of the scatter, (n, n) (N.m)^2; least: as `MIN_EIGENVALUE`.

    The scatter of few blocks fixes that of all others: a Cholesky decomposition with pivots ends where no block has
    more than `LEFT_OUT` left (Harbrecht, Peters and Schneider, On the Low-Rank Approximation by the Pivoted Cholesky
    Decomposition, 2012), and the principal components are those of its few columns.
    """
    scale = 1 / np.sqrt(variance)
    scaled = scatter * scale[:, None] * scale
    # The transpose of a symmetric matrix is itself, in the order of LAPACK.
    (decompose,) = get_lapack_funcs(("pstrf",), (scaled,))
    factor, pivots, rank, _ = decompose(scaled.T, tol=LEFT_OUT, lower=1, overwrite_a=1)
    columns = np.empty((len(scaled), rank))
    columns[pivots - 1] = np.tril(factor[:, :rank])
    values, vectors = np.linalg.eigh(columns.T @ columns)
    kept = values > least
    return Weighting(scale, columns @ (vectors[:, kept] / np.sqrt(values[kept])), values[kept], 1.0)
