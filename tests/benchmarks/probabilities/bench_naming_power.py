"""How far the information in a record allows its missing effects to be named, and how often the diagnosis names them.

Run as `python tests/benchmarks/probabilities/bench_naming_power.py --count 120 --workers 2`. The records are those of
`calibrate_probabilities` that lack known effects alone. The separation d of a record is the distance, in standard
deviations of noise and scatter, of the torque that its true effects make from what the nearest other set makes, fitted
to it: the true set without one effect, or with another effect in its place. To a judge who knows laws, covariance and
all sets but these two excluded, the log likelihood ratio of both is Gaussian with mean d^2/2 and variance d^2 (Neyman
and Pearson), so that no rule that names at a probability p names the truth more often than Phi((d^2/2 - logit p) / d).
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np
from scipy.special import logit
from scipy.stats import norm

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.analysis import Analysis  # noqa: E402
from reefmu.diagnosis.calibrated_odds import NAMED  # noqa: E402
from reefmu.diagnosis.estimation.least_squares import HELD_SIZE, Fit  # noqa: E402
from reefmu.diagnosis.estimation.problem import Problem  # noqa: E402
from reefmu.diagnosis.estimation.search import base_fit, promising_starts, restrict_fit  # noqa: E402
from reefmu.diagnosis.forward.predictor import Predictor  # noqa: E402
from reefmu.effects import find_effect  # noqa: E402
from tests.benchmarks.probabilities.cases import drawn_cases  # noqa: E402
from tests.benchmarks.probabilities.observed_records import analysed  # noqa: E402
from tests.validation.blind.outside import KINDS  # noqa: E402
from tests.validation.blind.records import Case, Truth  # noqa: E402

EDGES = (0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, np.inf)
"""Edges of the bins of the separation."""


@dataclass(frozen=True)
class Outcome:
    """One record. effects: that are missing; separation: d; lost: the effect that is then least sure; rival: what takes
    its place, empty where nothing does; exact: whether the missing effects are named and no other; within: whether they
    are the named ones or among the alternatives."""

    case: str
    individual: bool
    effects: tuple[str, ...]
    separation: float
    lost: str
    rival: str
    verdict: str
    exact: bool
    within: bool


def bound(separation: float) -> float:
    """Greatest probability with which a rule that names from a probability of `NAMED` names the truth."""
    return float(norm.cdf((separation**2 / 2 - logit(NAMED)) / max(separation, 1e-9)))


def outcome(what: Case) -> Outcome | None:
    """The outcome of one case; None where there is no diagnosis or something else than known effects is missing."""
    if not what.effects or any(name in KINDS for name, _ in what.effects):
        return None
    found, truth = analysed(what)
    return None if found is None else judged(found, truth)


def judged(found: Analysis, truth: Truth) -> Outcome | None:
    """The outcome of a diagnosis; None where an effect that is missing is no candidate with the columns of the
    record."""
    problem, missing, conclusion = found.evidence.problem, frozenset(truth.effects), found.conclusion
    if missing & frozenset(problem.excluded):
        return None
    separation, lost, rival = nearest(problem, true_fit(problem, truth))
    named = frozenset(conclusion.chosen.names)
    sets = {named, *map(frozenset, conclusion.alternatives)}
    kind = f"{truth.case.number} {truth.case.category}"
    exact = conclusion.verdict == "named" and named == missing
    return Outcome(
        kind,
        truth.case.individual,
        truth.effects,
        separation,
        lost,
        rival,
        conclusion.verdict,
        exact,
        missing in sets and conclusion.verdict != "none",
    )


def true_fit(problem: Problem, truth: Truth) -> Fit:
    """The fit of the true set, which begins at the true parameters."""
    start = [base_fit(problem).parameters]
    for name in truth.effects:
        true = truth.parameters.get(name, {})
        start.append(np.array([true.get(p.name, p.nominal) for p in find_effect(name).parameters]))
    return problem.fit_from(truth.effects, np.concatenate(start))


def nearest(problem: Problem, true: Fit) -> tuple[float, str, str]:
    """The separation of a fit's set from the nearest other, the effect that this lacks, and the one in its place."""
    torque = Predictor(problem.trace, problem.base, true.names)(true.parameters).torque
    expected = replace(problem, trace=replace(problem.trace, torque=torque), weights=true.weighting, weights_cache=[])
    found: list[tuple[float, str, str]] = []
    for lost in true.names:
        names, parameters = restrict_fit(problem, true, frozenset(true.names) - {lost})
        without = expected.fit_from(names, parameters, true.weighting, HELD_SIZE)
        found.append((without.chi_square, lost, ""))
        others = [name for name in problem.candidates if name not in true.names]
        for start in promising_starts(expected, without, others):
            other = expected.fit_from(start.names, start.parameters, true.weighting, HELD_SIZE)
            found.append((other.chi_square, lost, start.names[-1]))
    least, lost, rival = min(found)
    return float(np.sqrt(least)), lost, rival


def report(outcomes: Sequence[Outcome]) -> None:
    """Print how many records of each separation are named exactly, and the most that the information allows."""
    print("separation  records  at most  exact  within")
    for low, high in itertools.pairwise(EDGES):
        some = [o for o in outcomes if low <= o.separation < high]
        if some:
            most = np.mean([bound(o.separation) for o in some])
            exact, within = np.mean([o.exact for o in some]), np.mean([o.within for o in some])
            print(f"{low:4g}..{high:<5g} {len(some):7} {most:8.2f} {exact:6.2f} {within:7.2f}")
    rivals: dict[str, int] = {}
    for o in outcomes:
        if bound(o.separation) < NAMED:
            key = f"{o.lost} / {o.rival or 'nothing'}"
            rivals[key] = rivals.get(key, 0) + 1
    print("pairs that the record does not tell apart:")
    for key, count in sorted(rivals.items(), key=lambda item: -item[1]):
        print(f"  {count:3}  {key}")


def main() -> None:
    """Diagnose the records and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--count", type=int, default=120, help="cases, drawn from those of the calibration")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--out", type=Path, help="file for the outcomes, one JSON object a line")
    parser.add_argument("--outcomes", type=Path, help="such a file, in place of new records")
    given = parser.parse_args()
    if given.outcomes is not None:
        report([Outcome(**json.loads(line)) for line in given.outcomes.read_text("utf-8").splitlines()])
        return
    outcomes: list[Outcome] = []
    with ProcessPoolExecutor(given.workers) as pool:
        for found in pool.map(outcome, drawn_cases(given.count)):
            if found is not None:
                print(
                    f"{found.case} {found.effects} d {found.separation:.1f} {found.rival} {found.verdict}", flush=True
                )
                outcomes.append(found)
    if given.out is not None:
        given.out.write_text("".join(json.dumps(asdict(o)) + "\n" for o in outcomes), "utf-8")
    report(outcomes)


if __name__ == "__main__":
    main()
