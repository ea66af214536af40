"""The verdict follows from the probabilities of the hypotheses, among what the tests of significance find."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reefmu.diagnosis.hypotheses import Hypothesis
from reefmu.diagnosis.inference.evidence import Evidence
from reefmu.diagnosis.inference.nonparametric import NonparametricTerm, TermFit, curve_over_torque
from reefmu.diagnosis.inference.verdict import Conclusion
from reefmu.diagnosis.probabilities.decision import CREDIBLE, NAMED, UNNAMED, conclude, decide_by_probability
from reefmu.diagnosis.probabilities.hypothesis_table import Row
from reefmu.diagnosis.report.summary import summarise
from reefmu.diagnosis.schema import VERDICTS, Gap
from tests.unit.reefmu.diagnosis.probabilities.conftest import Fitted, evidence_of

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


def concluded(evidence: Evidence, tested: Conclusion, probability: Shares) -> Conclusion:
    friction = evidence.search.best[1][0]
    fits = {NOTHING: evidence.search.base, FRICTION: friction, SHAFT: replace(friction, names=SHAFT)}
    rows = [Row(frozenset(names), unnamed, 0.0, fits[names]) for names, unnamed in KEYS]
    return conclude(evidence, tested, rows, hypotheses_of(probability))


def conclusion_of(evidence: Evidence, verdict: str, names: tuple[str, ...] = NOTHING) -> Conclusion:
    """A conclusion of the tests of significance."""
    chosen = evidence.search.best[1][0] if names else evidence.search.base
    return Conclusion(verdict, chosen, dict.fromkeys(names, 0.9), (), 1.0, ())


@pytest.mark.parametrize(
    ("probability", "verdict", "names"),
    [
        ({(NOTHING, False): 0.9}, "none", NOTHING),
        ({(NOTHING, False): 0.4, (FRICTION, False): 0.35}, "none", NOTHING),
        ({(NOTHING, False): 0.6, (NOTHING, True): UNNAMED + 0.01}, "unknown", NOTHING),
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
def test_an_ambiguous_record_holds_the_truth_as_often_as_it_says(fitted: Fitted, shares: list[float]) -> None:
    """The likeliest hypotheses of 98 % in total that have effects are the chosen ones or alternatives."""
    evidence = evidence_of(fitted)
    probability = dict(zip(KEYS, (share / sum(shares) for share in shares), strict=True))
    found = concluded(evidence, conclusion_of(evidence, "unknown"), probability)
    assert found.verdict in VERDICTS
    if found.verdict == "ambiguous":
        given_sets = {found.chosen.names, *found.alternatives}
        assert sum(p for (names, _), p in probability.items() if names and names not in given_sets) <= 1 - CREDIBLE
        assert found.chosen.names not in found.alternatives


def test_where_tests_find_nothing_probabilities_may_name_effects_and_nothing_else(evidence: Evidence) -> None:
    nothing = conclusion_of(evidence, "none")
    assert concluded(evidence, nothing, {(FRICTION, False): 0.99}).chosen.names == FRICTION
    assert concluded(evidence, nothing, {(FRICTION, False): NAMED - 0.05, (SHAFT, False): 0.4}) is nothing
    assert concluded(evidence, nothing, {(NOTHING, True): 0.99}) is nothing
    assert concluded(evidence, nothing, {(FRICTION, True): 0.99}) is nothing


def test_a_conclusion_that_probabilities_confirm_stays(evidence: Evidence) -> None:
    """So it does beside a curve within tolerances, beside sets that no record tells apart, and where effects that the
    tolerances may mask keep it open."""
    named = conclusion_of(evidence, "named", FRICTION)
    sure: Shares = {(FRICTION, False): 0.99}
    assert concluded(evidence, named, sure) is named
    partly = replace(named, verdict="partly", curve_deviation=2.0)
    assert concluded(evidence, partly, sure) is partly
    assert concluded(evidence, partly, {(FRICTION, False): 0.5, (SHAFT, False): 0.4}).verdict == "ambiguous"
    pair = replace(named, verdict="ambiguous", alternatives=(SHAFT,))
    assert concluded(evidence, pair, sure) is concluded(evidence, pair, {(SHAFT, False): 0.99}) is pair
    masked = replace(conclusion_of(evidence, "unknown"), alternatives=(FRICTION,))
    assert concluded(evidence, masked, {(NOTHING, False): 0.99}) is masked


def test_probabilities_take_back_names_and_findings(evidence: Evidence) -> None:
    named, unknown = conclusion_of(evidence, "named", FRICTION), conclusion_of(evidence, "unknown")
    found = concluded(evidence, named, {(FRICTION, False): 0.5, (SHAFT, False): 0.4})
    assert (found.verdict, found.chosen, found.alternatives) == ("ambiguous", named.chosen, (SHAFT,))
    sentence = summarise(found, Gap(5.0, 1.0, 0.5), 100.0)
    assert "(hysteresis) may explain it" in sentence
    assert "so may coulomb_friction" in sentence
    found = concluded(evidence, unknown, {(NOTHING, False): 0.9})
    assert (found.verdict, found.chosen.names, found.unnamed) == ("none", (), None)
    found = concluded(evidence, named, {(NOTHING, False): 0.45, (FRICTION, False): 0.55, (SHAFT, False): 0.0})
    assert (found.verdict, found.alternatives) == ("ambiguous", ())
    assert "may explain it" in summarise(found, Gap(5.0, 1.0, 0.5), 100.0)


def test_effects_that_the_tests_did_not_give_are_tested(evidence: Evidence) -> None:
    """They come with the part of the excess that each removes, and with the tests made of them."""
    found = concluded(evidence, conclusion_of(evidence, "unknown"), {(FRICTION, False): 0.9})
    assert (found.verdict, found.chosen.names) == ("named", FRICTION)
    assert 0.5 < found.shares["hysteresis"] <= 1.0
    assert [test.fit.names for test in found.tests] == [FRICTION]


@pytest.mark.parametrize("unnamed", [False, True])
def test_what_is_beside_the_effects_is_a_remainder_or_a_curve_of_tolerances(evidence: Evidence, unnamed: bool) -> None:
    term = TermFit(NonparametricTerm("torque", curve_over_torque), 40.0, 3.0 * np.ones(len(evidence.problem.torque)))
    rows = [Row(frozenset(FRICTION), unnamed, 0.0, evidence.search.best[1][0], term)]
    found = conclude(evidence, conclusion_of(evidence, "unknown"), rows, [Hypothesis(FRICTION, unnamed, 1.0)])
    assert found.verdict == ("partly" if unnamed else "named")
    assert found.unnamed is (term if unnamed else None)
    assert found.curve_deviation == (0.0 if unnamed else 3.0)
    assert (found.remainder >= 3.0) is unnamed
    sentence = summarise(found, Gap(5.0, 1.0, 0.5), 100.0)
    assert ("it varies with torque" in sentence) is unnamed
    assert ("the curve deviates by 3 N.m" in sentence) is not unnamed


def test_an_effect_too_small_to_matter_is_left_out_of_the_fit(evidence: Evidence) -> None:
    rows = [Row(frozenset(), False, 0.0, evidence.search.best[1][0])]
    found = conclude(evidence, conclusion_of(evidence, "unknown", FRICTION), rows, [Hypothesis((), False, 1.0)])
    assert found.verdict == "none"
    assert found.chosen is evidence.search.base
