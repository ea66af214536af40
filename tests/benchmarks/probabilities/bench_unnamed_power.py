"""How large something unnamed must be to show, and how often the diagnosis detects it.

Run as `python tests/benchmarks/probabilities/bench_unnamed_power.py --second 90 --seed 25 --workers 2`: the records of
the second generator in which something without a name is visible by its measure. The distance d of a record is that of
the torque which the unnamed effect makes, in standard deviations of noise and scatter, from all that base curve and
known effects of the record make to first order; the generator simulates the drive with and without it. To a judge who
knows its form the evidence is Gaussian with mean d and deviation 1; to one who does not, and for whom it varies with
nothing that the record holds, it is d^2 more in a sum of squares, of which the record's noise and individuals of its
population leave some anyway. Either names it where less than `ALARM` of the records without it show as much.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.stats import norm

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.probabilities.goodness_of_fit import simulated_squares, squares_left  # noqa: E402
from stiffness_model.numerics.arrays import Array  # noqa: E402
from tests.benchmarks.probabilities.observed_records import analysed_second  # noqa: E402
from tests.benchmarks.probabilities.rival_sets import true_fit  # noqa: E402
from tests.validation.blind_individuals.catalogue import case  # noqa: E402
from tests.validation.blind_individuals.judging import judge  # noqa: E402
from tests.validation.blind_individuals.records import make  # noqa: E402

ALARM = 0.01
"""Share of alarms that is allowed, as the examiner asks for."""
EDGES = (0.0, 10.0, 20.0, 40.0, 80.0, np.inf)
"""Edges of the bins of the distance."""


@dataclass(frozen=True)
class Outcome:
    """One record. distance: d; known, unknown: probability that it shows to a judge who knows its form, or does not;
    detected: by the diagnosis."""

    case: str
    individual: bool
    verdict: str
    distance: float
    known: float
    unknown: float
    detected: bool


def unnamed_torque(number: int, seed: int) -> Array:
    """(n,) N.m, by what the torque of a record's drive at its twist differs from that of the drive without what is
    unnamed, to first order."""
    what = case(number, seed)
    with_it, without = make(what).motion, make(replace(what, foreign=None)).motion
    return with_it.torque - without.torque - with_it.slope * (with_it.twist - without.twist)


def outcome(place: tuple[int, int]) -> Outcome | None:
    """The outcome of a record by seed and number; None where nothing unnamed is visible, and where there is no
    diagnosis."""
    seed, number = place
    if not case(number, seed).foreign:
        return None
    found, truth = analysed_second(number, seed, bounds=True)
    if found is None or truth["foreign_seen"] < 1:
        return None
    problem = found.evidence.problem
    fit = true_fit(problem, tuple(truth["names"]), truth["parameters"])
    size = 1.0 if truth["individual"] else fit.weighting.size
    fit = replace(fit, weighting=fit.weighting.with_size(size))
    torque = problem.blocks.mean(unnamed_torque(number, seed))
    squares, chance = float(squares_left(fit, torque[:, None])[0]), simulated_squares(problem, fit)
    shows = chance + squares >= np.quantile(chance, 1 - ALARM)
    answer = {"truth": truth, "answer": found.diagnosis.to_dict(), "seconds": 0.0, "processor": 0.0}
    return Outcome(
        f"{seed}/{number}",
        truth["individual"],
        found.diagnosis.verdict,
        squares**0.5,
        float(norm.sf(norm.isf(ALARM) - squares**0.5)),
        float(np.mean(shows)),
        bool(judge(answer).detected),
    )


def report(outcomes: Sequence[Outcome]) -> None:
    """Print how many records of each distance show, and how many are detected."""
    print(f"{'distance':14} records  form known  form unknown  detected")
    for low, high in [*itertools.pairwise(EDGES), (0.0, np.inf)]:
        some = [o for o in outcomes if low <= o.distance < high]
        if some:
            known, unknown, detected = np.mean([(o.known, o.unknown, o.detected) for o in some], axis=0)
            print(f"{low:4g} to {high:<6g} {len(some):7} {known:11.2f} {unknown:13.2f} {detected:9.2f}")


def main() -> None:
    """Diagnose the records and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--second", type=int, default=90, help="records of the second generator")
    parser.add_argument("--seed", type=int, nargs="+", default=[25], help="of its catalogues")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    given = parser.parse_args()
    outcomes: list[Outcome] = []
    with ProcessPoolExecutor(given.workers) as pool:
        for found in pool.map(outcome, itertools.product(given.seed, range(given.second))):
            if found is not None:
                print(found, flush=True)
                outcomes.append(found)
    report(outcomes)


if __name__ == "__main__":
    main()
