"""Score tests: the gain of a candidate to first order, without fitting it.

The torque of an effect is nearly linear in its amplitudes, so a projection of the residual on its sensitivities gives
the reduction of the cost (Rao's score test). Lengths, times, speeds and phases, in which it is not linear, are varied
over a few values each; every combination is a variant of the candidate.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solve_triangular

from stiffness_model.numerics.arrays import Array

from ...effects import Effect, find_effect
from ..preprocessing.trace import Trace
from .least_squares import COST_DIGITS, Fit, is_logarithmic, may_be_infinite
from .problem import Problem
from .weighting import Weighting

LARGE_CRANK_TWIST = 0.15
"""Twist, rad at the crank, from which the wind-up of the crank is also started at its upper end. Chosen by judgement:
below, the position of a missing ball hardly depends on it."""
LENGTHS = (0.012, 0.08)
"""Starting values of a length of twist, over the base curve's greatest twist. Chosen by judgement for presliding."""
TIMES = (0.03, 0.15)
"""Starting values of a time, over the longest run. Chosen by judgement: shorter ones look static, longer ones drift."""
ONSETS = (0.7, 10.0)
"""Starting values of a time that may be infinite, over the whole record. Chosen by judgement: within and beyond it."""
SPEED_QUANTILES = (0.1, 0.5, 0.9)
"""Quantiles of the moving output's speed that start a speed. Chosen by judgement to cover what the record visits."""
MIN_BASE_EIGENVALUE = 1e-9
"""Eigenvalue of the correlations of free parameters' columns below which it counts as zero: rounding."""


@dataclass(frozen=True)
class Direction:
    """One variant of a candidate, linearised in its amplitudes.

    start: (q,) parameters with neutral amplitudes; sizes: indices of the amplitudes; columns: (n, m), N.m per unit,
    their sensitivities; one_sided: whether amplitudes cannot be negative; paired: whether the columns are
    sines followed by cosines of the same amplitudes.
    """

    name: str
    start: Array
    sizes: tuple[int, ...]
    columns: Array
    one_sided: bool
    paired: bool


def amplitudes(effect: Effect) -> list[int]:
    """Indices of the parameters that switch an effect on: at their neutral value it has no influence."""
    return [
        k
        for k, p in enumerate(effect.parameters)
        if not is_logarithmic(p) and not p.name.startswith("phase") and p.name != "windup"
    ]


def is_of_one_element(effect: Effect) -> bool:
    """Whether an effect is that of one element, by its phase."""
    return any(p.name == "phase" for p in effect.parameters)


def start_variants(effect: Effect, trace: Trace, max_twist: float, elements: int) -> list[Array]:
    """Parameter vectors of an effect with neutral amplitudes and varied lengths, times, speeds and phases.

    max_twist: rad, of the base curve; elements: of the drive, whose distance is the step of a phase: beside the scatter
    the trace of one element is like that of its neighbour, and less like those farther away.
    """
    variants: list[dict[str, float]] = [{}]
    if is_of_one_element(effect):
        variants = [{"phase": float(phase)} for phase in 2 * np.pi * np.arange(elements) / elements - np.pi]
    if any(p.name == "windup" for p in effect.parameters):
        # Where the crank hardly winds up a fit converges from either end.
        ends = (0.0, 1.0) if max_twist * abs(trace.crank_factor) > LARGE_CRANK_TWIST else (0.0,)
        variants = [{**v, "windup": share} for v in variants for share in ends]
    speeds = np.abs(trace.output_speed)
    moving = speeds[speeds > 0.02 * speeds.max()] if speeds.max() > 0 else np.array([0.05])
    longest = max(float(trace.time[b - 1] - trace.time[a]) for a, b in trace.run_ranges)
    typical = {
        "rad": [share * max_twist for share in LENGTHS],
        "s": [share * longest for share in TIMES],
        "rad/s": np.quantile(moving, SPEED_QUANTILES).tolist(),
    }
    for p in effect.parameters:
        if not is_logarithmic(p):
            continue
        values = typical.get(p.unit, [p.nominal])
        if may_be_infinite(p):
            values = [factor * float(trace.time[-1] - trace.time[0]) for factor in ONSETS]
        variants = [{**v, p.name: float(np.clip(x, p.minimum, p.maximum))} for v in variants for x in values]
    return [np.array([v.get(p.name, p.neutral) for p in effect.parameters]) for v in variants]


def linearise(problem: Problem, name: str, at: Fit, further: Iterable[Array] = ()) -> list[Direction]:
    """All variants of a candidate, and `further` ones (parameters (q,) each), linearised about a fit.

    With neutral amplitudes no variant changes another: one prediction with all of them has the columns of each.
    """
    effect = find_effect(name)
    sizes = tuple(amplitudes(effect))
    elements = 1 if problem.base.drive is None else problem.base.drive.elements
    starts = [*start_variants(effect, problem.trace, problem.base.max_twist, elements), *further]
    predictor = problem.for_ranking.predictor((*at.names, *(name for _ in starts)))
    places = [list(np.array(sizes) + where.start) for where in predictor.slices[len(at.names) :]]
    of_orders = [k for k, p in enumerate(effect.parameters) if p.name.startswith("phase_")]
    paired = bool(of_orders)
    parts: list[list[Array]] = []
    for phase in (0.0, np.pi / 2) if paired else (0.0,):
        turned = np.array(starts)
        turned[:, of_orders] = phase
        sensitivities = predictor(np.concatenate([at.parameters, turned.ravel()])).sensitivities
        parts.append([sensitivities[:, where] for where in places])
    one_sided = not paired and all(effect.parameters[k].minimum == effect.parameters[k].neutral for k in sizes)
    return [
        Direction(name, start, sizes, np.concatenate(columns, axis=1), one_sided, paired)
        for start, *columns in zip(starts, *parts, strict=True)
    ]


def absorbing_basis(weights: Weighting, columns: Array, deviation: Array) -> Array:
    """Basis Q (n, r) for which x - Q Q^T x is what parameters leave of whitened values x, whitened for them as well.

    columns: (n, k) N.m, derivatives by the parameters; deviation: (k,) standard deviations of their Gaussian priors. A
    free parameter, of infinite deviation, absorbs its column wholly, so that Q is orthonormal; a prior lets it absorb
    as much of it as is plausible. Linearly dependent columns are dropped.
    """
    free = np.isinf(deviation)
    span = _orthonormal(weights.whiten(columns[:, free]))
    held = weights.whiten(columns[:, ~free] * deviation[~free])
    vectors, size, _ = np.linalg.svd(held - span @ (span.T @ held), full_matrices=False)
    # (I + U S^2 U^T)^(-1/2) = I - U (1 - 1 / sqrt(1 + S^2)) U^T
    return np.concatenate([span, vectors * np.sqrt(1 - 1 / np.sqrt(1 + size**2))], axis=1)


def eliminate(total: Array, n_kept: int, n_base: int) -> Array:
    """(n_kept, n_kept) Schur complement in products (t, t) of n_kept columns, of n_base columns of free parameters, and
    of random effects with unit prior information."""
    k, inner = n_kept, n_kept + n_base
    with_random = total[:inner, :inner]
    if total.shape[0] > inner:
        across = total[inner:, :inner]
        lower = np.linalg.cholesky(total[inner:, inner:] + np.eye(total.shape[0] - inner))
        half = solve_triangular(lower, across, lower=True, check_finite=False)
        with_random = with_random - half.T @ half
    # Free parameters have any units: only the correlation of their columns counts.
    unit = np.sqrt(np.maximum(np.diag(with_random)[k:], 1e-300))
    values, vectors = np.linalg.eigh(with_random[k:, k:] / np.outer(unit, unit))
    keep = values > MIN_BASE_EIGENVALUE
    half = (vectors[:, keep] / np.sqrt(values[keep])).T @ (with_random[k:, :k] / unit[:, None])
    return with_random[:k, :k] - half.T @ half


def _orthonormal(white: Array) -> Array:
    """Orthonormal basis (n, r) of columns (n, k)."""
    norm = np.linalg.norm(white, axis=0)
    keep = norm > 1e-12 * max(float(norm.max(initial=0.0)), 1e-300)
    q, r = np.linalg.qr(white[:, keep] / norm[keep])
    return q[:, np.abs(np.diag(r)) > 1e-7]


def score_gains(
    directions: Sequence[Direction], weights: Weighting, basis: Array, residual: Array
) -> list[tuple[float, Array]]:
    """The reduction of the cost by every direction, and its amplitudes (k,), on a whitened residual (n,) that is
    orthogonal to `basis` (n, r)."""
    if not directions:
        return []
    # All at once: one product of large matrices is faster than many of small ones.
    white = weights.whiten(np.concatenate([direction.columns for direction in directions], axis=1))
    free = white - basis @ (basis.T @ white)
    ends = np.cumsum([direction.columns.shape[1] for direction in directions])[:-1]
    whole = (float(np.linalg.norm(own)) for own in np.split(white, ends, axis=1))
    parts = zip(directions, np.split(free, ends, axis=1), whole, strict=True)
    return [_score(direction, own, norm, residual) for direction, own, norm in parts]


def _score(direction: Direction, free: Array, norm: float, residual: Array) -> tuple[float, Array]:
    """`score_gains` of one direction. free: (n, k), its whitened columns orthogonal to the basis; norm: of all of
    them."""
    if not norm > 0:
        return 0.0, np.zeros(free.shape[1])
    q, r = np.linalg.qr(free)
    along = q.T @ residual
    along[np.abs(np.diag(r)) <= 1e-6 * norm] = 0.0
    sizes = np.linalg.lstsq(r, along, rcond=1e-10)[0]
    hindered = direction.one_sided and len(sizes) == 1 and sizes[0] <= 0
    return 0.0 if hindered else float(along @ along), np.asarray(sizes, float)


def starting_parameters(direction: Direction, sizes: Array) -> Array:
    """Parameters (q,) of the candidate for the linear amplitudes `sizes` (k,), within its bounds."""
    effect = find_effect(direction.name)
    p = direction.start.copy()
    m = len(direction.sizes)
    for j, k in enumerate(direction.sizes):
        q = effect.parameters[k]
        if direction.paired:
            # a sin(x + phase) = a cos(phase) sin x + a sin(phase) cos x
            p[k] = float(np.hypot(sizes[j], sizes[m + j]))
            phase = next(
                i for i, other in enumerate(effect.parameters) if other.name == q.name.replace("amplitude", "phase")
            )
            p[phase] = float(np.arctan2(sizes[m + j], sizes[j]))
        else:
            p[k] = sizes[j]
        p[k] = np.clip(p[k], q.minimum, q.maximum)
    return p


def rank_directions(
    problem: Problem, at: Fit, directions: Sequence[Direction], size: float
) -> list[tuple[float, str, Array]]:
    """(gain, name, starting parameters) of directions linearised about a fit, on its residual, largest gain first.

    size: of the scatter under which the gains are computed.
    """
    weights = at.weighting.with_size(size)
    basis = absorbing_basis(weights, at.prediction.sensitivities, at.bounds.prior_deviation)
    residual = weights.whiten(problem.torque - at.prediction.torque)
    residual = residual - basis @ (basis.T @ residual)
    gains = score_gains(directions, weights, basis, residual)
    scored = [(gain, d.name, starting_parameters(d, sizes)) for d, (gain, sizes) in zip(directions, gains, strict=True)]
    return sorted(scored, key=lambda item: (-round(item[0], COST_DIGITS), item[1]))


def amplitude_beside_alike(problem: Problem, at: Fit, name: str) -> float:
    """Amplitude of a candidate with one direction, to first order about a fit and beside all candidates of its
    confounding groups, which would otherwise look like it."""
    groups = {other: {*find_effect(other).identification.confounding_groups} for other in problem.candidates}
    alike = [other for other in problem.candidates if other != name and groups[other] & groups[name]]
    (own,), weights = linearise(problem, name, at), at.weighting
    beside = [d.columns for other in alike for d in linearise(problem, other, at)]
    columns = np.concatenate([at.prediction.sensitivities, *beside], axis=1)
    deviation = np.full(columns.shape[1], np.inf)
    deviation[: len(at.parameters)] = at.bounds.prior_deviation
    basis = absorbing_basis(weights, columns, deviation)
    residual = weights.whiten(problem.torque - at.prediction.torque)
    ((_, sizes),) = score_gains([own], weights, basis, residual - basis @ (basis.T @ residual))
    return float(starting_parameters(own, sizes)[own.sizes[0]])
