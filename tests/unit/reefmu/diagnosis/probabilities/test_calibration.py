"""Probabilities of hypotheses: a distribution, which follows the evidence and the verdict."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from reefmu.diagnosis.hypotheses import Hypothesis
from reefmu.diagnosis.probabilities.calibration import CALIBRATED, Verdict, probabilities, verdict_of
from reefmu.diagnosis.probabilities.hypothesis_table import Row
from tests.unit.reefmu.diagnosis.probabilities.conftest import make_row

NOTHING, CREEP, WEAR = frozenset[str](), frozenset({"creep"}), frozenset({"wear"})
UNDECIDED = verdict_of("unknown", (), ())
NAMED_CREEP = verdict_of("named", ("creep",), ())


def table(evidence: dict[frozenset[str], float], scatter: float = 1.0) -> list[Row]:
    return [make_row(names, unnamed, log, scatter) for names, log in evidence.items() for unnamed in (False, True)]


def probability(rows: list[Row], verdict: Verdict, names: frozenset[str], unnamed: bool = False) -> float:
    found = probabilities(rows, verdict)
    return sum(h.probability for h in found if (frozenset(h.effects), h.unnamed) == (names, unnamed))


@given(st.lists(st.floats(-1e5, 1e5), min_size=3, max_size=3), st.floats(0, 2.8), st.floats(-1e4, 1e4))
def test_they_sum_to_one_and_depend_on_differences_of_evidence_alone(
    logs: list[float], scatter: float, shift: float
) -> None:
    rows = table(dict(zip((NOTHING, CREEP, WEAR), logs, strict=True)), scatter)
    found = probabilities(rows, UNDECIDED)
    assert sum(h.probability for h in found) == pytest.approx(1.0)
    moved = [make_row(r.effects, r.unnamed, r.log_evidence + shift, r.scatter) for r in rows]
    for one, other in zip(found, probabilities(moved, UNDECIDED), strict=True):
        assert one.probability == pytest.approx(other.probability, rel=1e-3, abs=1e-6)


def test_odds_follow_the_weights() -> None:
    """Two hypotheses of one effect: the odds are those of their evidence, flattened, and of the verdict."""
    rows = [make_row(CREEP, False, 50.0, 0.0), make_row(WEAR, False, 20.0, 0.0)]
    odds = math.exp(CALIBRATED.evidence * math.sqrt(30.0))
    assert probability(rows, UNDECIDED, CREEP) == pytest.approx(odds / (1 + odds))
    odds *= math.exp(CALIBRATED.verdict - 2 * CALIBRATED.differing)
    assert probability(rows, verdict_of("named", CREEP, ()), CREEP) == pytest.approx(odds / (1 + odds))


@pytest.mark.parametrize(("scatter", "weight"), [(0.0, CALIBRATED.unnamed_size), (1.0, CALIBRATED.unnamed_size)])
def test_something_unnamed_is_likelier_the_larger_it_is(scatter: float, weight: float) -> None:
    """The odds grow by a power of its share of full torque and, on an individual, of that of what individuals show."""
    weight += CALIBRATED.unnamed_excess if scatter else 0.0
    odds: list[float] = []
    for size in (0.01, 0.05):
        rows = [make_row(NOTHING, False, 0.0, scatter), make_row(NOTHING, True, 0.0, scatter, size, 10 * size)]
        unnamed = probability(rows, UNDECIDED, NOTHING, True)
        odds.append(unnamed / (1 - unnamed))
    assert odds[1] / odds[0] == pytest.approx(5**weight)


def test_tests_of_what_is_left_count_on_a_mean_drive() -> None:
    """On an individual its scatter leaves as much."""
    for scatter, factor in ((0.0, math.exp(CALIBRATED.verdict_unnamed)), (1.0, 1.0)):
        rows = [make_row(NOTHING, unnamed, 0.0, scatter, 0.01, 1.0) for unnamed in (False, True)]
        odds = [1 / probability(rows, verdict, NOTHING, True) - 1 for verdict in (NAMED_CREEP, UNDECIDED)]
        assert odds[0] / odds[1] == pytest.approx(factor)


def test_more_effects_something_unnamed_and_an_implausible_scatter_cost_probability() -> None:
    equal = table({NOTHING: 0.0, CREEP: 0.0, CREEP | WEAR: 0.0})
    assert probability(equal, UNDECIDED, NOTHING) > probability(equal, UNDECIDED, CREEP)
    assert probability(equal, UNDECIDED, CREEP) > probability(equal, UNDECIDED, CREEP | WEAR)
    assert probability(equal, UNDECIDED, NOTHING) > probability(equal, UNDECIDED, NOTHING, True)
    drawn, wide = make_row(CREEP, False, 0.0, 1.0), make_row(WEAR, False, 0.0, 2.8)
    assert probability([drawn, wide], UNDECIDED, CREEP) > 0.5


@pytest.mark.parametrize(
    ("name", "chosen", "given", "rows"),
    [
        ("named", ("creep",), [(CREEP, False), (CREEP, True)], True),
        ("partly", ("creep",), [(CREEP, False), (CREEP, True)], True),
        ("ambiguous", ("creep",), [(CREEP, False), (WEAR, False)], True),
        ("none", (), [(NOTHING, False)], False),
        ("unknown", (), [], False),
    ],
)
def test_what_a_verdict_gives(
    name: str, chosen: tuple[str, ...], given: list[tuple[frozenset[str], bool]], rows: bool
) -> None:
    verdict = verdict_of(name, chosen, [("wear",)])
    whole = table({NOTHING: 0.0, CREEP: 0.0, WEAR: 0.0}, 0.0)
    meant = [(r.effects, r.unnamed) for r in whole if (verdict.gives(r) if rows else verdict.is_nothing(r))]
    assert meant == given
    assert not any(verdict.is_nothing(r) if rows else verdict.gives(r) for r in whole)
    assert not any(verdict.is_nothing(r) for r in table({NOTHING: 0.0}, scatter=1.0)), "an individual scatters"


def test_they_are_hypotheses_of_the_schema() -> None:
    assert probabilities([make_row(CREEP, True, 3.0, 0.0)], UNDECIDED) == (Hypothesis(("creep",), True, 1.0),)
