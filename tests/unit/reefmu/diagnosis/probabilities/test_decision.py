"""The verdict follows from the probabilities of the hypotheses."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reefmu.diagnosis.calibrated_odds import NAMED
from reefmu.diagnosis.hypotheses import Hypothesis
from reefmu.diagnosis.inference.evidence import Evidence
from reefmu.diagnosis.inference.nonparametric import NonparametricTerm, TermFit, curve_over_torque
from reefmu.diagnosis.inference.tolerance_curve import CurveDeviation
from reefmu.diagnosis.inference.unnamed import EXCESS
from reefmu.diagnosis.probabilities.decision import (
    CREDIBLE,
    UNNAMED,
    Conclusion,
    conclude,
    decide_by_probability,
)
from reefmu.diagnosis.probabilities.decision import NOTHING as MISSES
from reefmu.diagnosis.probabilities.hypothesis_table import Row
from reefmu.diagnosis.report.summary import summarise
from reefmu.diagnosis.schema import VERDICTS, Gap
from tests.unit.reefmu.diagnosis.probabilities.conftest import SOMETHING, Fitted, evidence_of

NOTHING, FRICTION, SHAFT = (), ("hysteresis",), ("coulomb_friction",)
KEYS = tuple((names, unnamed) for names in (NOTHING, FRICTION, SHAFT) for unnamed in (False, True))
Shares = dict[tuple[tuple[str, ...], bool], float]


@pytest.fixture
def evidence(fitted: Fitted) -> Evidence:
    return evidence_of(fitted)


def hypotheses_of(probability: Shares) -> list[Hypothesis]:
    """These hypotheses with these probabilities; the others without anything unnamed share what is left."""
    others = [key for key in KEYS if key not in probability and not key[1]]
    left = (1 - sum(probability.values())) / max(len(others), 1)
    return [Hypothesis(*key, probability.get(key, left if key in others else 0.0)) for key in KEYS]


def concluded(evidence: Evidence, probability: Shares) -> Conclusion:
    friction = evidence.search.best[1][0]
    fits = {NOTHING: evidence.search.base, FRICTION: friction, SHAFT: replace(friction, names=SHAFT)}
    rows = [Row(frozenset(names), unnamed, 0.0, fits[names], SOMETHING if unnamed else None) for names, unnamed in KEYS]
    return conclude(evidence, rows, hypotheses_of(probability))


@pytest.mark.parametrize(
    ("probability", "verdict", "names"),
    [
        ({(NOTHING, False): 0.9}, "none", NOTHING),
        ({(NOTHING, False): MISSES + 0.01, (FRICTION, False): 0.35}, "none", NOTHING),
        ({(NOTHING, False): MISSES - 0.01, (FRICTION, False): 0.35}, "ambiguous", NOTHING),
        ({(NOTHING, False): 0.6, (NOTHING, True): UNNAMED + 0.01}, "unknown", NOTHING),
        ({(NOTHING, False): 0.3, (NOTHING, True): 0.32, (FRICTION, False): 0.2}, "ambiguous", NOTHING),
        ({(NOTHING, False): 0.6, (NOTHING, True): UNNAMED - 0.01}, "none", NOTHING),
        ({(NOTHING, True): 0.2, (FRICTION, True): 0.2, (FRICTION, False): 0.35}, "unknown", NOTHING),
        ({(FRICTION, False): NAMED + 0.01}, "named", FRICTION),
        ({(FRICTION, False): NAMED - 0.01, (SHAFT, False): 0.2}, "ambiguous", FRICTION),
        ({(FRICTION, False): NAMED - 0.1, (FRICTION, True): 0.11}, "named", FRICTION),
        ({(FRICTION, False): 0.5, (FRICTION, True): 0.3}, "partly", FRICTION),
        ({(FRICTION, True): 0.4, (SHAFT, True): 0.3, (NOTHING, False): 0.3}, "unknown", NOTHING),
        ({(FRICTION, True): 0.55, (SHAFT, True): 0.42}, "ambiguous", FRICTION),
    ],
)
def test_the_verdict_of_probabilities(probability: Shares, verdict: str, names: tuple[str, ...]) -> None:
    found = decide_by_probability(hypotheses_of(probability))
    assert (found.verdict, found.effects) == (verdict, frozenset(names))


@given(shares=st.lists(st.floats(0.001, 1.0), min_size=len(KEYS), max_size=len(KEYS)))
def test_the_reported_sets_hold_the_truth_as_often_as_they_say(fitted: Fitted, shares: list[float]) -> None:
    """The likeliest hypotheses of 98 % in total are the chosen ones, alternatives or something unnamed alone."""
    evidence = evidence_of(fitted)
    probability = dict(zip(KEYS, (share / sum(shares) for share in shares), strict=True))
    found = concluded(evidence, probability)
    assert found.verdict in VERDICTS
    if found.verdict not in ("none", "unknown"):
        given_sets = {found.chosen.names, *found.alternatives}
        left = sum(p for key, p in probability.items() if key != (NOTHING, True) and key[0] not in given_sets)
        assert left <= 1 - CREDIBLE + 1e-12
        assert found.chosen.names not in found.alternatives


def test_an_ambiguous_record_is_told_with_all_that_may_be_missing(evidence: Evidence) -> None:
    found = concluded(evidence, {(FRICTION, False): 0.55, (SHAFT, False): 0.45})
    assert (found.verdict, found.chosen.names, found.alternatives) == ("ambiguous", FRICTION, (SHAFT,))
    sentence = summarise(found, Gap(5.0, 1.0, 0.5), 100.0)
    assert "(hysteresis) may explain it" in sentence
    assert "so may coulomb_friction" in sentence
    assert "cannot tell which effect" in sentence
    found = concluded(evidence, {(NOTHING, False): 0.45, (FRICTION, False): 0.55, (SHAFT, False): 0.0})
    assert (found.verdict, found.alternatives) == ("ambiguous", (NOTHING,))
    sentence = summarise(found, Gap(5.0, 1.0, 0.5), 100.0)
    assert "cannot tell whether an effect is missing" in sentence
    assert "may explain it" in sentence
    shares = {(NOTHING, False): 0.49, (FRICTION, False): 0.48, (FRICTION, True): 0.03, (SHAFT, False): 0.0}
    found = concluded(evidence, shares)
    assert (found.verdict, found.chosen.names, found.alternatives) == ("ambiguous", NOTHING, (FRICTION,))
    assert "perhaps none is, perhaps hysteresis" in summarise(found, Gap(5.0, 1.0, 0.5), 100.0)


def test_a_named_effect_comes_with_the_sets_that_are_not_excluded(evidence: Evidence) -> None:
    found = concluded(evidence, {(FRICTION, False): 0.7, (SHAFT, False): 0.2, (NOTHING, False): 0.1})
    assert (found.verdict, found.alternatives) == ("named", (SHAFT, NOTHING))
    found = concluded(evidence, {(FRICTION, False): 0.99, (SHAFT, False): 0.01, (NOTHING, False): 0.0})
    assert (found.verdict, found.alternatives) == ("named", ())
    found = concluded(evidence, {(NOTHING, False): 0.7, (SHAFT, False): 0.2, (FRICTION, False): 0.1})
    assert (found.verdict, found.alternatives) == ("none", ())


def test_what_does_not_show_is_an_alternative_and_no_finding(evidence: Evidence) -> None:
    """Neither an effect without evidence nor something unnamed that is too small takes from what the record shows."""
    base, friction = evidence.search.base, evidence.search.best[1][0]
    both = ("hysteresis", "wear")
    rows = [
        Row(frozenset(FRICTION), False, 0.0, friction),
        Row(frozenset(both), False, -1.0, friction, faint=frozenset({"wear"})),
        Row(frozenset(FRICTION), True, 0.0, friction),
        Row(frozenset(), False, -5.0, base),
    ]
    assert [row.is_hidden for row in rows] == [False, False, True, False]
    shares = (0.4, 0.3, 0.2, 0.1)
    told = [Hypothesis(tuple(r.effects), r.unnamed, p) for r, p in zip(rows, shares, strict=True)]
    found = conclude(evidence, rows, told)
    assert (found.verdict, found.chosen.names) == ("named", FRICTION)
    assert found.alternatives == (both, NOTHING)
    assert found.shown_alternatives == (NOTHING,)


@pytest.mark.parametrize("unnamed", [False, True])
def test_something_unnamed_beside_the_effects_is_a_remainder(evidence: Evidence, unnamed: bool) -> None:
    term = TermFit(NonparametricTerm("torque", curve_over_torque), 40.0, 3.0 * np.ones(len(evidence.problem.torque)))
    rows = [Row(frozenset(FRICTION), unnamed, 0.0, evidence.search.best[1][0], term)]
    found = conclude(evidence, rows, [Hypothesis(FRICTION, unnamed, 1.0)])
    assert found.verdict == ("partly" if unnamed else "named")
    assert found.unnamed is (term if unnamed else None)
    assert (found.remainder >= 3.0) is unnamed
    sentence = summarise(found, Gap(5.0, 1.0, 0.5), 100.0)
    assert ("it varies with torque" in sentence) is unnamed


def test_a_remainder_that_shows_in_no_coordinate_is_told_as_such(evidence: Evidence) -> None:
    term = TermFit(EXCESS, 40.0, 3.0 * np.ones(len(evidence.problem.torque)))
    rows = [Row(frozenset(), True, 0.0, evidence.search.base, term)]
    found = conclude(evidence, rows, [Hypothesis(NOTHING, True, 1.0)])
    assert found.verdict == "unknown"
    sentence = summarise(found, Gap(5.0, 5.0, 0.5), 100.0)
    assert sentence.endswith("no known effect explains it; it varies with nothing that the record holds.")


def test_a_curve_within_the_tolerances_is_told_with_the_modulus_that_would_make_it(evidence: Evidence) -> None:
    found = concluded(evidence, {(NOTHING, False): 0.9})
    assert found.curve_deviation is None, "no drawing states tolerances"
    sentence = summarise(replace(found, curve_deviation=CurveDeviation(1.2, -0.021, 0.034)), Gap(5.0, 1.0, 0.5), 100.0)
    assert "deviates by 1.2 N.m rms, as a modulus that is -2.1 % off would make it" in sentence
    assert sentence.endswith("(standard deviation 3.4 %): modulus or tolerance.")


def test_an_effect_too_small_to_matter_is_left_out_of_the_fit(evidence: Evidence) -> None:
    rows = [Row(frozenset(), False, 0.0, evidence.search.best[1][0])]
    found = conclude(evidence, rows, [Hypothesis((), False, 1.0)])
    assert found.verdict == "none"
    assert found.chosen is evidence.search.base
