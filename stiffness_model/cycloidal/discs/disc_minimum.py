"""Equilibrium of discs whose crank is held: Newton's method on the stored energy, three unknowns for each state.

A state is one disc at one twist of the output. Its displacement and rotation minimise the energy of its contacts and
its bearing. Newton's steps are damped where they do not reduce the energy (Levenberg and Marquardt; J. Nocedal, S.
Wright, Numerical Optimization, 2nd ed., section 10.3). All states are iterated together; those that have converged
leave the iteration.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from ...numerics.arrays import Array
from .disc_contacts import DiscContacts
from .disc_energy import DiscEnergy, DiscStates

MAX_STEPS = 120
"""Newton steps after which a state counts as not converged; chosen by judgement, some ten are usual."""
TOLERANCE = 1e-9
"""Residual force of a disc in equilibrium, relative to the sum of its contact forces; chosen by judgement, far below
the error of any contact law."""
STALLED_TOLERANCE = 1e-6
"""The same where rounding of the pose allows no better; chosen by judgement, below the error of any contact law."""
ROUNDING = 4e-17
"""Displacement relative to the pin circle's radius below which a step changes nothing: the rounding of double-precision
numbers at the greatest displacements in use, some hundredths of that radius, with a reserve of ten."""
LEAST_APPROACH = 1e-10
"""Approach, m, whose contact force may remain as residual of a disc without load; chosen by judgement, far below any
roughness (an atom is 1e-10 wide)."""
COARSE_STEP = 10
"""Distance of the twists that are solved first, so that the others start between solutions; chosen by measurement."""
LONGEST_STEP = 1e-4
"""Greatest displacement, m, in a direction in which the energy is not convex; chosen by judgement, above the usual
clearances."""
TYPICAL_APPROACH = 1e-5
"""Approach, m, at which the first poses take the contacts' stiffness, which hardly depends on it (by its ninth root);
chosen by judgement."""
FEWER_ROWS, FEWER_TWISTS = 0.8, 0.9
"""Shares of the iterated rows, and of twists in the slowest row, below which the finished ones are left out; chosen by
measurement."""


@dataclass(frozen=True, eq=False)
class Minimum:
    """Poses (D, T, 4), m, of least energy, with energy and derivatives there; whether they converged, (D, T); Newton
    steps of the slowest state.
    """

    pose: Array
    state: DiscStates
    converged: NDArray[np.bool_]
    steps: int


def least_energy(contacts: DiscContacts, twist: Array, output: Array, start: Array | None = None) -> Minimum:
    """The equilibrium of D rows at twists (D, T), rad, in the same order in all rows.

    output: (D, T) rad, further twist by a rotation of the output in the opposite sense. start: (D, T, 3) m, first
    displacements and rotations; without them, some of the twists are solved first.
    """
    rows, n = twist.shape
    field, centre = DiscEnergy(contacts), contacts.centre(twist)
    given = contacts.radius * output[..., None]
    if start is None and n > 2 * COARSE_STEP:
        order = np.argsort(twist[0], kind="stable")
        knots = np.append(np.arange(0, n - 1, COARSE_STEP), n - 1)
        few = order[knots]
        first = np.concatenate([_linear_start(contacts, centre[:, few]), given[:, few]], -1)
        coarse = _minimise(contacts, field, centre[:, few], first).pose[..., :3]
        place = np.interp(np.arange(n), knots, np.arange(len(knots)))
        low = np.minimum(place.astype(np.intp), len(knots) - 2)
        share = (place - low)[:, None]
        start = np.empty((rows, n, 3))
        start[:, order] = (1 - share) * coarse[:, low] + share * coarse[:, low + 1]
    first = _linear_start(contacts, centre) if start is None else start
    return _minimise(contacts, field, centre, np.concatenate([first, given], -1))


def _linear_start(contacts: DiscContacts, centre: Array) -> Array:
    """First poses, (D, T, 3): those of linear contacts without clearances that carry load in both directions.

    Half of the contacts' stiffness at `TYPICAL_APPROACH` represents those of which half carries load.
    """
    derivatives = contacts.normal[:, :3]
    soft = contacts.series + 1 / (contacts.stiffness * TYPICAL_APPROACH ** (1 / 9))
    matrix = (derivatives / (2 * soft)) @ derivatives.swapaxes(1, 2)
    if contacts.is_rigid:
        rotation = -(matrix[:, 2:, :2] @ centre.swapaxes(1, 2)) / matrix[:, 2:, 2:]
        return np.concatenate([centre, rotation.swapaxes(1, 2)], -1)
    bearing = contacts.bearing_stiffness[..., None] * np.eye(3)[:, :2]
    matrix[:, :, :2] += bearing
    return centre @ np.linalg.solve(matrix, bearing).swapaxes(1, 2)


def _minimise(contacts: DiscContacts, field: DiscEnergy, centre: Array, pose: Array) -> Minimum:
    """`least_energy` from given first poses (D, T, 4), with the eccentric's centre displaced by `centre`, (D, T, 2)."""
    rigid, shape = contacts.is_rigid, pose.shape[:2]
    if rigid:
        pose[..., :2] = centre
    least = contacts.stiffness.min((1, 2))[:, None] * LEAST_APPROACH ** (10 / 9)
    # Rows and twists that are iterated: (D',) and (D', T') indices.
    rows, twists = np.arange(shape[0]), np.broadcast_to(np.arange(shape[1]), shape)
    state = field.at(pose, centre)
    result = Minimum(pose.copy(), state.copy(), np.zeros(shape, bool), 0)
    damping, stalled = np.zeros(shape), np.zeros(shape, bool)
    steps = 0
    for steps in range(MAX_STEPS + 1):
        residual = _residual(state, rigid)
        done = stalled | (residual <= TOLERANCE * state.total_force + least[rows])
        remaining = int((~done).sum(1).max()) if steps < MAX_STEPS else 0
        kept = np.flatnonzero(~done.all(1))
        if remaining < FEWER_TWISTS * twists.shape[1] or len(kept) < FEWER_ROWS * len(rows):
            place = rows[:, None], twists
            result.pose[place] = pose
            result.state.put(place, state)
            result.converged[place] = residual <= STALLED_TOLERANCE * state.total_force + least[rows]
            if not remaining:
                break
            if len(kept) < FEWER_ROWS * len(rows):
                rows, field = rows[kept], field.rows(kept)
            else:
                kept = np.arange(len(rows))
            # The unfinished twists of every row come first; rows with fewer of them keep some that are finished.
            index = np.argsort(done[kept], axis=1, kind="stable")[:, :remaining]
            place = kept[:, None], index
            twists, state, pose, centre = twists[place], state.at(place), pose[place], centre[place]
            done, stalled, damping, residual = done[place], stalled[place], damping[place], residual[place]
        step = _step(state, damping, rigid)
        moved = pose.copy()
        moved[..., :3] -= step
        candidate = field.at(moved, centre)
        # Where the energies differ by less than their rounding, the residual decides.
        tied = np.abs(candidate.energy - state.energy) <= 1e-12 * np.abs(state.energy)
        better = ~done & np.where(tied, _residual(candidate, rigid) < residual, candidate.energy < state.energy)
        # A step below the rounding of the pose that improves nothing is the last: damping would not help.
        stalled |= ~better & (np.abs(step).max(-1) <= ROUNDING * contacts.radius)
        pose, state = np.where(better[..., None], moved, pose), candidate.where(better, state)
        damping = np.where(better, damping / 16, np.clip(8 * damping, 1e-4, 1e12))
        damping[damping < 1e-8] = 0.0
    return replace(result, steps=steps)


def _residual(state: DiscStates, rigid: bool) -> Array:
    """Residual generalised force on the disc, (D, T) N."""
    gradient = state.gradient[..., 2:3] if rigid else state.gradient[..., :3]
    return np.sqrt((gradient * gradient).sum(-1))


def _step(state: DiscStates, damping: Array, rigid: bool) -> Array:
    """The steps (D, T, 3), against their sign, that lead to the minimum of the damped quadratic model."""
    h, g = state.hessian, state.gradient
    (xx, xy, xs), (yy, ys), ss = (h[..., k] for k in (0, 1, 2)), (h[..., k] for k in (4, 5)), h[..., 7]
    # A tiny part of the trace keeps directions without stiffness regular; no force acts along them.
    add = (damping + 1e-11) * (xx + yy + ss) + 1e-300
    xx, yy, ss = xx + add, yy + add, ss + add
    if rigid:
        zero = np.zeros_like(ss)
        return np.stack([zero, zero, g[..., 2] / ss], -1)
    # Cramer's rule for a symmetric matrix of three rows.
    a, b, c = yy * ss - ys * ys, xs * ys - xy * ss, xy * ys - yy * xs
    d, e, f = xx * ss - xs * xs, xy * xs - xx * ys, xx * yy - xy * xy
    determinant = xx * a + xy * b + xs * c
    usable = (xx > 0) & (f > 0) & (determinant > 0)
    scale = 1.0 / np.where(usable, determinant, 1.0)
    gx, gy, gs = g[..., 0], g[..., 1], g[..., 2]
    newton = np.stack([a * gx + b * gy + c * gs, b * gx + d * gy + e * gs, c * gx + e * gy + f * gs], -1)
    step = newton * scale[..., None]
    if not usable.all():
        matrices = np.stack([xx, xy, xs, xy, yy, ys, xs, ys, ss], -1)[~usable].reshape(-1, 3, 3)
        step[~usable] = _bounded_step(matrices, g[..., :3][~usable])
    return step


def _bounded_step(matrix: Array, gradient: Array) -> Array:
    """Steps (k, 3), against their sign, of k models whose matrices (k, 3, 3) are not positive definite.

    Negative eigenvalues, of directions in which normals turn under load or the disc rolls within its clearances, are
    reversed; the step is at most `LONGEST_STEP`, and damping shortens it.
    """
    values, vectors = np.linalg.eigh(matrix)
    size = np.maximum(np.abs(values), 1e-9 * np.abs(values).max(-1, keepdims=True) + 1e-300)
    along = (vectors * gradient[..., None]).sum(-2) / size
    step = (vectors * along[:, None]).sum(-1)
    length = np.sqrt((step * step).sum(-1, keepdims=True))
    return step * np.minimum(1.0, LONGEST_STEP / np.maximum(length, LONGEST_STEP))
