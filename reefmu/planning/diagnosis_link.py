"""What a plan takes from the diagnosis: its problem for a record that is not measured yet, and its covariance of the
noise of a rig."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from stiffness_model.drawing.drive import Drive
from stiffness_model.numerics.arrays import Array

from ..diagnosis.discrimination.effect_columns import Sensitivities
from ..diagnosis.estimation.least_squares import Fit
from ..diagnosis.estimation.problem import SEARCH_BLOCKS, Problem
from ..diagnosis.estimation.weighting import MIN_EIGENVALUE
from ..diagnosis.preparation import BaseCurveSource, prepare_problem, prepare_same_motion
from ..diagnosis.preprocessing.trace import make_trace
from ..diagnosis.random_effects.tolerance_scatter import Spread, in_turn
from ..effects.effect_facts import select_candidates
from ..record import Record
from .protocols.rig import RigNoise

N_PROBES = 16
"""Random signs from which the precision of single blocks is estimated; one is exact for independent noise, 16 give it
within a few percent for autocorrelated noise."""


def excluded_effects(missing: Sequence[str]) -> dict[str, str]:
    """Effects that the diagnosis of a drawing cannot name from records without the columns `missing`, with the
    reason."""
    return select_candidates(missing, "drawing")[1]


def record_problem(drive: Drive, record: Record, blocks: int = SEARCH_BLOCKS) -> tuple[Problem, Fit]:
    """The diagnosis' problem for the record of a simulated drive, of about so many blocks, and its fit without
    effects."""
    return problems_of_records(drive, [record], blocks)[0]


def problems_of_records(
    drive: Drive, records: Sequence[Record], blocks: int = SEARCH_BLOCKS, spread: Spread = in_turn
) -> list[tuple[Problem, Fit]]:
    """The same for records of one motion: they share the scatter of individual drives, which takes most of the time.
    No filter is sought: these records have passed none. spread: shares the work among processes."""
    traces = [make_trace(record, drive.ratio) for record in records]
    base = BaseCurveSource(drive).base_curve(traces[0])
    first = prepare_problem(records[0], traces[0], base, spread, blocks, time_constants=(0.0,))
    others = [prepare_same_motion(*both, first) for both in zip(records[1:], traces[1:], strict=True)]
    return [(problem, problem.fit_from((), problem.start(0.0))) for problem in (first, *others)]


def noise_whitened(s: Sensitivities, noise: RigNoise) -> tuple[Array, Array, Array]:
    """Rows that are independent between the runs: columns (n, k), base (n, b) and principal components (n, m) of the
    scatter and of the base model's parameters with priors, whitened by the noise.

    The covariance of any of the runs is then that of their rows, with the random effects shared by all of them.
    The whitening is the diagnosis', scaled from the noise that it estimated in one random record to that of the rig.
    """
    problem = s.problem
    weights = problem.weights.with_size(0.0)
    signs = np.random.default_rng(0).choice([-1.0, 1.0], (len(problem.torque), N_PROBES))
    precision = (weights.whiten(signs) ** 2).mean(axis=1)
    variance = sum(noise.variances(s.fit.prediction.slope)) / problem.blocks.count
    scale = (1 / np.sqrt(variance * precision))[:, None]
    effects, random = (
        weights.whiten(s.columns) * scale,
        weights.whiten(np.hstack([weights.components.T, s.held])) * scale,
    )
    # As in the diagnosis, principal components well below the noise are left out.
    values, vectors = np.linalg.eigh(random.T @ random)
    return effects, weights.whiten(s.base) * scale, random @ vectors[:, values > MIN_EIGENVALUE]
