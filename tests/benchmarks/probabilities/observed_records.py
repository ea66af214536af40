"""What the diagnosis of one case says of every hypothesis, and which of them are true."""

from __future__ import annotations

import tempfile
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

from reefmu.diagnosis.analysis import Analysis
from reefmu.diagnosis.inference.tolerance_curve import CURVE_EFFECTS
from reefmu.diagnosis.pipeline import analyse
from reefmu.diagnosis.preparation import BaseCurveSource
from reefmu.diagnosis.probabilities.assessment import stated_sizes
from reefmu.diagnosis.probabilities.calibration import features
from reefmu.diagnosis.probabilities.hypothesis_table import LEAST_SIZE, Row, hypothesis_table
from reefmu.record import Record, read_record
from stiffness_model import DoesNotFitWarning, Drive, load_drive
from stiffness_model.errors import InputError
from tests.validation.blind.records import Case, Truth, make
from tests.validation.blind_individuals.catalogue import case as case_of_individuals
from tests.validation.blind_individuals.records import make as make_sealed

DEGREES = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Degrees of freedom of `calibrated_odds.flattened` for which the features of a record are known."""
SECOND_SEEDS = (24, 25, 26, 27)
"""Seeds of the catalogues of the second generator to which the weights are fitted: those from which it no longer
switches loaded elements off, scored before they were used here."""
ALIKE = frozenset({"modulus_error", "structural_compliance"})
"""Effects that the catalogue calls alike where its truth is not separable."""
Sizes = Mapping[str, float]
"""Typical sizes, SI, by `effect.parameter`."""
Pairs = Sequence[frozenset[str]]
"""Effects that a record does not tell apart."""
KINEMATIC = "kinematic_error"
"""What the lobes of an individual make, if no drawing says so."""


def analysed(what: Case, source: BaseCurveSource | None = None) -> tuple[Analysis | None, Truth]:
    """The analysis of a case by its drawing or by another source, None where there is no diagnosis, and the truth.

    Without a drawing some records show no transmission ratio, and there is none.
    """
    warnings.simplefilter("ignore", DoesNotFitWarning)
    made = make(what)
    with tempfile.TemporaryDirectory() as folder:
        record, drawing = made.write(Path(folder))
        try:
            found = analyse(read_record(record), source or BaseCurveSource(load_drive(drawing)))
        except InputError:
            return None, made.truth
    return found if isinstance(found, Analysis) else None, made.truth


def observe(what: Case) -> dict[str, Any]:
    """The features of all hypotheses of one case, and which of them are true; empty where there is no diagnosis."""
    found, truth = analysed(what)
    return {} if found is None else _observed(found, truth, is_true)


def second_record(number: int, seed: int, *, bounds: bool = False) -> tuple[Record, Drive, dict[str, Any]]:
    """A record of the second generator with its drive and the truth; bounds: whether the truth has the Cramer-Rao
    bounds of its effects."""
    warnings.simplefilter("ignore", DoesNotFitWarning)
    sealed = make_sealed(case_of_individuals(number, seed), bounds=bounds)
    with tempfile.TemporaryDirectory() as folder:
        record, drawing = Path(folder, "record.csv"), Path(folder, "drive.toml")
        record.write_text(sealed.record, "utf-8")
        drawing.write_text(sealed.drawing, "utf-8")
        return read_record(record), load_drive(drawing), sealed.truth.to_dict()


def analysed_second(number: int, seed: int, *, bounds: bool) -> tuple[Analysis | None, dict[str, Any]]:
    """The analysis of that record, None where there is no diagnosis, and the truth."""
    record, drive, truth = second_record(number, seed, bounds=bounds)
    found = analyse(record, BaseCurveSource(drive))
    return found if isinstance(found, Analysis) else None, truth


def observe_second(place: tuple[int, int]) -> dict[str, Any]:
    """What `observe` says, of a record of the second generator, by seed and number; empty where there is no
    diagnosis."""
    seed, number = place
    found, truth = analysed_second(number, seed, bounds=False)
    if found is None:
        return {}
    hidden = frozenset(truth["names"]), bool(truth["foreign"])
    rows = _rows(found)
    about = {"case": f"second {seed} {number}", "individual": truth["individual"], "missing": [*truth["names"]]}
    return about | _features(found, rows, [(row.effects, row.unnamed) == hidden for row in rows])


def observe_without_drawing(what: Case) -> dict[str, Any]:
    """The same where no drawing is known, so that the base curve is a power law."""
    found, truth = analysed(what, BaseCurveSource())
    if found is None:
        return {}
    excluded = frozenset(found.evidence.problem.excluded)
    return _observed(found, truth, partial(is_true_without_drawing, excluded=excluded))


def _observed(found: Analysis, truth: Truth, judge: Callable[[Row, Truth, Sizes, Pairs], bool]) -> dict[str, Any]:
    what, rows = truth.case, _rows(found)
    sizes = stated_sizes(found.evidence.problem)
    pairs = [frozenset(pair) for pair in found.isolability.indistinguishable]
    about = {
        "case": f"{what.number} {what.category} {' '.join(name for name, _ in what.effects)}",
        "individual": what.individual,
        "missing": [*truth.effects, *truth.outside],
    }
    return about | _features(found, rows, [judge(row, truth, sizes, pairs) for row in rows])


def _rows(found: Analysis) -> Sequence[Row]:
    return hypothesis_table(found.evidence, stated_sizes(found.evidence.problem))


def _features(found: Analysis, rows: Sequence[Row], true: Sequence[bool]) -> dict[str, Any]:
    return {
        "verdict": found.conclusion.verdict,
        "named": sorted(found.conclusion.chosen.names),
        "rows": [[*sorted(row.effects), *(["unnamed"] if row.unnamed else [])] for row in rows],
        "features": {f"{degrees:g}": features(rows, degrees).tolist() for degrees in DEGREES},
        "true": list(true),
    }


def is_true(row: Row, truth: Truth, sizes: Sizes, pairs: Pairs) -> bool:
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


def is_true_without_drawing(row: Row, truth: Truth, sizes: Sizes, pairs: Pairs, excluded: frozenset[str]) -> bool:
    """The same where no drawing is known; excluded: effects that are no candidates without it.

    A power law takes in what changes the curve alone, and the lobes of an individual make kinematic errors: a row is as
    true with these as without. What a power law cannot follow, effects that are no candidates and the tolerances of an
    individual may count as something unnamed or not.
    """
    free = CURVE_EFFECTS | excluded | ({KINEMATIC} if truth.case.individual else frozenset())
    known = replace(truth, effects=tuple(name for name in truth.effects if name not in free))
    if not truth.outside:
        known = replace(known, outside=("drawing",) if row.unnamed else ())
    return is_true(replace(row, effects=row.effects - free), known, sizes, pairs)


def _is_material(name: str, values: Mapping[str, float], sizes: Mapping[str, float]) -> bool:
    scaled = [abs(v) / size for key, v in values.items() if (size := sizes.get(f"{name}.{key}"))]
    return not scaled or max(scaled) >= LEAST_SIZE
