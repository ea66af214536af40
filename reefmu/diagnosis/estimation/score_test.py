"""Score tests: what a candidate would gain, to first order, without fitting it.

A candidate's torque is nearly linear in its size, so that a projection tells how much of a residual it could
take. Lengths, times and phases are tried at a few values each.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from stiffness_model.numerics.arrays import Array

from ...effects import find_effect
from .least_squares import Fit
from .problem import Problem, amplitudes, start_variants
from .weighting import Weighting

STEP = 0.02
"""Size at which slopes by phases are taken, in nominal sizes."""


@dataclass(frozen=True)
class Direction:
    """One variant of a candidate: its parameters with sizes neutral, the indices of its sizes and their columns
    (n, m), N.m per unit; one_sided: sizes that cannot be negative; paired: columns come as sine and cosine."""

    name: str
    start: Array
    sizes: tuple[int, ...]
    columns: Array
    one_sided: bool
    paired: bool


def linearise(problem: Problem, name: str, at: Fit) -> list[Direction]:
    """All variants of a candidate, linearised about a fit."""
    effect = find_effect(name)
    sizes = amplitudes(effect)
    predictor = problem.predictor((*at.names, name))
    paired = any(p.name.startswith("phase_") for p in effect.parameters)
    found = []
    for start in start_variants(effect, problem.trace, problem.base.max_twist):
        first = len(at.parameters)
        parts = []
        for phase in (0.0, np.pi / 2) if paired else (0.0,):
            p = start.copy()
            for k, q in enumerate(effect.parameters):
                if q.name.startswith("phase_"):
                    p[k] = phase
            parts.append(predictor(np.concatenate([at.parameters, p])).sensitivities[:, [first + k for k in sizes]])
        columns = np.concatenate(parts, axis=1)
        one_sided = not paired and all(effect.parameters[k].minimum == effect.parameters[k].neutral for k in sizes)
        found.append(Direction(name, start, tuple(sizes), columns, one_sided, paired))
    return found


def orthonormal_basis(weights: Weighting, known: Array) -> Array:
    """Orthonormal basis (n, k) of the whitened columns `known` (n, k)."""
    white = weights.whiten(known)
    norm = np.linalg.norm(white, axis=0)
    keep = norm > 1e-12 * max(float(norm.max(initial=0.0)), 1e-300)
    q, r = np.linalg.qr(white[:, keep] / norm[keep])
    good = np.abs(np.diag(r)) > 1e-7
    return q[:, good]


def score_gains(direction: Direction, weights: Weighting, basis: Array, residuals: Array) -> tuple[Array, Array, float]:
    """What a direction would gain on whitened residuals (n, m): cost (m,), sizes (k, m), and the share of the
    direction that the parameters of `basis` cannot imitate.
    """
    white = weights.whiten(direction.columns)
    own = np.linalg.norm(white)
    rest = white - basis @ (basis.T @ white)
    q, r = np.linalg.qr(rest)
    share = float(np.linalg.norm(rest) / own) if own > 0 else 0.0
    solid = np.abs(np.diag(r)) > 1e-6 * max(float(own), 1e-300)
    along = q.T @ residuals
    along[~solid] = 0.0
    sizes = np.linalg.lstsq(r, along, rcond=1e-10)[0] if own > 0 else np.zeros((white.shape[1], residuals.shape[1]))
    gain = (along**2).sum(axis=0)
    if direction.one_sided and white.shape[1] == 1:
        gain = np.where(sizes[0] > 0, gain, 0.0)
    return gain, np.asarray(sizes, float), share


def starting_parameters(direction: Direction, sizes: Array) -> Array:
    """Parameters of the candidate from the linear sizes (k,)."""
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
    problem: Problem, at: Fit, found: Iterable[Direction], size: float
) -> list[tuple[float, str, Array]]:
    """(gain, name, starting parameters) of every direction, linearised about a fit, on that fit's residual, best first.

    size: of the scatter.
    """
    weights = at.weighting.with_size(size)
    basis = orthonormal_basis(weights, at.prediction.sensitivities)
    residual = weights.whiten(problem.torque - at.prediction.torque)[:, None]
    residual = residual - basis @ (basis.T @ residual)
    scored = []
    for direction in found:
        gain, sizes, _ = score_gains(direction, weights, basis, residual)
        scored.append((float(gain[0]), direction.name, starting_parameters(direction, sizes[:, 0])))
    return sorted(scored, key=lambda item: -item[0])
