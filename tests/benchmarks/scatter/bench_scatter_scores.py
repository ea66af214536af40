"""How much like each effect individual drives without effects look, beyond what the covariance of the diagnosis says.

Run as `python tests/benchmarks/scatter/bench_scatter_scores.py --drives 48`. Individuals of three drives, whose
torque is not linearised, are simulated along one record with noise; each gain in -2 log likelihood of an effect that is
linearised about the base curve is a score statistic (Rao's test). Under an exact covariance its mean is the number of
the effect's amplitudes, or half of it where an amplitude has one sign, a few more where variants are tried.

`--starts 4 8 12 24` compares covariances that are averaged over so many positions of the first element: the greatest
mean square, over the positions of a missing ball, of its score on individuals, 1 under an exact covariance, and the
mean -2 log likelihood of the individuals.
"""

from __future__ import annotations

import argparse
import sys
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.estimation.problem import Problem, make_weights  # noqa: E402
from reefmu.diagnosis.estimation.score_test import absorbing_basis, linearise, score_gains  # noqa: E402
from reefmu.diagnosis.estimation.search import base_fit  # noqa: E402
from reefmu.diagnosis.inference.simulated_records import simulate_noise  # noqa: E402
from reefmu.diagnosis.preparation import BaseCurveSource, prepare_problem  # noqa: E402
from reefmu.diagnosis.preprocessing.trace import make_trace  # noqa: E402
from reefmu.diagnosis.random_effects.individuals import simulate_individuals  # noqa: E402
from reefmu.diagnosis.random_effects.responses import PLACES  # noqa: E402
from reefmu.diagnosis.random_effects.scatter import Scatter  # noqa: E402
from reefmu.record import Record, make_record  # noqa: E402
from stiffness_model import DoesNotFitWarning, Drive, load_drive  # noqa: E402
from stiffness_model.numerics.arrays import Array  # noqa: E402
from tests import diagnosis_rig as rig  # noqa: E402

DRIVES = ("drive_1", "drive_2", "drive_3")
NOISE = 0.002
"""Standard deviation of the noise of the torque, over full torque."""


def record_of(drive: Drive) -> Record:
    """The record of the mean drive along the rig's protocol, to this drive's greatest twist, with noise."""
    plain = rig.protocol()
    twist = plain.twist(rig.drive().ratio) * drive.max_twist / rig.drive().max_twist
    base = BaseCurveSource(drive).base_curve(make_trace(plain, drive.ratio))
    torque = base.elastic.evaluate(twist, 0.0, base.shape.start)[0]
    noise = NOISE * base.full_torque * np.random.default_rng(0).standard_normal(len(plain))
    columns = {
        "time": plain.time,
        "run": plain.run.astype(float),
        "crank_angle": plain.crank_angle,
        "output_angle": plain.crank_angle / drive.ratio - twist,
        "temperature": plain.temperature,
        "output_torque": torque + noise,
    }
    return make_record(columns)


def problem_of(drive: Drive) -> Problem:
    """The problem of that record."""
    record = record_of(drive)
    trace = make_trace(record, drive.ratio)
    return prepare_problem(record, trace, BaseCurveSource(drive).base_curve(trace))


def score_statistics(problem: Problem, count: int, places: float) -> dict[str, Array]:
    """Gains (count,) of every candidate on individuals with so wide deviations of places, over that of sizes."""
    assert isinstance(problem.scatter, Scatter)
    base = base_fit(problem)
    drives = simulate_individuals(problem.scatter, count, seed=1, places=(places, places))
    drives = drives + simulate_noise(problem, count, np.random.default_rng(1)).T
    free = base.prediction.sensitivities
    directions = {name: linearise(problem, name, base) for name in problem.candidates}
    found: dict[str, list[float]] = {name: [] for name in directions}
    for torque in drives:
        beside = torque - free @ np.linalg.lstsq(base.weighting.whiten(free), base.weighting.whiten(torque))[0]
        weights = base.weighting.with_likeliest_scatter(beside)
        basis = absorbing_basis(weights, free, base.bounds.prior_deviation)
        residual = weights.whiten(torque)
        residual = residual - basis @ (basis.T @ residual)
        for name, variants in directions.items():
            found[name].append(max(gain for gain, _ in score_gains(variants, weights, basis, residual)))
    return {name: np.array(gains) for name, gains in found.items()}


def with_starts(problem: Problem, starts: int) -> Problem:
    """The problem with a covariance that is averaged over so many positions of the first element."""
    assert isinstance(problem.scatter, Scatter)
    scatter = replace(problem.scatter, starts=starts)
    weights = make_weights(problem.variance, scatter, problem.base.full_torque)
    return replace(problem, scatter=scatter, weights=weights)


def position_scores(problem: Problem, count: int) -> tuple[float, float]:
    """The greatest mean square, over the positions of a missing ball, of its score on individuals whose places deviate
    as widely as their sizes, and the mean -2 log likelihood of the individuals."""
    assert isinstance(problem.scatter, Scatter)
    base, weights = base_fit(problem), problem.weights.with_size(1.0)
    drives = simulate_individuals(problem.scatter, count, seed=1, places=(PLACES, PLACES))
    white = weights.whiten(drives.T + simulate_noise(problem, count, np.random.default_rng(1)))
    basis = absorbing_basis(weights, base.prediction.sensitivities, base.bounds.prior_deviation)
    white -= basis @ (basis.T @ white)
    squares: list[float] = []
    for variant in linearise(problem, "missing_ball", base):
        column = weights.whiten(variant.columns[:, 0])
        column -= basis @ (basis.T @ column)
        squares.append(float(np.mean((column @ white) ** 2) / (column @ column)))
    return max(squares), float((white**2).sum(axis=0).mean()) + weights.log_determinant


def main() -> None:
    """Print the mean gains, or what numbers of starts make of a missing ball."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--drives", type=int, default=48, help="individuals of each drive")
    parser.add_argument("--starts", type=int, nargs="*", default=[], help="positions of the first element")
    arguments = parser.parse_args()
    warnings.simplefilter("ignore", DoesNotFitWarning)
    for name in DRIVES:
        for starts in arguments.starts:
            square, cost = position_scores(with_starts(problem_of(load_drive(name)), starts), arguments.drives)
            print(f"{name}, {starts} starts: missing ball {square:.2f}, -2 log likelihood {cost:.0f}", flush=True)
        if arguments.starts:
            continue
        problem = problem_of(load_drive(name))
        for places in (0.0, 1.0):
            gains = score_statistics(problem, arguments.drives, places)
            order = sorted(gains, key=lambda effect: -float(gains[effect].mean()))
            print(f"{name}, places {places}:", ", ".join(f"{e} {gains[e].mean():.1f}" for e in order), flush=True)


if __name__ == "__main__":
    main()
