"""What the filter that all channels have passed explains of individuals, by records of the second generator.

Run as `python tests/benchmarks/scatter/bench_channel_filter.py --second 90 --seed 19 --workers 2`. The records are
those of individuals in which elements pass at several speeds and nothing or known effects are missing; each is fitted
with its true set of effects under the scatter with the likeliest time constant, and under that without a filter. A line
for each has the time constant, the change of -2 log likelihood, and the squares that are left in fast runs over those
expected, without and with the filter.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.random_effects.element_motion import element_motion  # noqa: E402
from reefmu.diagnosis.random_effects.scatter import Scatter  # noqa: E402
from tests.benchmarks.records.catalogue_records import measured  # noqa: E402
from tests.benchmarks.records.true_sets import TrueSet, left_in_fast_runs, true_set  # noqa: E402


@dataclass(frozen=True)
class Explained:
    """One record: time_constant: s; cost: change of -2 log likelihood with the filter; left: squares of fast runs over
    those expected, without and with it."""

    number: int
    time_constant: float
    cost: float
    left: tuple[float, float]


def explained(number: int, seed: int) -> Explained | None:
    """What the filter explains of one record; None of others than individuals with known effects, and where no filter
    shows."""
    found = true_set(number, seed)
    if found is None:
        return None
    problem, scatter = found.problem, found.scatter
    if scatter.time_constant == 0:
        return None
    unfiltered = replace(scatter, motion=element_motion(scatter.drive, problem.trace, problem.blocks))
    (before, left_before), (after, left_after) = (_fitted(found, s) for s in (unfiltered, scatter))
    return Explained(number, scatter.time_constant, after - before, (left_before, left_after))


def _fitted(found: TrueSet, scatter: Scatter) -> tuple[float, float]:
    """The cost of a set of effects under a scatter, and the squares of fast runs over those expected."""
    fit = found.fitted(scatter)
    return fit.cost, left_in_fast_runs(found.problem, fit)


def main() -> None:
    """Print a line for each record, and the means."""
    found: list[Explained] = []
    for record in measured(explained, __doc__, 19):
        found.append(record)
        left = ", ".join(f"{x:.2f}" for x in record.left)
        print(f"{record.number}: {1e3 * record.time_constant:.2f} ms, cost {record.cost:.0f}, fast {left}")
    costs, left = np.array([r.cost for r in found]), np.mean([r.left for r in found], axis=0)
    print(f"{len(found)} records: cost {costs.mean():.0f} in the mean, worst {costs.max():.0f}, fast {left.round(2)}")


if __name__ == "__main__":
    main()
