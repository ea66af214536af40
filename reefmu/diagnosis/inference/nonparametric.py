"""Anonymous rivals of the named effects: smooth functions of what a record varies, without a physical form.

What is not in the vocabulary disguises itself as what is: a flank that is stiffer than the other as an offset, a
softening with temperature as a clearance. A term has no name but a place, such as "temperature times torque", and
free coefficients. They count as random effects: with a strength s their marginal likelihood (Rasmussen and Williams,
Gaussian Processes for Machine Learning, 2006, section 2.7) charges a term for its freedom, so that a name with
fewer parameters wins ties.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from stiffness_model.numerics.arrays import Array

from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.score_test import orthonormal_basis

Columns = Callable[[Array], Array]

STRENGTHS = tuple(np.geomspace(3e-4, 0.3, 10).tolist())
"""Sizes of a term's coefficients that are tried, as shares of full torque."""
KNOTS = (-1.0, -0.6, -0.3, -0.1, 0.1, 0.3, 0.6, 1.0)
"""Knots of the curves over the torque, as shares of its greatest."""
CURVE = "torque"
"""The term of static curves."""
ORDERS = 4
"""Orders of the crank whose waves may depend on the torque."""
HIGHEST_ORDER = 16.0
NEAR_TURNS = 6.0
"""Turns from the record's first angle within which a wave of no whole order is followed."""
LEAST_WARMING, LEAST_TURN = 3.0, 0.5
"""K and rad that a record must vary for rivals of temperature and crank."""
PERIODS = 4000
"""Periods that a swing in time may have in a record."""


@dataclass(frozen=True)
class NonparametricTerm:
    """A kind of term: place in words; columns: (n, k) of its coefficients' effects, as shares of full torque, from
    the torque (n,) in the same unit; tried: how many like it were looked at to pick it."""

    coordinate: str
    columns: Columns
    n_tried: float = 1.0


@dataclass(frozen=True)
class TermFit:
    """A term beside a fit: gain in -2 log marginal likelihood; part: (n,) N.m, that it takes of the residual."""

    term: NonparametricTerm
    gain: float
    torque: Array


def fit_terms(problem: Problem, fit: Fit, known: Sequence[NonparametricTerm] = ()) -> list[TermFit]:
    """All families beside a fit, or the known ones, the best first. The fit's own parameters stay free, to first
    order."""
    weights, full = fit.weighting, problem.base.full_torque
    basis = orthonormal_basis(weights, fit.prediction.sensitivities)
    residual = weights.whiten(problem.torque - fit.prediction.torque)
    residual = residual - basis @ (basis.T @ residual)
    # The measured torque holds the residual: a curve over it, beside the torque of the fit, would swallow the noise.
    torque = fit.prediction.torque / full
    found = []
    for term in known or list(possible_terms(problem, residual)):
        columns = term.columns(torque)
        white = weights.whiten(columns * full)
        free = white - basis @ (basis.T @ white)
        gain, coefficients = _marginal(free, white, residual)
        found.append(TermFit(term, gain - 2 * float(np.log(term.n_tried)), columns @ coefficients * full))
    return sorted(found, key=lambda r: -r.gain)


def _marginal(free: Array, white: Array, residual: Array) -> tuple[float, Array]:
    """Greatest gain over the strengths, and coefficients, of columns `white` (n, k) that are `free` (n, k) of the
    fit's parameters."""
    values, vectors = np.linalg.eigh(free.T @ free)
    along = vectors.T @ (free.T @ residual)
    whole = np.linalg.eigvalsh(white.T @ white).clip(0)
    best, coefficients = -np.inf, np.zeros(free.shape[1])
    for strength in STRENGTHS:
        inverse = 1 / (values.clip(0) + 1 / strength**2)
        gain = float((along**2 * inverse).sum() - np.log1p(strength**2 * whole).sum())
        if gain > best:
            best, coefficients = gain, vectors @ (along * inverse)
    return best, coefficients


def possible_terms(problem: Problem, residual: Array) -> Iterator[NonparametricTerm]:
    """The families that this record can show; residual: (n,) whitened, by which scanned ones are picked."""
    t, mean = problem.trace, problem.blocks.mean
    crank, clock, warmth = mean(t.crank), mean(t.time), mean(t.temperature) - 20.0
    yield NonparametricTerm(CURVE, curve_over_torque)
    direction = mean(np.sign(np.where(t.start, 0.0, np.diff(t.smooth_twist, prepend=t.smooth_twist[0]))))
    yield NonparametricTerm("direction of the twist, by torque", _times(direction[:, None]))
    yield NonparametricTerm("rate of the twist, by torque", _times(_speeds(mean(t.twist_rate))))
    speed = mean(t.output_speed)
    if np.abs(speed).max() > 0:
        yield NonparametricTerm("speed of the output, by torque", _times(_speeds(speed)))
    if np.ptp(warmth) > LEAST_WARMING:
        warm = (warmth / np.abs(warmth).max())[:, None]
        yield NonparametricTerm("temperature, by torque", partial(_curve_times, warm))
    if np.ptp(crank) > LEAST_TURN:
        for order in range(1, ORDERS + 1):
            waves = np.stack([np.cos(order * crank), np.sin(order * crank)], axis=1)
            yield NonparametricTerm(f"order {order} of the crank, by torque", _times(waves))
        near = np.abs(crank - crank[0]) < 2 * np.pi * NEAR_TURNS
        order, tried = _strongest(problem, crank / (2 * np.pi), residual, near, HIGHEST_ORDER)
        yield _fixed(f"order {order:.3g} of the crank at any load", _wave(order * crank) * near[:, None], tried)
    span = max(float(np.ptp(clock)), 1e-9)
    along = 2 * (clock - clock[0]) / span - 1
    yield _fixed("time, smoothly", _splines(along, np.linspace(-1, 1, 7)))
    yield NonparametricTerm("time, by torque", _times(_splines(along, np.linspace(-1, 1, 5)), 2))
    highest = min(PERIODS / 2 / span, 0.4 / max(float(np.median(np.diff(clock))), 1e-9))
    frequency, tried = _strongest(problem, clock, residual, np.ones(len(clock), bool), highest)
    yield _fixed(f"time, period {1 / frequency:.3g} s", _wave(2 * np.pi * frequency * clock), tried)
    yield from _runs(problem, residual)


def _fixed(coordinate: str, columns: Array, n_tried: float = 1.0) -> NonparametricTerm:
    return NonparametricTerm(coordinate, partial(_whatever, columns), n_tried)


def _whatever(columns: Array, torque: Array) -> Array:
    """The same columns under any torque."""
    return columns


def _times(factors: Array, most: int = 4) -> Columns:
    """Products of factors (n, k) with the first of 1, torque, its size and its signed square."""
    return partial(_products, factors, most)


def _products(factors: Array, most: int, torque: Array) -> Array:
    few = np.stack([np.ones_like(torque), torque, np.abs(torque), torque * np.abs(torque)][:most], axis=1)
    return (factors[:, :, None] * few[:, None, :]).reshape(len(torque), -1)


def _curve_times(factor: Array, torque: Array) -> Array:
    return factor * curve_over_torque(torque)


def _scales(own: Array, torque: Array) -> Array:
    return own * torque[:, None]


def curve_over_torque(torque: Array) -> Array:
    """Smooth curves over the torque, with a corner or a bend at zero allowed."""
    reach = max(float(np.abs(torque).max()), 1e-9)
    share = torque / reach
    bends = np.stack([np.abs(share), share * np.abs(share)], axis=1)
    return np.concatenate([_splines(share, np.array(KNOTS)), bends], axis=1)


def _splines(x: Array, knots: Array) -> Array:
    """Cubic B-splines (n, k) over [-1, 1]."""
    padded = np.concatenate([[-1] * 3, knots, [1] * 3])
    return BSpline.design_matrix(np.clip(x, -1, 1), padded, 3).toarray()


def _speeds(speed: Array) -> Array:
    """Functions (n, 3) of a speed over decades, odd and even."""
    slow = max(float(np.quantile(np.abs(speed), 0.5)), 1e-12)
    swing = np.arcsinh(speed / slow)
    swing = swing / max(float(np.abs(swing).max()), 1e-12)
    return np.stack([swing, np.abs(swing), swing**3], axis=1)


def _wave(phase: Array) -> Array:
    return np.stack([np.cos(phase), np.sin(phase)], axis=1)


def _strongest(
    problem: Problem, x: Array, residual: Array, near: NDArray[np.bool_], highest: float
) -> tuple[float, float]:
    """Frequency of the wave over x (n,) that the whitened residual holds most of, and how many differ; looked for
    `near` (n,), up to `highest` cycles per unit of x."""
    span = max(float(np.ptp(x[near])), 1e-9)
    cells = 2 ** int(np.ceil(np.log2(8 * highest * span + 16)))
    place = ((x[near] - x[near].min()) / span * (cells - 1)).round().astype(int)
    values = (residual / np.sqrt(problem.variance))[near]
    power = np.abs(np.fft.rfft(np.bincount(place, values, cells), 4 * cells)) ** 2
    frequency = np.arange(len(power)) / (4 * cells) * (cells - 1) / span
    inside = (frequency >= min(2 / span, 0.5 * highest)) & (frequency <= highest)
    best = int(np.flatnonzero(inside)[power[inside].argmax()])
    return float(frequency[best]), max(1.0, highest * span)


def _runs(problem: Problem, residual: Array) -> Iterator[NonparametricTerm]:
    """A zero of the torque of its own in every run, a scale, and a jump between two runs."""
    run = problem.trace.run[problem.blocks.first]
    numbers = np.unique(run)
    if len(numbers) < 3:
        return
    own = (run[:, None] == numbers).astype(float)
    yield _fixed("zero of each run", own)
    yield NonparametricTerm("scale of each run", partial(_scales, own))
    steps = (run >= numbers[1:, None]).astype(float)
    scale = 1 / np.sqrt(problem.variance)
    centred = steps - (steps @ scale**2 / (scale**2).sum())[:, None]
    energy = (centred @ (residual * scale)) ** 2 / np.maximum(centred**2 @ scale**2, 1e-300)
    best = int(energy.argmax())
    yield _fixed(f"a jump before run {numbers[best + 1]}", steps[best][:, None], len(steps))
