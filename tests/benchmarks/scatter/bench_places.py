"""How widely the places of bores and lobes deviate, along their circle and outwards, by records of individuals.

Run as `python tests/benchmarks/scatter/bench_places.py --second 40 --seed 21 --workers 2`. The records are those of
individuals of the second generator from which nothing or known effects are missing; each is fitted with its true set of
effects under several `PLACES` and `OUTWARDS` (`random_effects.responses`). The table has the mean of -2 log likelihood
less that of what is in use, and the mean square of each amplitude of a kinematic error that is not missing over its
standard error, 1 under an exact covariance.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.estimation.least_squares import Fit  # noqa: E402
from reefmu.diagnosis.estimation.problem import Problem  # noqa: E402
from reefmu.diagnosis.estimation.score_test import absorbing_basis, linearise, score_gains  # noqa: E402
from reefmu.diagnosis.random_effects.responses import OUTWARDS, PLACES, place_deviations, solved_responses  # noqa: E402
from stiffness_model.numerics.arrays import Array  # noqa: E402
from tests.benchmarks.records.catalogue_records import measured  # noqa: E402
from tests.benchmarks.records.true_sets import true_set  # noqa: E402

CHOICES = (
    (PLACES, OUTWARDS),
    *((1.0, outwards) for outwards in (0.0, 0.5, 1.0)),
    *((1.2, outwards) for outwards in (0.0, 1.0)),
    *((1.5, outwards) for outwards in (0.0, 0.4)),
)
"""Pairs of `PLACES` and `OUTWARDS` that are tried, those in use first."""
KINEMATIC = "kinematic_error"


@dataclass(frozen=True)
class Likelihood:
    """One record: costs (c,) by choice, and squares (c,) of a kinematic error over those expected, NaN where one is
    missing or no candidate."""

    number: int
    costs: Array
    squares: Array


def likelihood(number: int, seed: int) -> Likelihood | None:
    """That of one record; None of others than individuals with known effects."""
    found = true_set(number, seed)
    if found is None:
        return None
    drive, fits = found.scatter.drive, list[Fit]()
    for choice in CHOICES:
        solved = solved_responses(drive, place_deviations(drive, *choice))
        fits.append(found.fitted(replace(found.scatter, responses=solved)))
    has_squares = KINEMATIC in found.problem.candidates and KINEMATIC not in found.fit.names
    squares = [_squares(found.problem, fit) if has_squares else np.nan for fit in fits]
    return Likelihood(number, np.array([fit.cost for fit in fits]), np.array(squares))


def _squares(problem: Problem, fit: Fit) -> float:
    """Mean square of the amplitudes of a kinematic error over their standard errors."""
    weights = fit.weighting
    basis = absorbing_basis(weights, fit.prediction.sensitivities, fit.bounds.prior_deviation)
    residual = weights.whiten(problem.torque - fit.prediction.torque)
    [direction] = linearise(problem, KINEMATIC, fit)
    [(gain, _)] = score_gains([direction], weights, basis, residual - basis @ (basis.T @ residual))
    return gain / direction.columns.shape[1]


def main() -> None:
    """Print the table."""
    found: list[Likelihood] = []
    for record in measured(likelihood, __doc__, 21):
        found.append(record)
        print(record.number, (record.costs - record.costs[0]).round(1), record.squares.round(2), flush=True)
    costs = np.mean([r.costs - r.costs[0] for r in found], axis=0)
    squares = np.nanmean([r.squares for r in found], axis=0)
    print(f"{len(found)} records; places, outwards, cost, squares of a kinematic error")
    for (places, outwards), cost, square in zip(CHOICES, costs, squares, strict=True):
        print(f"{places:5g} {outwards:5g} {cost:8.1f} {square:6.2f}")


if __name__ == "__main__":
    main()
