"""Fits the weights of `reefmu.diagnosis.calibrated_odds` to simulated records, and shows how well they hold.

Run as `python tests/benchmarks/probabilities/calibrate_probabilities.py --workers 2 --out rows.json`; with `--second
90` also for as many records of each of four catalogues of the second generator, whose individuals deviate in other
ways; with `--rows rows.json` only the weights are fitted, and with `--without-drawing` the records are diagnosed by a
power law. Scores are cross-validated: every record is judged by weights that were fitted to the others.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from collections.abc import Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import astuple, fields
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.calibrated_odds import CALIBRATED, DEGREES_OF_FREEDOM, HypothesisWeights  # noqa: E402
from stiffness_model.numerics.arrays import Array  # noqa: E402
from tests.benchmarks.probabilities.cases import drawn_cases  # noqa: E402
from tests.benchmarks.probabilities.observed_records import (  # noqa: E402
    DEGREES,
    SECOND_SEEDS,
    observe,
    observe_second,
    observe_without_drawing,
)

RIDGE = 0.3
"""Half the precision of the weights' prior about zero, which holds weights that few records determine."""
OUTLIERS = 0.002
"""Share of records that no weights explain, so that one impossible record does not decide them."""
FOLDS = 8
"""Parts of the cross-validation."""
EDGES = (0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.85, 0.95, 0.99, 1.0001)
"""Edges of the bins of the reliability curve."""


def fit_weights(records: Sequence[dict[str, Any]]) -> Array:
    """(w,) weights that maximise the penalised likelihood of the truths."""
    tables = [(np.array(r["features"]), np.array(r["true"], bool)) for r in records]
    count = tables[0][0].shape[1]

    def cost(weights: Array) -> tuple[float, Array]:
        total, slope = RIDGE * float(weights @ weights), 2 * RIDGE * weights
        for x, true in tables:
            p = shares(x, weights)
            right = float(p[true].sum())
            mixed = (1 - OUTLIERS) * right + OUTLIERS
            total -= float(np.log(mixed))
            slope = slope - (1 - OUTLIERS) / mixed * (p[true] @ x[true] - right * (p @ x))
        return total, slope

    return np.asarray(minimize(cost, np.full(count, 0.1), jac=True, method="L-BFGS-B").x)


def shares(x: Array, weights: Array) -> Array:
    """Probabilities of the rows of a table of features (r, w)."""
    z = x @ weights
    p = np.exp(z - z.max())
    return p / p.sum()


def cross_validated(records: Sequence[dict[str, Any]]) -> list[Array]:
    """The probabilities of every record by weights fitted to the other parts."""
    order = np.random.default_rng(0).permutation(len(records))
    found: list[Array] = [np.zeros(0)] * len(records)
    for part in np.array_split(order, FOLDS):
        inside = set(part.tolist())
        weights = fit_weights([r for k, r in enumerate(records) if k not in inside])
        for k in part.tolist():
            found[k] = shares(np.array(records[k]["features"]), weights)
    return found


def with_degrees(records: Sequence[dict[str, Any]], degrees: float) -> list[dict[str, Any]]:
    """The records with the features for one number of degrees of freedom."""
    return [{**record, "features": record["features"][f"{degrees:g}"]} for record in records]


def print_parts(records: Sequence[dict[str, Any]]) -> None:
    """Print the log score by degrees of freedom, and without each of the weights."""
    for degrees in DEGREES:
        print(f"{degrees:g} degrees of freedom: log score {_log_score(with_degrees(records, degrees)):.3f}")
    present = with_degrees(records, DEGREES_OF_FREEDOM)
    for column, weight in enumerate(fields(HypothesisWeights)):
        without = [{**r, "features": np.delete(np.array(r["features"]), column, 1)} for r in present]
        print(f"without {weight.name}: log score {_log_score(without):.3f}")


def _log_score(records: Sequence[dict[str, Any]]) -> float:
    """The mean logarithm of the probability of the truth, cross-validated."""
    found = zip(cross_validated(records), records, strict=True)
    return float(np.mean([_log_probability(p, np.array(r["true"], bool)) for p, r in found]))


def _log_probability(p: Array, true: Array) -> float:
    return float(np.log((1 - OUTLIERS) * p[true].sum() + OUTLIERS))


def report(records: Sequence[dict[str, Any]], found: Sequence[Array]) -> None:
    """Print log score, share of likeliest hypotheses that are right, and the reliability curve."""
    likeliest: list[tuple[float, bool]] = []
    scores: list[float] = []
    for record, p in zip(records, found, strict=True):
        true = np.array(record["true"], bool)
        # Something unnamed that shows and that does not are one hypothesis.
        labels = [tuple(names) for names in record["rows"]]
        total = {label: sum(float(p[k]) for k, own in enumerate(labels) if own == label) for label in labels}
        best = max(total, key=lambda label: total[label])
        is_right = any(true[k] for k, own in enumerate(labels) if own == best)
        right = float(p[true].sum())
        scores.append(_log_probability(p, true))
        likeliest.append((right if is_right else total[best], is_right))
    said, right = (np.array(v, float) for v in zip(*likeliest, strict=True))
    print(f"{len(records)} records, log score {np.mean(scores):.3f}, likeliest right {right.mean():.3f}")
    error = 0.0
    for low, high in itertools.pairwise(EDGES):
        inside = (said >= low) & (said < high)
        if inside.any():
            print(f"  said {said[inside].mean():.3f}  right {right[inside].mean():.3f}  of {inside.sum()}")
            error += inside.sum() * abs(said[inside].mean() - right[inside].mean()) / len(said)
    print(f"  expected calibration error {error:.3f}")


def main() -> None:
    """Make the records, fit the weights and print them with their scores."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n", 1)[0])
    parser.add_argument("--workers", type=int, default=2, help="processes")
    parser.add_argument("--out", type=Path, help="file for the features of the records")
    parser.add_argument("--rows", type=Path, help="such a file, in place of new records")
    parser.add_argument("--without-drawing", action="store_true", help="diagnose by a power law")
    parser.add_argument("--count", type=int, help="cases, drawn from all; all if absent")
    parser.add_argument("--second", type=int, default=0, help="cases of each catalogue of the second generator as well")
    given = parser.parse_args()
    if given.rows is not None:
        records = json.loads(given.rows.read_text("utf-8"))
    else:
        records, chosen = [], drawn_cases(given.count)
        look = observe_without_drawing if given.without_drawing else observe
        with ProcessPoolExecutor(given.workers) as pool:
            seconds = pool.map(observe_second, itertools.product(SECOND_SEEDS, range(given.second)))
            for number, found in enumerate(itertools.chain(pool.map(look, chosen), seconds)):
                print(number, found.get("case", "no diagnosis"), found.get("verdict", ""), flush=True)
                records += [found] if found else []
        if given.out is not None:
            given.out.write_text(json.dumps(records), "utf-8")
    print_parts(records)
    records = with_degrees(records, DEGREES_OF_FREEDOM)
    print("weights", [round(float(w), 2) for w in fit_weights(records)])
    present = np.array(astuple(CALIBRATED))
    as_it_is = [shares(np.array(r["features"]), present) for r in records]
    for title, found in (("fitted, cross-validated", cross_validated(records)), ("as it is", as_it_is)):
        for label, kept in (("all", (True, False)), ("individuals", (True,)), ("mean drives", (False,))):
            chosen = [k for k, r in enumerate(records) if r["individual"] in kept]
            print(f"{title}: {label}")
            report([records[k] for k in chosen], [found[k] for k in chosen])


if __name__ == "__main__":
    main()
