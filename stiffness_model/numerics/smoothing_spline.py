"""Cubic smoothing splines of noisy values at uneven times, as smooth as the values show.

The spline f that minimises sum (y - f)^2 / v + integral f''^2 / q is the mean, given values y with noise of variance v,
of a random function whose second derivative is white noise of intensity q (Wahba, Journal of the Royal Statistical
Society B 40, 1978, pages 364 to 372). What its slopes err by is therefore known, once q is, and q is the likeliest. The
equations are Reinsch's (Green and Silverman, Nonparametric Regression and Generalized Linear Models, 1994, section
2.3): with the second divided differences Q^T and the band matrix R of the steps,

    (Q^T V Q + q R) z = Q^T y,    f = y - V Q z,    f'' = q z.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_solve_banded, cholesky_banded

from .arrays import Array

SMOOTHEST, ROUGHEST = -12.0, 4.0
"""Decimal logarithms of the least and the greatest intensity that are tried, over that at which noise and bending over
one step are as large: a spline that averages about a thousand values, of equations that rounding leaves positive
definite whatever the number of values, and one that goes through the values."""
EXPONENT_STEP = 0.5
"""Step of that logarithm, over which the width of what is averaged changes by a third."""

LEAST_STEP = 1e-3
"""Least step over the median one; shorter ones, between which rounding leaves no slope, count as long as this."""


@dataclass(frozen=True)
class SmoothingSpline:
    """Splines of n values in pieces, each with its own straight lines beyond its ends and all with one intensity.

    time: (n,), increasing from 0; variance: (n,), of the noise; at: (p,), numbers of the values in the pieces, where
    the last value of a piece is the first of the next one; step: (p,), to the next value in the piece, 1 at its end;
    is_end: (p,); inner: (m,), places in `at` that are neither first nor last of a piece; intensity: q; factor: (3, m),
    band of the Cholesky factor of the equations.
    """

    time: Array
    variance: Array
    at: NDArray[np.intp]
    step: Array
    is_end: NDArray[np.bool_]
    inner: NDArray[np.intp]
    intensity: float
    factor: Array

    def slopes(self, values: Array) -> Array:
        """(n,) or (n, k) slopes at the values of the splines of `values`, (n,) or (n, k), with this intensity; where
        two pieces meet, the mean of both."""
        columns = values.reshape(len(values), -1)
        y, step = columns[self.at], self.step[:, None]
        z = np.zeros_like(y)
        z[self.inner] = cho_solve_banded((self.factor, True), self._second_differences(y))
        fitted = y - self.variance[self.at, None] * self._transposed(z)
        bend = self.intensity * z
        slope = np.empty_like(y)
        slope[:-1] = np.diff(fitted, axis=0) / step[:-1] - step[:-1] / 6 * (2 * bend[:-1] + bend[1:])
        end, before = np.flatnonzero(self.is_end), np.flatnonzero(self.is_end) - 1
        last = self.step[before, None]
        slope[end] = (fitted[end] - fitted[before]) / last + last / 6 * (bend[before] + 2 * bend[end])
        first = np.flatnonzero(np.diff(self.at, prepend=-1))
        count = np.diff(first, append=len(self.at))
        return (np.add.reduceat(slope, first) / count[:, None]).reshape(values.shape)

    def slope_errors(self, draws: int, rng: np.random.Generator) -> Array:
        """(draws, n) errors of the slopes of random functions as rough as the values: by noise and by smoothing."""
        step, q = np.diff(self.time)[:, None], self.intensity
        bent, moved = rng.standard_normal((2, len(step), draws))
        turn = np.sqrt(q * step) * bent
        slope = np.concatenate([np.zeros((1, draws)), turn.cumsum(axis=0)])
        advance = step * slope[:-1] + step / 2 * turn + np.sqrt(q * step**3 / 12) * moved
        path = np.concatenate([np.zeros((1, draws)), advance.cumsum(axis=0)])
        noise = np.sqrt(self.variance)[:, None] * rng.standard_normal(path.shape)
        return (self.slopes(path + noise) - slope).T

    def _second_differences(self, y: Array) -> Array:
        """(m, k) products of Q^T with values (p, k)."""
        a, b, c = (part[:, None] for part in _differences(self.step, self.inner))
        return a * y[self.inner - 1] + b * y[self.inner] + c * y[self.inner + 1]

    def _transposed(self, z: Array) -> Array:
        """(p, k) products of Q with values (p, k), which are 0 at the ends of the pieces."""
        a, b, c = (part[:, None] for part in _differences(self.step, self.inner))
        found = np.zeros_like(z)
        found[self.inner - 1] += a * z[self.inner]
        found[self.inner] += b * z[self.inner]
        found[self.inner + 1] += c * z[self.inner]
        return found


def smoothing_spline(time: Array, values: Array, variance: Array, corners: Sequence[int] = ()) -> SmoothingSpline:
    """The likeliest splines of values (n,) at increasing times (n,), with noise of a variance (n,) above 0.

    corners: increasing numbers of inner values at which the slope jumps, where one piece ends and the next begins.

    >>> time = np.linspace(0.0, 1.0, 50)
    >>> line = smoothing_spline(time, 3.0 * time, np.full(50, 1e-6))
    >>> bool(np.allclose(line.slopes(3.0 * time), 3.0))
    True
    """
    steps = np.diff(time)
    time = np.cumsum(np.append(0.0, np.maximum(steps, LEAST_STEP * np.median(steps))))
    at, is_end = _pieces(len(time), corners)
    step = np.where(is_end, 1.0, np.diff(time[at], append=0.0))
    is_inner = ~is_end
    is_inner[0], is_inner[1:] = False, is_inner[1:] & ~is_end[:-1]
    inner = np.flatnonzero(is_inner)
    noise, bending = _bands(step, inner, variance[at])
    a, b, c = _differences(step, inner)
    differences = a * values[at][inner - 1] + b * values[at][inner] + c * values[at][inner + 1]
    unit = float(np.median(variance)) / float(np.median(np.diff(time))) ** 3
    best, likeliest = np.inf, (0.0, np.zeros((3, 0)))
    for exponent in np.arange(SMOOTHEST, ROUGHEST + EXPONENT_STEP, EXPONENT_STEP):
        intensity = unit * 10.0**exponent
        factor = np.asarray(cholesky_banded(noise + intensity * bending, lower=True), float)
        fitted = cho_solve_banded((factor, True), differences)
        cost = float(differences @ fitted) + 2 * float(np.log(factor[0]).sum())
        if cost < best:
            best, likeliest = cost, (intensity, factor)
    return SmoothingSpline(time, variance, at, step, is_end, inner, *likeliest)


def _pieces(count: int, corners: Sequence[int]) -> tuple[NDArray[np.intp], NDArray[np.bool_]]:
    """Numbers (p,) of the values in the pieces, each corner twice, and whether each is the last of its piece."""
    at = np.sort(np.concatenate([np.arange(count), np.asarray(corners, np.intp)]))
    is_end = np.diff(at, append=-1) <= 0
    return at, is_end


def _differences(step: Array, inner: NDArray[np.intp]) -> tuple[Array, Array, Array]:
    """Coefficients (m,) of the second divided differences for the values before, at and after the inner ones."""
    before, after = 1 / step[inner - 1], 1 / step[inner]
    return before, -before - after, after


def _bands(step: Array, inner: NDArray[np.intp], variance: Array) -> tuple[Array, Array]:
    """(3, m) lower bands of Q^T V Q and of R."""
    a, b, c = _differences(step, inner)
    one, two = (np.zeros(len(inner), bool) for _ in range(2))
    one[:-1], two[:-2] = np.diff(inner) == 1, inner[2:] - inner[:-2] == 2
    noise, bending = np.zeros((3, len(inner))), np.zeros((3, len(inner)))
    before, at, after = variance[inner - 1], variance[inner], variance[inner + 1]
    noise[0] = a**2 * before + b**2 * at + c**2 * after
    noise[1, :-1] = np.where(one[:-1], b[:-1] * a[1:] * at[:-1] + c[:-1] * b[1:] * at[1:], 0.0)
    noise[2, :-2] = np.where(two[:-2], c[:-2] * a[2:] * at[1:-1], 0.0)
    bending[0] = (step[inner - 1] + step[inner]) / 3
    bending[1, :-1] = np.where(one[:-1], step[inner][:-1] / 6, 0.0)
    return noise, bending
