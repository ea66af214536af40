"""Size and autocorrelation of noise behind segments that were freed of mean and slope.

Detrending takes most of a slow noise away, and short segments hide how slow it is: summing up what is left makes
both too small. Restricted likelihood (Patterson and Thompson, Biometrika 58, 1971) knows what went out: each
segment counts through the contrasts that hold neither mean nor slope. The noise is taken as a sum of first-order
autoregressions of any correlations, white noise among them: the torque sensor's amplifier, the encoder's and the
quantisation each have their own, and a single one would fit the fast part and miss the slow, which counts. The
figures are means over the likelihood, not its peak.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from stiffness_model.numerics.arrays import Array

LAG_ONE_CORRELATIONS = (0.0, 0.2, 0.35, 0.5, 0.6, 0.7, 0.77, 0.83, 0.88, 0.91, 0.935, 0.955, 0.97, 0.98)
"""Lag-one correlations of the parts."""
MAX_SEGMENT = 200
"""Samples at which segments are cut."""
ITERATIONS = 60


@dataclass(frozen=True)
class Autocorrelation:
    """variance: of a sample; lag_one: correlation of neighbours; correlation_time: sum of the autocorrelation over all
    lags, samples."""

    variance: float
    lag_one: float
    correlation_time: float


def autocorrelation(segments: list[Array], min_length: int = 24) -> Autocorrelation:
    """Of noise from detrended segments of at min_length `min_length` samples, of any lengths.

    >>> rng = np.random.default_rng(0)
    >>> found = autocorrelation([2 * rng.standard_normal(100) for _ in range(40)])
    >>> round(found.variance, 1), round(found.lag_one, 1)
    (4.0, 0.0)
    """
    length = min(MAX_SEGMENT, int(np.median([len(p) for p in segments])))
    parts = [p[k : k + length] for p in segments for k in range(0, len(p) - length + 1, length)]
    if not parts:
        length = min(len(p) for p in segments)
        parts = [p[:length] for p in segments]
    block = np.stack(parts)
    size = float(np.mean(block**2))
    if length < min_length or size <= 0:
        return Autocorrelation(max(size, 1e-300), 0.0, 1.0)
    contrasts, spectra = _contrasts(length)
    energy = ((block @ contrasts) ** 2).mean(axis=0) / size
    # White noise, a slow part and one between: more parts could not be told apart on such short segments.
    pairs = np.array([(0, k, j) for j in range(2, len(LAG_ONE_CORRELATIONS)) for k in range(1, j)])
    parts_of, rho = spectra[pairs], np.array(LAG_ONE_CORRELATIONS)[pairs]
    share = np.full(pairs.shape, 1 / 3)
    for _ in range(ITERATIONS):
        # Likelihood of energies about their expectations, climbed by multiplicative steps; shares stay positive.
        expected = np.einsum("pc,pci->pi", share, parts_of)
        share = share * (
            np.einsum("pci,pi->pc", parts_of, energy / expected**2) / np.einsum("pci,pi->pc", parts_of, 1 / expected)
        )
    expected = np.einsum("pc,pci->pi", share, parts_of)
    likelihood = -0.5 * len(block) * (np.log(expected) + energy / expected).sum(axis=1)
    correlation_time = (share * (1 + rho) / (1 - rho)).sum(axis=1)
    # A flat prior of the logarithm of the correlation_time: short segments hardly bound it from above.
    likelihood = likelihood - np.log(correlation_time)
    weight = np.exp(likelihood - likelihood.max())
    weight /= weight.sum()
    total = float(weight @ share.sum(axis=1))
    # What counts for sums of samples is variance times correlation_time, and that must come out right in the mean.
    slow = float(weight @ correlation_time)
    return Autocorrelation(total * size, float(weight @ (share * rho).sum(axis=1)) / total, max(slow / total, 1.0))


@lru_cache(maxsize=64)
def _contrasts(length: int) -> tuple[Array, Array]:
    """Contrasts (length, length - 2) without mean and slope, nearly independent for all slow noises, and what each
    autoregression of variance 1 leaves in them, (len(LAG_ONE_CORRELATIONS), length - 2)."""
    line = np.stack([np.ones(length), np.linspace(-1, 1, length)], axis=1)
    free = np.linalg.qr(line, mode="complete")[0][:, 2:]
    lag = np.abs(np.arange(length)[:, None] - np.arange(length))
    slow = free.T @ (0.9**lag) @ free
    contrasts = free @ np.linalg.eigh(slow)[1]
    spectra = [np.einsum("ki,kl,li->i", contrasts, rho**lag, contrasts, optimize=True) for rho in LAG_ONE_CORRELATIONS]
    return contrasts, np.array(spectra)
