"""Fits the weights of `reefmu.diagnosis.probabilities.calibration` to simulated records, and shows how well they hold.

Run as `python tests/benchmarks/probabilities/calibrate_probabilities.py --workers 2 --out rows.json`; with `--rows
rows.json` only the weights are fitted. The records are those of the blind catalogue (tests/validation/blind): one in
four as drawn there, mostly of mean drives, the others of individuals whose bores and lobes deviate in place, with a
torque that is read late and noise with an autocorrelation of up to 0.97. Half of these records are there once more with
effects of any size, from what no record shows to what any does. Situations that the catalogue draws too rarely to tell
what they need are added: base curves within tolerance, something unnamed, limited protocols, several effects. Scores
are cross-validated: every record is judged by weights that were fitted to the others.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
import tempfile
import warnings
from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.optimize import minimize

sys.path[:0] = [str(Path(__file__).resolve().parents[3])]

from reefmu.diagnosis.analysis import Analysis  # noqa: E402
from reefmu.diagnosis.pipeline import analyse  # noqa: E402
from reefmu.diagnosis.preparation import BaseCurveSource  # noqa: E402
from reefmu.diagnosis.probabilities.assessment import stated_sizes  # noqa: E402
from reefmu.diagnosis.probabilities.calibration import features  # noqa: E402
from reefmu.diagnosis.probabilities.hypothesis_table import LEAST_SIZE, Row, hypothesis_table  # noqa: E402
from reefmu.record import read_record  # noqa: E402
from stiffness_model import DoesNotFitWarning, load_drive  # noqa: E402
from stiffness_model.numerics.arrays import Array  # noqa: E402
from tests.validation.blind.cases import case  # noqa: E402
from tests.validation.blind.records import Case, Truth, make  # noqa: E402

SEED = 905
"""Seed of the catalogue; those of its scores are others."""
COUNT, COUNT_ANY_SIZE = 120, 150
"""Cases of the catalogue, and up to which number half of them have effects of any size."""
PERIOD, AS_DRAWN, CLEAR = 4, 0, 1
"""Of every four cases the first is left as the catalogue draws it; it and the second keep the sizes of the catalogue,
and the other two are there again with effects of any size."""
SIZES = (0.1, 12.0)
"""Range of these sizes, over noise or scatter, whichever is greater; every order of magnitude is as likely."""
RARE = {"base": 20, "outside_and": 20, "outside": 10, "poor": 26}
"""Further cases of situations that are rare; `poor` stands for any limited protocol. One in three is left as drawn."""
FIRST_RARE = 1000
"""Number from which the rare cases are taken."""
SEVERAL, FIRST_SEVERAL, PERIOD_SEVERAL = 40, 3000, 6
"""Further cases with two or three effects, and the number from which they are taken; one in six is left as drawn."""
PLACES, DELAYS, CORRELATIONS = (0.0, 0.5, 1.0), (0.0, 0.001, 0.002), (0.0, 0.5, 0.8, 0.9, 0.95, 0.97)
"""Deviations of places over those of sizes, delays of the torque, s, and autocorrelations of the others."""
RIDGE = 0.3
"""Half the precision of the weights' prior about zero, which holds weights that few records determine."""
OUTLIERS = 0.002
"""Share of records that no weights explain, so that one impossible record does not decide them."""
FOLDS = 8
"""Parts of the cross-validation."""
EDGES = (0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.85, 0.95, 0.99, 1.0001)
"""Edges of the bins of the reliability curve."""
ALIKE = frozenset({"modulus_error", "structural_compliance"})
"""Effects that the catalogue calls alike where its truth is not separable."""


def cases() -> Iterator[Case]:
    """The cases of the calibration."""
    for number in range(COUNT_ANY_SIZE):
        drawn, rng = case(number, SEED), _generator(number)
        if number % PERIOD == AS_DRAWN:
            yield drawn
            continue
        single = individual(drawn, rng)
        if number < COUNT or number % PERIOD == CLEAR:
            yield single
        if number % PERIOD != CLEAR:
            yield of_any_size(single, rng)
    yield from rare_cases()
    yield from itertools.islice(several_cases(), SEVERAL)


def rare_cases() -> Iterator[Case]:
    """The cases of `RARE`, in the order of the catalogue."""
    left = dict(RARE)
    for number in itertools.count(FIRST_RARE):
        drawn = case(number, SEED)
        group = "poor" if drawn.protocol != "full" and not drawn.missing else drawn.category
        if not any(left.values()):
            return
        if left.get(group):
            left[group] -= 1
            yield drawn if left[group] % 3 == 0 else individual(drawn, _generator(number))


def several_cases() -> Iterator[Case]:
    """The cases of the catalogue with several effects, from `FIRST_SEVERAL` on."""
    drawn = (case(number, SEED) for number in itertools.count(FIRST_SEVERAL))
    several = (what for what in drawn if what.category in ("pair", "three"))
    for k, what in enumerate(several):
        yield what if k % PERIOD_SEVERAL == 0 else individual(what, _generator(what.number))


def _generator(number: int) -> np.random.Generator:
    return np.random.default_rng(np.random.SeedSequence(SEED, spawn_key=(number, 7)))


def individual(drawn: Case, rng: np.random.Generator) -> Case:
    """A case on an individual, with deviations of places and the noise of a real rig."""
    sensors = replace(
        drawn.sensors, torque_delay=float(rng.choice(DELAYS)), correlation=float(rng.choice(CORRELATIONS))
    )
    return replace(drawn, individual=True, places=float(rng.choice(PLACES)), sensors=sensors)


def of_any_size(what: Case, rng: np.random.Generator) -> Case:
    """A case whose effects have any of `SIZES`."""
    sizes = np.exp(rng.uniform(*np.log(SIZES), len(what.effects))).tolist()
    return replace(what, effects=tuple((name, size) for (name, _), size in zip(what.effects, sizes, strict=True)))


def observe(what: Case) -> dict[str, Any]:
    """The features of all hypotheses of one case, and which of them are true; empty where there is no diagnosis."""
    warnings.simplefilter("ignore", DoesNotFitWarning)
    made = make(what)
    with tempfile.TemporaryDirectory() as folder:
        record, drawing = made.write(Path(folder))
        found = analyse(read_record(record), BaseCurveSource(load_drive(drawing)))
    if not isinstance(found, Analysis):
        return {}
    evidence = found.evidence
    sizes = stated_sizes(evidence.problem)
    rows = hypothesis_table(evidence, sizes)
    pairs = [frozenset(pair) for pair in found.isolability.indistinguishable]
    return {
        "case": f"{what.number} {what.category} {' '.join(name for name, _ in what.effects)}",
        "individual": what.individual,
        "verdict": found.conclusion.verdict,
        "named": sorted(found.conclusion.chosen.names),
        "missing": [*made.truth.effects, *made.truth.outside],
        "rows": [[*sorted(row.effects), *(["unnamed"] if row.unnamed else [])] for row in rows],
        "features": features(rows).tolist(),
        "true": [is_true(row, made.truth, sizes, pairs) for row in rows],
    }


def is_true(row: Row, truth: Truth, sizes: Mapping[str, float], pairs: Sequence[frozenset[str]]) -> bool:
    """Whether a row is the truth, or one that no record of this kind tells from it.

    Without the effects below `LEAST_SIZE` it is as true as with them; a base curve that is off within tolerance is
    nothing.
    """
    if row.unnamed != bool(truth.outside):
        return False
    missing = frozenset(truth.effects)
    material = frozenset(name for name in missing if _is_material(name, truth.parameters.get(name, {}), sizes))
    if row.effects in (missing, material):
        return True
    other = row.effects ^ missing
    is_exchange = len(row.effects) == len(missing) and len(other) == 2
    return is_exchange and (other in pairs or (other == ALIKE and not truth.separable))


def _is_material(name: str, values: Mapping[str, float], sizes: Mapping[str, float]) -> bool:
    scaled = [abs(v) / size for key, v in values.items() if (size := sizes.get(f"{name}.{key}"))]
    return not scaled or max(scaled) >= LEAST_SIZE


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


def report(records: Sequence[dict[str, Any]], found: Sequence[Array]) -> None:
    """Print log score, share of likeliest hypotheses that are right, and the reliability curve."""
    likeliest: list[tuple[float, bool]] = []
    scores: list[float] = []
    for record, p in zip(records, found, strict=True):
        true = np.array(record["true"], bool)
        best = int(p.argmax())
        right = float(p[true].sum())
        scores.append(float(np.log((1 - OUTLIERS) * right + OUTLIERS)))
        likeliest.append((right if true[best] else float(p[best]), bool(true[best])))
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
    given = parser.parse_args()
    if given.rows is not None:
        records = json.loads(given.rows.read_text("utf-8"))
    else:
        records = []
        with ProcessPoolExecutor(given.workers) as pool:
            for number, found in enumerate(pool.map(observe, cases())):
                print(number, found.get("case", "no diagnosis"), found.get("verdict", ""), flush=True)
                records += [found] if found else []
        if given.out is not None:
            given.out.write_text(json.dumps(records), "utf-8")
    weights = fit_weights(records)
    print("weights", [round(float(w), 2) for w in weights])
    probabilities = cross_validated(records)
    for label, kept in (("all", (True, False)), ("individuals", (True,)), ("mean drives", (False,))):
        chosen = [k for k, r in enumerate(records) if r["individual"] in kept]
        print(label)
        report([records[k] for k in chosen], [probabilities[k] for k in chosen])


if __name__ == "__main__":
    main()
