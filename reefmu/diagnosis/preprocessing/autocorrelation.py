"""Variance and autocorrelation of noise from segments that were freed of mean and slope.

Detrending removes much of slow noise, and short segments hide its correlation time: averages of what is left make both
too small. Restricted maximum likelihood (REML: Patterson and Thompson, Biometrika 58, 1971) accounts for what was
removed: each segment enters through contrasts that hold neither mean nor slope. The noise is modelled as a sum of
first-order autoregressions with fixed lag-one correlations, white noise among them, since torque sensor, encoder and
quantisation each have their own; a single autoregression would fit the fast part and miss the slow one. The results
are averages over the likelihood, not its maximum.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np

from stiffness_model.numerics.arrays import Array

LAG_ONE_CORRELATIONS = (0.0, 0.2, 0.35, 0.5, 0.6, 0.7, 0.77, 0.83, 0.88, 0.91, 0.935, 0.955, 0.97, 0.98)
"""Lag-one correlations of the autoregressions. Chosen by judgement: neighbours differ in correlation time by a factor
of about 1.4, the slowest lies at half of the longest segment."""
MAX_SEGMENT = 200
"""Greatest length of a segment in samples. Chosen by judgement to bound the size of the covariances."""
ITERATIONS = 60
"""Multiplicative steps on the likelihood. Chosen by judgement: the averages hardly change after them."""


@dataclass(frozen=True)
class Autocorrelation:
    """Of noise that is a sum of first-order autoregressions, of which a record does not tell the shares exactly.

    variance: of a sample; shares: (m, r) of the r autoregressions with `LAG_ONE_CORRELATIONS`, over the variance of a
    sample, for m mixtures of them; probability: (m,) of each mixture. White noise if they are not given.
    """

    variance: float
    shares: Array = field(default_factory=lambda: np.eye(1, len(LAG_ONE_CORRELATIONS)))
    probability: Array = field(default_factory=lambda: np.ones(1))

    @property
    def correlation_time(self) -> float:
        """Samples, sum of the autocorrelation over all lags, 1 for white noise."""
        rho = np.array(LAG_ONE_CORRELATIONS)
        return float(self.probability @ self.shares @ ((1 + rho) / (1 - rho)))

    def of_means(self, count: int, lags: int) -> Array:
        """(lags,) autocovariance of the means of `count` neighbouring samples each, over the variance of a sample.

        >>> Autocorrelation(2.0).of_means(4, 2).tolist()
        [0.25, 0.0]
        """
        return self._of_mixtures(count, lags) @ self.probability

    def dependence_of_means(self, count: int) -> float:
        """Means of `count` neighbouring samples each that say as much of their variance as one independent value: the
        sum of their squared autocorrelation over all lags.

        >>> Autocorrelation(2.0).dependence_of_means(4)
        1.0
        """
        found = self.of_means(count, MAX_SEGMENT)
        return float(2 * ((found / found[0]) ** 2).sum() - 1)

    def independent_means(self, count: int, samples: int) -> float:
        """Number of independent values that tell the variance of means of `count` neighbouring samples as well as those
        of `samples` samples do.

        >>> Autocorrelation(2.0).independent_means(4, 400)
        100.0
        """
        return samples / (count * self.dependence_of_means(count))

    def level_deviation(self, count: int, samples: int) -> float:
        """Standard deviation of the logarithm of the variance of means of `count` neighbouring samples, as known from
        `samples` differences of cycles: by their number, which the differences halve, and by what the mixtures differ.

        >>> Autocorrelation(2.0).level_deviation(4, 400)
        0.2
        """
        variances = self._of_mixtures(count, 1)[0]
        spread = float(self.probability @ (variances / (variances @ self.probability) - 1) ** 2)
        return float(np.sqrt(4 / self.independent_means(count, samples) + spread))

    def draw_of_means(self, count: int, lags: int, number: int, rng: np.random.Generator) -> Array:
        """(lags, number), the same of so many mixtures, drawn by their probability."""
        return self._of_mixtures(count, lags)[:, rng.choice(len(self.probability), number, p=self.probability)]

    def _of_mixtures(self, count: int, lags: int) -> Array:
        rho = np.array(LAG_ONE_CORRELATIONS)
        summed = (1 - rho**count) / (1 - rho)
        alone = count * (1 + rho) / (1 - rho) - 2 * rho * summed / (1 - rho)
        apart = rho ** (count * np.arange(lags - 1)[:, None] + 1) * summed**2
        return np.concatenate([alone[None], apart]) @ self.shares.T / count**2


def autocorrelation(segments: list[Array], min_length: int = 24) -> Autocorrelation:
    """Of noise from detrended segments of any lengths; shorter than `min_length` samples it is taken as white.

    >>> rng = np.random.default_rng(0)
    >>> found = autocorrelation([2 * rng.standard_normal(100) for _ in range(40)])
    >>> round(found.variance, 1), found.of_means(1, 2).round(1).tolist()
    (4.0, [1.0, 0.0])
    """
    length = min(MAX_SEGMENT, int(np.median([len(p) for p in segments])))
    parts = [p[k : k + length] for p in segments for k in range(0, len(p) - length + 1, length)]
    if not parts:
        length = min(len(p) for p in segments)
        parts = [p[:length] for p in segments]
    block = np.stack(parts)
    size = float(np.mean(block**2))
    if length < min_length or size <= 0:
        return Autocorrelation(max(size, 1e-300))
    contrasts, spectra = _contrasts(length)
    energy = ((block @ contrasts) ** 2).mean(axis=0) / size
    # White noise, a slow autoregression and one between: such short segments do not tell more of them apart.
    mixtures = np.array([(0, k, j) for j in range(2, len(LAG_ONE_CORRELATIONS)) for k in range(1, j)])
    components, rho = spectra[mixtures], np.array(LAG_ONE_CORRELATIONS)[mixtures]
    share = np.full(mixtures.shape, 1 / 3)
    for _ in range(ITERATIONS):
        # Multiplicative steps increase the likelihood of the contrasts' energies and keep all shares positive.
        expected = np.einsum("pc,pci->pi", share, components)
        share = share * (
            np.einsum("pci,pi->pc", components, energy / expected**2)
            / np.einsum("pci,pi->pc", components, 1 / expected)
        )
    expected = np.einsum("pc,pci->pi", share, components)
    likelihood = -0.5 * len(block) * (np.log(expected) + energy / expected).sum(axis=1)
    scaled_time = (share * (1 + rho) / (1 - rho)).sum(axis=1)
    # A flat prior on the logarithm of the correlation time, which short segments hardly bound from above.
    likelihood = likelihood - np.log(scaled_time)
    weight = np.exp(likelihood - likelihood.max())
    weight /= weight.sum()
    # Errors of sums depend on variance times correlation time, so that shares of the variance are averaged.
    shares = np.zeros((len(mixtures), len(LAG_ONE_CORRELATIONS)))
    np.put_along_axis(shares, mixtures, share, axis=1)
    total = float(weight @ shares.sum(axis=1))
    return Autocorrelation(total * size, shares / total, weight)


@lru_cache(maxsize=64)
def _contrasts(length: int) -> tuple[Array, Array]:
    """Contrasts (length, length - 2) without mean and slope, nearly uncorrelated for all slow noise, and the variances
    (len(LAG_ONE_CORRELATIONS), length - 2) that each autoregression of variance 1 has in them."""
    line = np.stack([np.ones(length), np.linspace(-1, 1, length)], axis=1)
    free = np.linalg.qr(line, mode="complete")[0][:, 2:]
    lag = np.abs(np.arange(length)[:, None] - np.arange(length))
    slow = free.T @ (0.9**lag) @ free
    contrasts = free @ np.linalg.eigh(slow)[1]
    spectra = [np.einsum("ki,kl,li->i", contrasts, rho**lag, contrasts, optimize=True) for rho in LAG_ONE_CORRELATIONS]
    return contrasts, np.array(spectra)
