"""Nonparametric terms: smooth functions of what a record varies, without a physical law.

An effect that no name describes is absorbed by effects that have one: a flank that is stiffer than the other looks like
an offset, a softening with temperature like a clearance. A nonparametric term has no name but a coordinate, such as
"temperature, by torque", and free coefficients. These are random effects of a variance s^2, and the marginal likelihood
(Rasmussen and Williams, Gaussian Processes for Machine Learning, 2006, section 2.7) penalises their freedom, so that a
named effect with fewer parameters wins a tie.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array
from stiffness_model.units import ARCMIN

from ..estimation.least_squares import Fit
from ..estimation.problem import Problem
from ..estimation.score_test import absorbing_basis
from .coordinates import over_range, speed_functions, splines, wave
from .law_errors import law_columns

Columns = Callable[[Array], Array]

STRENGTHS = tuple(np.geomspace(3e-4, 0.3, 10).tolist())
"""Standard deviations s of a term's coefficients that are tried, as shares of full torque: from a visible effect to a
third of the torque. Chosen by judgement; the marginal likelihood changes little between neighbours."""
KNOTS = (-1.0, -0.6, -0.3, -0.1, 0.1, 0.3, 0.6, 1.0)
"""Knots of curves over the torque, as shares of its greatest; closer at zero, where play acts. Chosen by judgement."""
CURVE = "torque"
"""Coordinate of the term that is a static curve."""
ORDERS = 4
"""Orders of the crank whose amplitude may depend on the torque: those of the effect kinematic_error."""
HIGHEST_ORDER = 16.0
"""Highest order of the crank that is scanned for a wave of any order; chosen by judgement."""
NEAR_TURNS = 6.0
"""Turns from the record's first angle within which a wave of a fractional order stays in phase; chosen by judgement."""
MIN_WARMING, MIN_TURN = 3.0, 0.5
"""Change of the temperature, K, and of the crank angle, rad, from which terms of them are possible; by judgement."""
MAX_PERIODS = 4000
"""Number of periods in a record up to which oscillations in time are scanned; chosen by judgement."""


@dataclass(frozen=True)
class NonparametricTerm:
    """A family of functions. coordinate: in words, for the report; columns: from the torque (n,) as a share of full
    torque to the columns (n, k) of the coefficients, in the same unit; n_scanned: independent alternatives, such as
    frequencies, from which the columns were picked."""

    coordinate: str
    columns: Columns
    n_scanned: float = 1.0


@dataclass(frozen=True)
class TermFit:
    """A term fitted beside a set of effects. gain: in -2 log marginal likelihood; torque: (n,) N.m, its part of the
    residual; strength: standard deviation of its coefficients, as a share of full torque."""

    term: NonparametricTerm
    gain: float
    torque: Array
    strength: float = 0.0

    @property
    def rms(self) -> float:
        """Root mean square of the torque, N.m."""
        return float(np.sqrt(np.mean(self.torque**2)))


def fit_terms(problem: Problem, fit: Fit, terms: Sequence[NonparametricTerm] = ()) -> list[TermFit]:
    """The given terms, or all that this record can show, each fitted beside a set of effects; the best first."""
    return fit_terms_to(problem, fit, problem.torque - fit.prediction.torque, law_columns(problem, fit), terms)


def fit_terms_to(
    problem: Problem, fit: Fit, residual: Array, errors: Array, terms: Sequence[NonparametricTerm] = ()
) -> list[TermFit]:
    """The same fitted to a residual (n,), N.m; the parameters of the fit stay free, to first order, and the laws of its
    effects may be wrong, by `errors` (n, k), N.m, of `law_columns`."""
    weights, full_torque = fit.weighting, problem.base.full_torque
    columns = np.concatenate([fit.prediction.sensitivities, errors], axis=1)
    basis = absorbing_basis(weights, columns, np.append(fit.bounds.prior_deviation, np.ones(errors.shape[1])))
    residual = weights.whiten(residual)
    residual = residual - basis @ (basis.T @ residual)
    # Of the predicted torque: the measured one holds the noise, and a curve over it would absorb that noise.
    torque = fit.prediction.torque / full_torque
    terms = list(terms or possible_terms(problem, residual))
    columns = [term.columns(torque) for term in terms]
    # All at once: one product of large matrices is faster than many of small ones.
    white = weights.whiten(np.concatenate(columns, axis=1) * full_torque)
    free = white - basis @ (basis.T @ white)
    fits: list[TermFit] = []
    first = 0
    for term, own in zip(terms, columns, strict=True):
        some = slice(first, first := first + own.shape[1])
        gain, strength, coefficients = _marginal_gain(free[:, some], white[:, some], residual)
        # The cost of a uniform prior over the alternatives.
        penalty = 2 * float(np.log(term.n_scanned))
        fits.append(TermFit(term, gain - penalty, own @ coefficients * full_torque, strength))
    return sorted(fits, key=lambda f: -f.gain)


def _marginal_gain(free: Array, white: Array, residual: Array) -> tuple[float, float, Array]:
    """Greatest gain over the strengths, with its strength and the coefficients (k,), of whitened columns `white`
    (n, k), of which `free` (n, k) is the part that the fit's parameters cannot absorb."""
    values, vectors = np.linalg.eigh(free.T @ free)
    along = vectors.T @ (free.T @ residual)
    prior = np.linalg.eigvalsh(white.T @ white).clip(0)
    best, strongest, coefficients = -np.inf, 0.0, np.zeros(free.shape[1])
    for strength in STRENGTHS:
        inverse = 1 / (values.clip(0) + 1 / strength**2)
        gain = float((along**2 * inverse).sum() - np.log1p(strength**2 * prior).sum())
        if gain > best:
            best, strongest, coefficients = gain, strength, vectors @ (along * inverse)
    return best, strongest, coefficients


def possible_terms(problem: Problem, residual: Array) -> Iterator[NonparametricTerm]:
    """The terms that this record can show; residual: (n,) whitened, from which frequencies and steps are picked."""
    trace, mean = problem.trace, problem.blocks.mean
    crank, time, warming = mean(trace.crank), mean(trace.time), mean(trace.temperature) - 20.0
    yield CURVE_TERM
    yield NonparametricTerm("direction of the twist, by torque", _by_torque(mean(trace.twist_direction)[:, None]))
    yield NonparametricTerm("rate of the twist, by torque", _by_torque(speed_functions(mean(trace.twist_rate))))
    speed = mean(trace.output_speed)
    if np.abs(speed).max() > 0:
        yield NonparametricTerm("speed of the output, by torque", _by_torque(speed_functions(speed)))
    if np.ptp(warming) > MIN_WARMING:
        factor = (warming / np.abs(warming).max())[:, None]
        yield NonparametricTerm("temperature, by torque", partial(_factor_times_curve, factor))
    if np.ptp(crank) > MIN_TURN:
        for order in range(1, ORDERS + 1):
            yield NonparametricTerm(f"order {order} of the crank, by torque", _by_torque(wave(order * crank)))
        near = np.abs(crank - crank[0]) < 2 * np.pi * NEAR_TURNS
        order, n = _strongest_frequency(problem, crank / (2 * np.pi), residual, near, HIGHEST_ORDER)
        nearby = wave(order * crank) * near[:, None]
        yield _independent_of_torque(f"order {order:.3g} of the crank at any load", nearby, n)
    scaled = over_range(time)
    yield _independent_of_torque("time, smoothly", splines(scaled, np.linspace(-1, 1, 7)))
    yield NonparametricTerm("time, by torque", _by_torque(splines(scaled, np.linspace(-1, 1, 5)), 2))
    yield _strongest_wave(problem, time, residual, lambda period: f"time, period {period:.3g} s")
    # The measured twist holds the noise of the encoders, which the residual holds as well.
    twist = mean(trace.smooth_twist)
    yield _strongest_wave(problem, twist, residual, lambda period: f"twist, period {period / ARCMIN:.3g} arcmin")
    yield from _terms_of_runs(problem, residual)


def _terms_of_runs(problem: Problem, residual: Array) -> Iterator[NonparametricTerm]:
    """A zero and a scale of the torque for every run, and a jump between two runs."""
    run = problem.trace.run[problem.blocks.first]
    numbers = np.unique(run)
    if len(numbers) < 3:
        return
    indicator = (run[:, None] == numbers).astype(float)
    yield _independent_of_torque("zero of each run", indicator)
    yield NonparametricTerm("scale of each run", partial(_proportional_to_torque, indicator))
    steps = (run >= numbers[1:, None]).astype(float)
    scale = 1 / np.sqrt(problem.variance)
    centred = steps - (steps @ scale**2 / (scale**2).sum())[:, None]
    energy = (centred @ (residual * scale)) ** 2 / np.maximum(centred**2 @ scale**2, 1e-300)
    best = int(energy.argmax())
    yield _independent_of_torque(f"a jump before run {numbers[best + 1]}", steps[best][:, None], len(steps))


def curve_over_torque(torque: Array) -> Array:
    """Columns (n, k) of smooth curves over a torque (n,), with a kink or a change of curvature at zero."""
    share = torque / max(float(np.abs(torque).max()), 1e-9)
    even = np.stack([np.abs(share), share * np.abs(share)], axis=1)
    return np.concatenate([splines(share, np.array(KNOTS)), even], axis=1)


CURVE_TERM = NonparametricTerm(CURVE, curve_over_torque)
"""A static curve."""


def _independent_of_torque(coordinate: str, columns: Array, n_scanned: float = 1.0) -> NonparametricTerm:
    return NonparametricTerm(coordinate, partial(_constant_columns, columns), n_scanned)


def _by_torque(factors: Array, n_powers: int = 4) -> Columns:
    """Products of factors (n, k) with the first of: 1, torque, its magnitude, its signed square."""
    return partial(_products, factors, n_powers)


def _constant_columns(columns: Array, torque: Array) -> Array:
    return columns


def _products(factors: Array, n_powers: int, torque: Array) -> Array:
    powers = np.stack([np.ones_like(torque), torque, np.abs(torque), torque * np.abs(torque)][:n_powers], axis=1)
    return (factors[:, :, None] * powers[:, None, :]).reshape(len(torque), -1)


def _factor_times_curve(factor: Array, torque: Array) -> Array:
    return factor * curve_over_torque(torque)


def _proportional_to_torque(indicator: Array, torque: Array) -> Array:
    return indicator * torque[:, None]


def _strongest_wave(
    problem: Problem, x: Array, residual: Array, coordinate: Callable[[float], str]
) -> NonparametricTerm:
    """The wave over x (n,) with the largest amplitude, of any period that the blocks resolve; coordinate: in words,
    from the period."""
    way = np.abs(np.diff(x))[np.diff(problem.trace.run[problem.blocks.first]) == 0]
    # The mean step over the way: blocks in which x stands still resolve no period.
    step, span = float((way**2).sum() / max(way.sum(), 1e-300)), max(float(np.ptp(x)), 1e-9)
    highest = min(MAX_PERIODS / 2 / span, 0.4 / max(step, 1e-9))
    frequency, n = _strongest_frequency(problem, x, residual, np.ones(len(x), bool), highest)
    return _independent_of_torque(coordinate(1 / frequency), wave(2 * np.pi * frequency * x), n)


def _strongest_frequency(
    problem: Problem, x: Array, residual: Array, inside: NDArray[np.bool_], highest: float
) -> tuple[float, float]:
    """Frequency with the largest amplitude of the whitened residual over x (n,), and the number of independent ones.

    Only blocks `inside` (n,) count; highest: cycles per unit of x.
    """
    span = max(float(np.ptp(x[inside])), 1e-9)
    cells = 2 ** int(np.ceil(np.log2(8 * highest * span + 16)))
    cell = ((x[inside] - x[inside].min()) / span * (cells - 1)).round().astype(int)
    values = (residual / np.sqrt(problem.variance))[inside]
    power = np.abs(np.fft.rfft(np.bincount(cell, values, cells), 4 * cells)) ** 2
    frequency = np.arange(len(power)) / (4 * cells) * (cells - 1) / span
    scanned = (frequency >= min(2 / span, 0.5 * highest)) & (frequency <= highest)
    best = int(np.flatnonzero(scanned)[power[scanned].argmax()])
    return float(frequency[best]), max(1.0, highest * span)
