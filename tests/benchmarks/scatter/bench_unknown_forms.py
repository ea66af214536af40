"""What noise and scatter leave of individuals: blocks, principal components by their size, and wider small components.

Run as `python tests/benchmarks/scatter/bench_unknown_forms.py --second 90 --seed 3 --workers 2`. The records are
those of individuals of the second generator; each residual is that of the likeliest set of effects. Squares are given
over what noise and scatter should leave, with the scatter as the drawing has it: below 1 where effects take some of it,
above 1 where the covariance is too small. The costs are -2 log likelihoods less that of the scatter as it is drawn, by
the share of full torque that widens the components (`weighting.UNKNOWN_FORMS`), for a scatter of size 1.
"""

from __future__ import annotations

import itertools
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.estimation.problem import Problem  # noqa: E402
from reefmu.diagnosis.estimation.weighting import Weighting  # noqa: E402
from stiffness_model.numerics.arrays import Array  # noqa: E402
from tests.benchmarks.probabilities.observed_records import analysed_second  # noqa: E402
from tests.benchmarks.records.catalogue_records import measured  # noqa: E402

SHARES = (0.0, 0.0003, 0.0006, 0.001, 0.002, 0.003, 0.005)
"""Of full torque, that are tried."""
EDGES = (0.3, 1.0, 3.0, 10.0, 30.0, 100.0, 1000.0, np.inf)
"""Edges of the bins of the components' variances, in units of the noise."""
MAX_MISFIT = 2.0
"""Squares, over those expected, above which a record holds what no set of effects explains; it tells nothing of the
scatter."""
WHITE = 0.55
"""Variance of a block alone over that of the weights, from which the noise counts as nearly white."""


@dataclass(frozen=True)
class Left:
    """One record. misfit: squares over those expected; alone: mean variance of a block alone over that of the weights;
    by_size: mean squares of the components in each bin over those expected, nan without any; costs: by share."""

    misfit: float
    alone: float
    by_size: Array
    costs: Array


def as_drawn(weights: Weighting, full_torque: float) -> Weighting:
    """The scatter of a weighting without unknown forms, at size 1."""
    return weights.without_unknown_forms(full_torque).with_size(1.0)


def left(problem: Problem, weights: Weighting, residual: Array) -> Left:
    """What a residual (n,), N.m, of an individual leaves under the weights of its fit."""
    full_torque, drawn = problem.base.full_torque, as_drawn(weights, problem.base.full_torque)
    squares = (drawn.basis.T @ (residual * drawn.scale)) ** 2
    expected = drawn.eigenvalues + problem.noise_of_blocks @ drawn.basis**2
    bins = [(drawn.eigenvalues > low) & (drawn.eigenvalues <= high) for low, high in itertools.pairwise(EDGES)]
    by_size = [float((squares / expected)[some].mean()) if some.any() else np.nan for some in bins]
    step = full_torque * float(np.sqrt(np.mean(drawn.scale**2))) * np.sqrt(drawn.eigenvalues)
    costs = [replace(drawn, eigenvalues=drawn.eigenvalues + share * step).cost(residual) for share in SHARES]
    misfit = float((weights.whiten(residual) ** 2).sum() / problem.expected_chi_square(weights))
    return Left(misfit, float(problem.noise_of_blocks.mean()), np.array(by_size), np.array(costs) - costs[0])


def left_of_second(number: int, seed: int) -> Left | None:
    """What is left of a record of the second generator; None of a mean drive, without a diagnosis, or with something
    that no set of effects explains."""
    found, _ = analysed_second(number, seed, bounds=False)
    if found is None:
        return None
    problem, fit = found.evidence.problem, min(found.evidence.search.all_fits, key=lambda f: f.cost)
    if not fit.weighting.is_individual:
        return None
    record = left(problem, fit.weighting, problem.torque - fit.prediction.torque)
    return record if record.misfit < MAX_MISFIT else None


def table(title: str, records: Sequence[Left]) -> str:
    """Means over records."""
    costs = np.array([r.costs for r in records])
    by_size = np.nanmean([r.by_size for r in records], axis=0)
    return "\n".join(
        [
            f"{title}: {len(records)} records, squares over those expected {np.mean([r.misfit for r in records]):.2f}",
            f"  components from {', '.join(f'{e:g}' for e in EDGES[:-1])} times the noise: {by_size.round(2).tolist()}",
            f"  cost by share {SHARES}: mean {costs.mean(axis=0).round().tolist()}, "
            f"median {np.median(costs, axis=0).round().tolist()}",
        ]
    )


def main() -> None:
    """Print what is left, of all records and of those with nearly white noise."""
    records = [*measured(left_of_second, __doc__, 3)]
    print(table("all", records))
    print(table("nearly white noise", [r for r in records if r.alone > WHITE]))


if __name__ == "__main__":
    main()
