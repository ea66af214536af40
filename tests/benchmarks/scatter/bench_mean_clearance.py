"""How well a backlash or a preload is known beside the mean clearance of an individual.

Run as `python tests/benchmarks/scatter/bench_mean_clearance.py --second 90 --seed 29 --workers 2`. The records are
those of individuals of the second generator from which a backlash or a preload is missing, alone or beside other known
effects. Each is explained by its true set of effects with the first element at its likeliest position, twice: what the
mean of all clearances does follows the mean of the columns of single elements, or the base curve. A line has the true
clearance, the deviation of the mean clearance of individuals, and the estimate with its standard error for both; the
last lines have the root mean square of their deviations over these errors and over the deviation of the mean clearance.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.estimation.intervals import NORMAL_QUANTILE, standard_errors  # noqa: E402
from reefmu.diagnosis.estimation.search import linearise_candidates  # noqa: E402
from reefmu.diagnosis.estimation.worker_pool import WorkerPool  # noqa: E402
from reefmu.diagnosis.preparation import with_first_element  # noqa: E402
from reefmu.diagnosis.random_effects.scatter import Scatter  # noqa: E402
from stiffness_model.numerics.arrays import Array  # noqa: E402
from tests.benchmarks.records.catalogue_records import measured  # noqa: E402
from tests.benchmarks.records.true_sets import TrueSet, true_set  # noqa: E402
from tests.validation.blind_individuals.catalogue import case  # noqa: E402

CLEARANCES = frozenset({"backlash", "preload"})


@dataclass(frozen=True)
class Known:
    """One record. names: of the true set; true, deviation: um, the missing clearance and the standard deviation of that
    of individuals; found, error: (2,) um, by the columns and by the base curve."""

    number: int
    names: tuple[str, ...]
    true: float
    deviation: float
    found: Array
    error: Array


def known(number: int, seed: int) -> Known | None:
    """That of one record; None of others than individuals that lack a backlash or a preload."""
    if not CLEARANCES & set(case(number, seed).names):
        return None
    of_record = true_set(number, seed)
    if of_record is None or not of_record.fit.weighting.is_individual:
        return None
    beside = linearise_candidates(WorkerPool(of_record.problem), of_record.fit)
    scatter = with_first_element(of_record.problem, of_record.fit, beside).scatter
    if not isinstance(scatter, Scatter):
        return None
    both = [_estimate(of_record, some) for some in (replace(scatter, by_clearance=None), scatter)]
    (name,) = CLEARANCES & set(of_record.fit.names)
    found, error = 1e6 * np.transpose(both)
    deviation, true = scatter.mean_clearance_deviation, of_record.true[name]["clearance"]
    return Known(number, of_record.fit.names, 1e6 * true, 1e6 * deviation, found, error)


def _estimate(of_record: TrueSet, scatter: Scatter) -> tuple[float, float]:
    """The clearance, m, and its standard error, under a scatter at the contacts of the true set."""
    fit, problem = of_record.fitted(scatter), of_record.problem
    (name,) = CLEARANCES & set(fit.names)
    at = problem.layout(fit.names).effects[name].start
    error = float(standard_errors(problem, fit)[at] * fit.bounds.scale[at])
    return float(fit.parameters[at]), error


def main() -> None:
    """Print a line for each record, and the sums."""
    found: list[Known] = []
    for record in measured(known, __doc__, 29):
        found.append(record)
        both = ", ".join(f"{x:.2f} +- {e:.2f}" for x, e in zip(record.found, record.error, strict=True))
        print(
            f"{record.number:3d} {record.true:6.2f} +- {record.deviation:.2f} um: {both} {'+'.join(record.names)}",
            flush=True,
        )
    beside = np.array([record.found - record.true for record in found])
    errors, deviations = (np.array([getattr(r, name) for r in found]) for name in ("error", "deviation"))
    over_errors, over_deviation = beside / errors, beside / deviations[:, None]
    inside = (np.abs(over_errors) < NORMAL_QUANTILE).sum(axis=0)
    print(f"{len(found)} records, by the columns and by the base curve: within 95 % intervals {inside}")
    for name, values in (("errors", over_errors), ("deviations of the mean clearance", over_deviation)):
        print(f"root mean square in {name}: {np.sqrt(np.mean(values**2, axis=0)).round(2)}")


if __name__ == "__main__":
    main()
