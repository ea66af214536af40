"""What the number of blocks costs: the gain of the effects that are missing over nothing, by records and blocks.

Run as `python tests/benchmarks/diagnosis/bench_blocks.py 15/65 16/40 14/34 --blocks 800 1200 1600 2400 3600`, with
seeds and numbers of records of the second generator. Fits start at the true parameters where generator and diagnosis
share them; the first element stands where the record shows it beside no effect. Seconds are processor time of the
problem and all fits.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.estimation.search import base_fit, linearise_candidates  # noqa: E402
from reefmu.diagnosis.estimation.worker_pool import WorkerPool  # noqa: E402
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem, with_first_element  # noqa: E402
from reefmu.diagnosis.preprocessing.trace import make_trace  # noqa: E402
from reefmu.record import Record  # noqa: E402
from stiffness_model import Drive  # noqa: E402
from tests.benchmarks.probabilities.observed_records import second_record  # noqa: E402
from tests.benchmarks.probabilities.rival_sets import true_fit  # noqa: E402


def gain(record: Record, drive: Drive, truth: dict[str, dict[str, float]], blocks: int) -> tuple[float, float]:
    """The gain in -2 log likelihood of the true effects, with their parameters by name, and processor seconds."""
    started = time.process_time()
    trace = make_trace(record, drive.ratio)
    problem = prepare_problem(record, trace, BaseCurveSource(drive).base_curve(trace), blocks=blocks)
    base = base_fit(problem)
    problem = with_first_element(problem, base, linearise_candidates(WorkerPool(problem), base))
    base = base_fit(problem)
    found = true_fit(problem, tuple(truth), truth)
    same = problem.fit_from(found.names, found.parameters, problem.weights)
    best = min((found, same), key=lambda fit: fit.cost)
    return base.cost - best.cost, time.process_time() - started


def main() -> None:
    """Print the gain and the time of every number of blocks."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("cases", nargs="*", default=["15/65", "16/40", "14/34"], help="seed/number")
    parser.add_argument("--blocks", type=int, nargs="*", default=[800, 1200, 1600, 2400, 3600])
    arguments = parser.parse_args()
    for name in arguments.cases:
        seed, number = map(int, name.split("/"))
        record, drive, truth = second_record(number, seed)
        parts = [(blocks, *gain(record, drive, truth["parameters"], blocks)) for blocks in arguments.blocks]
        print(
            name,
            ", ".join(truth["names"]),
            "; ".join(f"{n} blocks: {g:.1f} in {s:.1f} s" for n, g, s in parts),
            flush=True,
        )


if __name__ == "__main__":
    np.seterr(over="ignore", invalid="ignore")
    main()
