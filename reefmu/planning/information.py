"""Fisher information of the effects along any choice of motion pieces, from one record of the whole library.

The covariance of a record is N + U U^T: noise, which is independent between runs, and the scatter of the individual
drive, whose random effects all runs share. With A the whitened columns of effects, base model and random effects, the
products A^T A of the runs add up, and information about the effects is the Schur complement of the rest in their sum,
with the identity as the prior information on the random effects (Harville, Maximum Likelihood Approaches to Variance
Component Estimation, 1977). Adding a piece therefore costs one sum of small matrices, and no covariance of a record.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from stiffness_model.numerics.arrays import Array

from ..diagnosis.discrimination.effect_columns import ACCUMULATING, Sensitivities
from ..diagnosis.estimation.score_test import eliminate
from .diagnosis_link import noise_whitened
from .protocols.rig import RigNoise
from .protocols.schedule import Schedule


@dataclass(frozen=True)
class PieceInformation:
    """Products of the whitened columns by run of the library.

    products: (r, t, t) of the columns of effects, base model and scatter, t = n_effects + n_base + m; library: the
    schedule of the runs; continued: columns of effects that accumulate over the record, as (column, column of the
    effect that a later start adds, ratio of their sizes, name of the effect).
    """

    products: Array
    n_effects: int
    n_base: int
    library: Schedule
    continued: tuple[tuple[int, int, float, str], ...]


def piece_information(s: Sensitivities, library: Schedule, noise: RigNoise) -> PieceInformation:
    """The products of all runs of a record along the schedule `library`, measured with this noise."""
    rows = np.concatenate(noise_whitened(s, noise), axis=1)
    added = {v.effect: v for v in s.variants if v.effect in ACCUMULATING.values()}
    continued = tuple(
        (v.columns[0], added[ACCUMULATING[v.effect]].columns[0], v.size / added[ACCUMULATING[v.effect]].size, v.effect)
        for v in (*s.variants, *s.truths)
        if ACCUMULATING.get(v.effect) in added
    )
    products = _products(rows, s.run, len(library))
    return PieceInformation(products, s.columns.shape[1], s.base.shape[1], library, continued)


def record_information(s: Sensitivities, noise: RigNoise) -> Array:
    """(k, k) information of the effects' columns along a whole record, measured with this noise."""
    rows = np.concatenate(noise_whitened(s, noise), axis=1)
    return eliminate(rows.T @ rows, s.columns.shape[1], s.base.shape[1])


def _products(rows: Array, run: NDArray[np.int64], count: int) -> Array:
    return np.stack([rows[run == number].T @ rows[run == number] for number in range(count)])


def summed_products(pieces: PieceInformation, chosen: Sequence[int]) -> Array:
    """(t, t) sum of the products of pieces, by their index in the library, at the times that they have there."""
    total = np.zeros(pieces.products.shape[1:])
    for place in _places(pieces.library, chosen):
        total += pieces.products[place]
    return total


def total_information(pieces: PieceInformation, schedule: Schedule, summed: Array | None = None) -> Array:
    """(k, k) information of the effects' columns along a schedule; base model and scatter are eliminated.

    summed: (t, t) products of its pieces as `summed_products` gives them, computed if None.
    Drift and wear go on over the whole record: a run that starts later than in the library's record, or after more
    turns, adds an offset or a clearance to their columns.
    """
    places = _places(pieces.library, schedule.chosen)
    total = summed_products(pieces, schedule.chosen) if summed is None else summed.copy()
    shift = {
        "torque_sensor_drift": schedule.begin - pieces.library.begin[places],
        "wear": schedule.travelled - pieces.library.travelled[places],
    }
    # The columns become A (I + s E), with the shift s of a run and E, which has one entry for each continued column.
    entries = [(to, source, ratio * shift[name]) for to, source, ratio, name in pieces.continued]
    rows = {source: pieces.products[places, source, :] for source in {source for _, source, _ in entries}}
    for to, source, by in entries:
        moved = by @ rows[source]
        total[to, :] += moved
        total[:, to] += moved
    for to, source, by in entries:
        for other, other_source, other_by in entries:
            total[to, other] += float((by * other_by) @ rows[source][:, other_source])
    return eliminate(total, pieces.n_effects, pieces.n_base)


def _places(library: Schedule, chosen: Sequence[int]) -> NDArray[np.intp]:
    """Positions of pieces, by their index in the library, in the library's own schedule."""
    where = {index: place for place, index in enumerate(library.chosen)}
    return np.array([where[index] for index in chosen], np.intp)
