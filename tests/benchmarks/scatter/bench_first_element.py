"""What the position of the first element is worth, by records of individuals.

Run as `python tests/benchmarks/scatter/bench_first_element.py --second 90 --seed 32 --workers 2`. The records are those
of individuals of the second generator from which nothing or known effects are missing. Each is explained by its true
set of effects, with the first element anywhere and at its likeliest position beside that set, exact or with a standard
deviation over the distance of the elements; the table has -2 log likelihood less that of the average over all
positions, and how much larger it is without a missing ball, where one is missing, under either covariance.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.estimation.search import linearise_candidates  # noqa: E402
from reefmu.diagnosis.estimation.worker_pool import WorkerPool  # noqa: E402
from reefmu.diagnosis.preparation import with_first_element  # noqa: E402
from reefmu.diagnosis.random_effects.scatter import START_DEVIATION, Scatter  # noqa: E402
from stiffness_model.numerics.arrays import Array  # noqa: E402
from tests.benchmarks.records.catalogue_records import measured  # noqa: E402
from tests.benchmarks.records.true_sets import TrueSet, true_set  # noqa: E402

DEVIATIONS = (0.0, START_DEVIATION / 2, START_DEVIATION, 1.5 * START_DEVIATION)
"""Standard deviations of the position that are tried, over the distance of the elements."""
BALL = "missing_ball"


@dataclass(frozen=True)
class Worth:
    """One record. names: of the true set; position: of the first element, over the distance of the elements; costs:
    (d,) by `DEVIATIONS`, less that of the average; ball: (2,) by which the cost is larger without a missing ball, under
    the average and at the position, NaN where none is missing."""

    number: int
    names: tuple[str, ...]
    position: float
    costs: Array
    ball: Array


def worth(number: int, seed: int) -> Worth | None:
    """That of one record; None of others than individuals with known effects, and where no position shows."""
    found = true_set(number, seed)
    if found is None or not found.fit.weighting.is_individual:
        return None
    beside = linearise_candidates(WorkerPool(found.problem), found.fit)
    scatter = with_first_element(found.problem, found.fit, beside).scatter
    if not isinstance(scatter, Scatter) or scatter.start is None:
        return None
    anywhere = found.fitted(found.scatter).cost
    costs = [found.fitted(replace(scatter, start_deviation=d)).cost - anywhere for d in DEVIATIONS]
    ball = [_without_ball(found, some) if BALL in found.fit.names else np.nan for some in (found.scatter, scatter)]
    distance = 2 * np.pi / scatter.drive.elements
    return Worth(number, found.fit.names, scatter.start / distance, np.array(costs), np.array(ball))


def _without_ball(found: TrueSet, scatter: Scatter) -> float:
    """By how much -2 log likelihood is larger without the missing ball, under the covariance beside it."""
    fitted, problem = found.fitted(scatter), found.problem
    names = tuple(name for name in fitted.names if name != BALL)
    kept = problem.layout(fitted.names)
    start = [fitted.parameters[: kept.n_base], *(fitted.parameters[kept.effects[name]] for name in names)]
    without = problem.fit_from(names, np.concatenate(start), fitted.weighting)
    return without.cost - fitted.cost


def main() -> None:
    """Print the table."""
    found: list[Worth] = []
    print(f"deviations {DEVIATIONS}")
    for record in measured(worth, __doc__, 32):
        found.append(record)
        ball = "" if np.isnan(record.ball).any() else f" missing ball {record.ball.round(1)}"
        print(f"{record.number:3d} {record.position:6.2f} {record.costs.round(1)} {record.names}{ball}", flush=True)
    costs = np.array([record.costs for record in found])
    print(f"{len(found)} records, mean {costs.mean(axis=0).round(1)}, median {np.median(costs, axis=0).round(1)}")
    print(f"likelier than the average: {(costs < 0).sum(axis=0)}")


if __name__ == "__main__":
    main()
