"""What the noise of the twist's rate explains of drives with damping, by records of the second generator.

Run as `python tests/benchmarks/scatter/bench_damped_noise.py --second 90 --seed 22 --workers 2`. The records are those
in which damping is missing, alone or beside other known effects; each is fitted with its true set of effects, with and
without what damping makes of the noise of the rate. A line for each has the change of -2 log likelihood, the squares
that are left in fast runs over those expected, without and with it, and the estimated damping over the true one.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.preparation import BaseCurveSource, guess_stiffness, prepare_problem  # noqa: E402
from reefmu.diagnosis.preprocessing.noise import block_variances  # noqa: E402
from reefmu.diagnosis.preprocessing.trace import make_trace  # noqa: E402
from tests.benchmarks.probabilities.observed_records import second_record  # noqa: E402
from tests.benchmarks.probabilities.rival_sets import true_fit  # noqa: E402
from tests.benchmarks.scatter.catalogue_records import measured  # noqa: E402
from tests.benchmarks.scatter.true_sets import left_in_fast_runs  # noqa: E402


@dataclass(frozen=True)
class Explained:
    """One record: cost: change of -2 log likelihood by the noise of the rate; left: squares of fast runs over those
    expected, without and with it; damping: estimate over truth, without and with it."""

    number: int
    cost: float
    left: tuple[float, float]
    damping: tuple[float, float]


def explained(number: int, seed: int) -> Explained | None:
    """What the noise of the rate explains of one record; None of others than those with known effects that damping is
    among, and of records without cycles that repeat, whose noise is not that of the sensors alone."""
    record, drive, truth = second_record(number, seed)
    if truth["foreign"] or "damping" not in truth["names"]:
        return None
    source = BaseCurveSource(drive)
    trace = make_trace(record, source.ratio(record))
    problem = prepare_problem(record, trace, source.base_curve(trace))
    if set(truth["names"]) - set(problem.candidates) or problem.cycle_scatter is not None:
        return None
    blocks, names = problem.blocks, tuple(truth["names"])
    slope = blocks.mean(guess_stiffness(trace, problem.base))
    variance, _ = block_variances(problem.noise, slope, blocks.count)
    after = true_fit(problem, names, truth["parameters"])
    weights = after.weighting.with_variance(variance)
    plain = replace(problem, variance=variance, weights=weights)
    before = plain.fit_from(names, after.parameters, weights)
    cost = after.cost - before.cost + float(np.log(problem.variance / variance).sum())
    at = problem.layout(names).effects["damping"].start
    true = truth["parameters"]["damping"]["coefficient"]
    left = left_in_fast_runs(plain, before), left_in_fast_runs(problem, after)
    return Explained(number, cost, left, (before.parameters[at] / true, after.parameters[at] / true))


def main() -> None:
    """Print a line for each record, and the mean."""
    found: list[Explained] = []
    for record in measured(explained, __doc__, 22):
        found.append(record)
        left, ratios = (", ".join(f"{x:.3g}" for x in pair) for pair in (record.left, record.damping))
        print(f"{record.number}: cost {record.cost:.0f}, fast {left}, damping {ratios}", flush=True)
    print(f"{len(found)} records: cost {np.mean([r.cost for r in found]):.0f} in the mean")


if __name__ == "__main__":
    main()
