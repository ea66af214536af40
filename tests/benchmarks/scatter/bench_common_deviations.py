"""How wide the deviations are that all elements of a drive share, and which components of the scatter are kept, by
records of individuals.

Run as `python tests/benchmarks/scatter/bench_common_deviations.py --second 90 --seed 17 --workers 2`. The records are
those of individuals of the second generator from which nothing or known effects are missing; each is fitted with its
true set of effects under several widths of the common deviations (`random_effects.curve_columns`) and several least
variances of a component (`estimation.weighting`). The table has the mean of -2 log likelihood less that of what is in
use, and, for each effect that is not missing, the mean square of its amplitude by generalised least squares over its
standard error: 1 under an exact covariance, less where the covariance is too wide and hides such an effect, more where
it is too narrow and makes one up.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.estimation.least_squares import Fit  # noqa: E402
from reefmu.diagnosis.estimation.problem import Problem  # noqa: E402
from reefmu.diagnosis.estimation.score_test import absorbing_basis, linearise, score_gains  # noqa: E402
from reefmu.diagnosis.estimation.weighting import MIN_EIGENVALUE, Weighting  # noqa: E402
from reefmu.diagnosis.random_effects.curve_columns import COMMON_SHARE, SCALE, curve_columns  # noqa: E402
from stiffness_model.numerics.arrays import Array  # noqa: E402
from tests.benchmarks.records.true_sets import TrueSet, true_set  # noqa: E402

CHOICES = (
    (COMMON_SHARE, SCALE, MIN_EIGENVALUE),
    *((share, SCALE, MIN_EIGENVALUE) for share in (0.0, 0.2, 0.3, 0.5, 1.0)),
    *((COMMON_SHARE, scale, MIN_EIGENVALUE) for scale in (0.0, 0.005, 0.02, 0.03)),
    (0.0, 0.0, MIN_EIGENVALUE),
    (1.0, 0.0, MIN_EIGENVALUE),
    *((COMMON_SHARE, SCALE, least) for least in (0.3, 0.03)),
)
"""Triples of `COMMON_SHARE`, `SCALE` and `MIN_EIGENVALUE` that are tried, those in use first."""
EFFECTS = (
    "modulus_error",
    "structural_compliance",
    "torque_sensor_offset",
    "backlash",
    "thermal_clearance",
    "hysteresis",
    "creep",
)
"""Effects with one amplitude, or whose first variant has one."""
CLEARANCES = {"backlash", "preload"}
"""Effects of which neither can be seen where the other is missing."""


@dataclass(frozen=True)
class Likelihood:
    """One record: costs (c,) by choice, and squares of the effects' amplitudes over their variance (c,) by effect."""

    costs: Array
    squares: dict[str, Array]


def likelihood(number: int, seed: int) -> Likelihood | None:
    """That of one record; None of others than individuals with known effects."""
    found = true_set(number, seed)
    if found is None:
        return None
    problem, fit = found.problem, found.fit
    weightings = [*_weightings(found)]
    costs = [problem.fit_from(fit.names, fit.parameters, weights).cost for weights in weightings]
    absent = [name for name in EFFECTS if name in problem.candidates and not _related(name) & set(fit.names)]
    return Likelihood(np.array(costs), {name: _squares(problem, fit, name, weightings) for name in absent})


def _related(name: str) -> set[str]:
    return CLEARANCES if name in CLEARANCES else {name}


def _weightings(found: TrueSet) -> Iterator[Weighting]:
    """The weights at the contacts of a fit under all choices, each at the likeliest size."""
    at = found.fit.prediction.contacts
    beside = found.problem.predictor(found.fit.names).twist_beside_sensors(found.fit.parameters)
    of_parts, torque = found.scatter.covariance_of_parts(at.twist, at.clearance, beside)
    curves = curve_columns(torque, of_parts)
    for share, scale, least in CHOICES:
        common = np.concatenate([share * curves, scale * torque[None]])
        yield found.weights(of_parts + common.T @ common, least)


def _squares(problem: Problem, fit: Fit, name: str, weightings: Sequence[Weighting]) -> Array:
    """(c,) squares of the amplitude of one more effect, of either sign, over its variance."""
    direction = replace(linearise(problem, name, fit)[0], one_sided=False)
    found: list[float] = []
    for weights in weightings:
        basis = absorbing_basis(weights, fit.prediction.sensitivities, fit.bounds.prior_deviation)
        residual = weights.whiten(problem.torque - fit.prediction.torque)
        [(gain, _)] = score_gains([direction], weights, basis, residual - basis @ (basis.T @ residual))
        found.append(gain)
    return np.array(found)


def table(records: Sequence[Likelihood]) -> str:
    """Means over records, a line for each choice."""
    costs = np.mean([r.costs - r.costs[0] for r in records], axis=0)
    squares = {name: np.mean([r.squares[name] for r in records if name in r.squares], axis=0) for name in EFFECTS}
    lines = [f"{len(records)} records; share, scale, least variance, cost, mean squares of {', '.join(EFFECTS)}"]
    for k, (share, scale, least) in enumerate(CHOICES):
        of_effects = " ".join(f"{squares[name][k]:6.2f}" for name in EFFECTS)
        lines.append(f"{share:5g} {scale:6g} {least:5g} {costs[k]:8.2f} {of_effects}")
    return "\n".join(lines)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--second", type=int, default=90, help="records of the second generator")
    parser.add_argument("--seed", type=int, nargs="+", default=[17], help="of their catalogues")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    given = parser.parse_args()
    with ProcessPoolExecutor(given.workers) as pool:
        found = [
            record
            for seed in given.seed
            for record in pool.map(partial(likelihood, seed=seed), range(given.second))
            if record is not None
        ]
    print(table(found))


if __name__ == "__main__":
    main()
