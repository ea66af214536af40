"""How far the information in a record allows its missing effects to be named, and how often the diagnosis names them.

Run as `python tests/benchmarks/probabilities/bench_naming_power.py --count 120 --workers 2`, or with
`--second 90 --seed 3` for records of the second generator. The records are those that lack known effects alone, of the
second generator those whose effects its Cramer-Rao bounds call separable. The separation d of a record is the distance,
in standard deviations of noise and scatter, of the torque that its true effects make from what another set makes,
fitted to it: the true set without one effect, or with another effect in its place. To a judge who knows laws and
covariance and has excluded all sets but these two, the log likelihood ratio of both is Gaussian with mean d^2/2 and
variance d^2 (Neyman and Pearson), and their log odds are higher by a, what the priors of the diagnosis say of their
parameters, their number of effects and, where the drive scatters as one of another clearance, of that clearance. So no
rule that names at a probability p names the truth more often than Phi((d^2/2 + a - logit p) / d); of all other sets
that for which this is least counts. The set without an effect is also judged by the scatter at its own contacts, by
which mean and variance are others (`likelihood_ratio`): d is then the standard deviation, and a what the mean exceeds
d^2/2 by as well.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, astuple, dataclass
from pathlib import Path

import numpy as np

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.analysis import Analysis  # noqa: E402
from reefmu.diagnosis.calibrated_odds import NAMED  # noqa: E402
from tests.benchmarks.probabilities.cases import drawn_cases  # noqa: E402
from tests.benchmarks.probabilities.observed_records import analysed, analysed_second  # noqa: E402
from tests.benchmarks.probabilities.rival_sets import bound, nearest, true_fit  # noqa: E402
from tests.validation.blind.outside import KINDS  # noqa: E402
from tests.validation.blind.records import Case, Truth  # noqa: E402
from tests.validation.blind_individuals.judging import judge  # noqa: E402

EDGES = (0.0, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, np.inf)
"""Edges of the bins of the separation."""
SURE = 0.95
"""Probability of a name for which the bound is given as well."""
CLEAR = 3.0
"""Effects over the scatter of individuals from which a single one counts as clear, as the examiner does."""


@dataclass(frozen=True)
class Outcome:
    """One record. kind: of its truth; effects: that are missing; separation: d; advantage: a; lost: the effect that is
    then least sure; rival: what takes its place, empty where nothing does; exact: whether the missing effects are named
    and no other; within: whether they are the named ones or among the alternatives."""

    case: str
    kind: str
    individual: bool
    effects: tuple[str, ...]
    separation: float
    advantage: float
    lost: str
    rival: str
    verdict: str
    exact: bool
    within: bool


def outcome(what: Case) -> Outcome | None:
    """The outcome of one case; None where there is no diagnosis or something else than known effects is missing."""
    if not what.effects or any(name in KINDS for name, _ in what.effects):
        return None
    found, truth = analysed(what)
    return None if found is None else judged(found, truth)


def outcome_of_second(place: tuple[int, int]) -> Outcome | None:
    """The same of a record of the second generator, by seed and number, where its names can be told apart at all."""
    seed, number = place
    found, truth = analysed_second(number, seed, bounds=True)
    missing = frozenset(truth["names"])
    if found is None or truth["foreign"] or not truth["separable"] or not missing:
        return None
    if missing & frozenset(found.evidence.problem.excluded):
        return None
    problem = found.evidence.problem
    rival = nearest(problem, true_fit(problem, tuple(truth["names"]), truth["parameters"]))
    answer = {"truth": truth, "answer": found.diagnosis.to_dict(), "seconds": 0.0, "processor": 0.0}
    seen = judge(answer)
    clear = ", clear" if len(missing) == 1 and min(truth["over_scatter"].values()) >= CLEAR else ""
    return Outcome(
        f"{seed}/{number} {truth['category']}",
        truth["category"] + clear,
        truth["individual"],
        tuple(truth["names"]),
        *astuple(rival),
        found.diagnosis.verdict,
        seen.exact,
        seen.within,
    )


def judged(found: Analysis, truth: Truth) -> Outcome | None:
    """The outcome of a diagnosis; None where an effect that is missing is no candidate with the columns of the
    record."""
    problem, missing, conclusion = found.evidence.problem, frozenset(truth.effects), found.conclusion
    if missing & frozenset(problem.excluded):
        return None
    rival = nearest(problem, true_fit(problem, truth.effects, truth.parameters))
    named = frozenset(conclusion.chosen.names)
    sets = {named, *map(frozenset, conclusion.alternatives)}
    exact = conclusion.verdict == "named" and named == missing
    return Outcome(
        f"{truth.case.number} {truth.case.category}",
        truth.case.category,
        truth.case.individual,
        truth.effects,
        *astuple(rival),
        conclusion.verdict,
        exact,
        missing in sets and conclusion.verdict != "none",
    )


def report(outcomes: Sequence[Outcome]) -> None:
    """Print how many records of each separation and of each kind are named exactly, and the most that the information
    allows."""
    groups = [(f"{low:g} to {high:g}", low, high) for low, high in itertools.pairwise(EDGES)]
    print(f"{'separation':28} records  at most  at {SURE:g}  exact  within")
    for title, low, high in groups:
        _print_share(title, [o for o in outcomes if low <= o.separation < high])
    for kind in sorted({o.kind for o in outcomes}):
        _print_share(kind, [o for o in outcomes if o.kind == kind])
    _print_share("all", outcomes)
    rivals: dict[str, int] = {}
    for o in outcomes:
        if bound(o.separation, o.advantage) < NAMED:
            key = f"{o.lost} / {o.rival or 'nothing'}"
            rivals[key] = rivals.get(key, 0) + 1
    print("pairs that the record does not tell apart:")
    for key, count in sorted(rivals.items(), key=lambda item: -item[1]):
        print(f"  {count:3}  {key}")


def _print_share(title: str, some: Sequence[Outcome]) -> None:
    if some:
        most, sure = (np.mean([bound(o.separation, o.advantage, least) for o in some]) for least in (NAMED, SURE))
        exact, within = np.mean([o.exact for o in some]), np.mean([o.within for o in some])
        print(f"{title:28} {len(some):7} {most:8.2f} {sure:8.2f} {exact:6.2f} {within:7.2f}")


def main() -> None:
    """Diagnose the records and print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--count", type=int, default=120, help="cases, drawn from those of the calibration")
    parser.add_argument("--second", type=int, default=0, help="records of the second generator in their place")
    parser.add_argument("--seed", type=int, default=3, help="of the catalogue of the second generator")
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--out", type=Path, help="file for the outcomes, one JSON object a line")
    parser.add_argument("--outcomes", type=Path, nargs="+", help="such files, in place of new records")
    given = parser.parse_args()
    if given.outcomes is not None:
        lines = [line for file in given.outcomes for line in file.read_text("utf-8").splitlines()]
        report([Outcome(**json.loads(line)) for line in lines])
        return
    outcomes: list[Outcome] = []
    with ProcessPoolExecutor(given.workers) as pool:
        places = [(given.seed, number) for number in range(given.second)]
        for found in pool.map(outcome_of_second, places) if places else pool.map(outcome, drawn_cases(given.count)):
            if found is not None:
                apart = f"d {found.separation:.1f} a {found.advantage:.1f}"
                print(f"{found.case} {found.effects} {apart} {found.rival} {found.verdict}", flush=True)
                outcomes.append(found)
    if given.out is not None:
        given.out.write_text("".join(json.dumps(asdict(o)) + "\n" for o in outcomes), "utf-8")
    report(outcomes)


if __name__ == "__main__":
    main()
