"""Probabilities of hypotheses: a distribution, which follows the evidence and what each hypothesis assumes."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reefmu.diagnosis.calibrated_odds import CALIBRATED, DEGREES_OF_FREEDOM, flattened, log_odds
from reefmu.diagnosis.hypotheses import Hypothesis
from reefmu.diagnosis.probabilities.calibration import probabilities
from reefmu.diagnosis.probabilities.hypothesis_table import Row
from tests.unit.reefmu.diagnosis.probabilities.conftest import SOMETHING, make_row

NOTHING, CREEP, WEAR = frozenset[str](), frozenset({"creep"}), frozenset({"wear"})


def table(evidence: dict[frozenset[str], float]) -> list[Row]:
    return [make_row(names, unnamed, log) for names, log in evidence.items() for unnamed in (False, True)]


def probability(rows: list[Row], names: frozenset[str], unnamed: bool = False) -> float:
    found = probabilities(rows)
    return sum(h.probability for h in found if (frozenset(h.effects), h.unnamed) == (names, unnamed))


@given(st.lists(st.floats(-1e5, 1e5), min_size=3, max_size=3), st.floats(-1e4, 1e4))
def test_they_sum_to_one_and_depend_on_differences_of_evidence_alone(logs: list[float], shift: float) -> None:
    rows = table(dict(zip((NOTHING, CREEP, WEAR), logs, strict=True)))
    found = probabilities(rows)
    assert sum(h.probability for h in found) == pytest.approx(1.0)
    moved = [make_row(r.effects, r.unnamed, r.log_evidence + shift) for r in rows]
    for one, other in zip(found, probabilities(moved), strict=True):
        assert one.probability == pytest.approx(other.probability, rel=1e-3, abs=1e-6)


def test_odds_follow_the_weights() -> None:
    """Two hypotheses: the odds are those of their evidence, flattened, and of their number."""
    rows = [make_row(CREEP, False, 50.0), make_row(WEAR, False, 20.0)]
    half = DEGREES_OF_FREEDOM / 2
    odds = (1 + 30.0 / half) ** (CALIBRATED.evidence * half)
    assert probability(rows, CREEP) == pytest.approx(odds / (1 + odds))
    rows[1] = make_row(CREEP | WEAR, False, 20.0)
    odds *= math.exp(-CALIBRATED.effect)
    assert probability(rows, CREEP) == pytest.approx(odds / (1 + odds))


def test_predictions_have_the_odds_of_the_diagnosis() -> None:
    evidence = {NOTHING: 3.0, CREEP: 40.0, CREEP | WEAR: 45.0}
    found = probabilities([make_row(names, False, log) for names, log in evidence.items()])
    below = max(evidence.values()) - np.array([*evidence.values()])
    share = np.exp(log_odds(below, np.array([0, 1, 2])))
    assert np.allclose([h.probability for h in found], share / share.sum())


def test_something_unnamed_is_told_by_the_best_evidence_with_and_without_it() -> None:
    half = DEGREES_OF_FREEDOM / 2
    rows = [make_row(CREEP, False, 10.0), make_row(CREEP, True, 40.0, SOMETHING)]
    odds = (1 + 30.0 / half) ** (CALIBRATED.unnamed_evidence * half) * math.exp(CALIBRATED.unnamed)
    assert probability(rows, CREEP, True) == pytest.approx(odds / (1 + odds))
    rows = [make_row(CREEP, False, 40.0), make_row(CREEP, True, 10.0, SOMETHING)]
    odds = (1 + 30.0 / half) ** (-CALIBRATED.unnamed_evidence * half) * math.exp(CALIBRATED.unnamed)
    assert probability(rows, CREEP, True) == pytest.approx(odds / (1 + odds))


@given(st.floats(-1e3, 1e3))
def test_what_is_unnamed_decides_between_no_sets_of_effects(ahead: float) -> None:
    """However much evidence there is for it: whatever makes it stands beside each of them."""
    known = [make_row(NOTHING, False, 0.0), make_row(CREEP, False, 6.0), make_row(WEAR, False, 3.0)]
    beside = [make_row(NOTHING, True, ahead, SOMETHING), make_row(CREEP, True, ahead + 2.0, SOMETHING)]
    odds = [probability(rows, CREEP) / probability(rows, WEAR) for rows in (known, [*known, *beside])]
    assert odds[1] == pytest.approx(odds[0])
    unnamed = probability([*known, *beside], CREEP, True) / probability([*known, *beside], NOTHING, True)
    expected = math.exp(CALIBRATED.evidence * float(flattened(2.0)) + CALIBRATED.effect)
    assert unnamed == pytest.approx(expected)


def test_something_unnamed_that_does_not_show_has_odds_of_its_own() -> None:
    """Whatever the record, they are those to the same effects alone."""
    for log in (0.0, -30.0):
        rows = [make_row(NOTHING, False, 0.0), make_row(CREEP, False, log), make_row(CREEP, True, log)]
        odds = probability(rows, CREEP, True) / probability(rows, CREEP)
        assert odds == pytest.approx(math.exp(CALIBRATED.hidden))


def test_more_effects_and_something_unnamed_cost_probability() -> None:
    equal = table({NOTHING: 0.0, CREEP: 0.0, CREEP | WEAR: 0.0})
    assert probability(equal, NOTHING) > probability(equal, CREEP)
    assert probability(equal, CREEP) > probability(equal, CREEP | WEAR)
    assert probability(equal, NOTHING) > probability(equal, NOTHING, True)


def test_they_are_hypotheses_of_the_schema() -> None:
    assert probabilities([make_row(CREEP, True, 3.0)]) == (Hypothesis(("creep",), True, 1.0),)
