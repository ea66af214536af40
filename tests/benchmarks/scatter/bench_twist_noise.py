"""What the noise of the twist explains of drives with damping or friction inside, by records of the second generator.

Run as `python tests/benchmarks/scatter/bench_twist_noise.py --second 90 --seed 22 --workers 2`. The records are those
in which damping or a friction along the twist is missing, alone or beside other known effects; each is fitted with its
true set of effects, with and without what damping and friction make of the noise of the twist's rate and path. A line
for each has the change of -2 log likelihood, the share of blocks whose variance it more than doubles, and the squares
that are left in these over those expected, without and with it.
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
from tests.benchmarks.records.catalogue_records import measured  # noqa: E402
from tests.benchmarks.records.true_sets import left_in  # noqa: E402

AFFECTED = frozenset({"damping", "hysteresis", "load_dependent_hysteresis"})
"""Effects that depend on the rate or the path of the twist."""


@dataclass(frozen=True)
class Explained:
    """One record: names: of its effects; cost: change of -2 log likelihood by the noise of the twist; share: of the
    blocks whose variance it more than doubles; left: squares of these over those expected, without and with it."""

    number: int
    names: tuple[str, ...]
    cost: float
    share: float
    left: tuple[float, float]


def explained(number: int, seed: int) -> Explained | None:
    """What the noise of the twist explains of one record; None of others than those with known effects that damping or
    hysteresis is among, and of records without cycles that repeat, whose noise is not that of the sensors alone."""
    record, drive, truth = second_record(number, seed)
    if truth["foreign"] or not AFFECTED & {*truth["names"]}:
        return None
    source = BaseCurveSource(drive)
    trace = make_trace(record, source.ratio(record))
    problem = prepare_problem(record, trace, source.base_curve(trace))
    if set(truth["names"]) - set(problem.candidates) or problem.cycle_scatter is not None:
        return None
    blocks, names = problem.blocks, tuple(truth["names"])
    slope = blocks.mean(guess_stiffness(trace, problem.base))
    variance, block_variance = block_variances(problem.noise, slope, blocks.count)
    after = true_fit(problem, names, truth["parameters"])
    weights = after.weighting.with_variance(variance)
    plain = replace(problem, variance=variance, block_variance=block_variance, weights=weights)
    before = plain.fit_from(names, after.parameters, weights)
    cost = after.cost - before.cost + float(np.log(problem.variance / variance).sum())
    doubled = problem.variance > 2 * variance
    left = left_in(plain, before, doubled), left_in(problem, after, doubled)
    return Explained(number, names, cost, float(doubled.mean()), left)


def main() -> None:
    """Print a line for each record, and the mean."""
    found: list[Explained] = []
    for record in measured(explained, __doc__, 22):
        found.append(record)
        left, names = ", ".join(f"{x:.3g}" for x in record.left), " ".join(record.names)
        print(f"{record.number} {names}: cost {record.cost:.0f}, doubled {record.share:.3f}, left {left}", flush=True)
    print(f"{len(found)} records: cost {np.mean([r.cost for r in found]):.0f} in the mean")


if __name__ == "__main__":
    main()
