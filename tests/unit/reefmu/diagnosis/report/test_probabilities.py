"""The report leads with probabilities: which bars, rivals, effects and cautions it shows."""

from __future__ import annotations

import re
from dataclasses import replace

import pytest

from reefmu.diagnosis import Diagnosis, Gap, Hypothesis, IsolabilityMatrix, NamedEffect, Value
from reefmu.diagnosis.report.html.page import report_html
from reefmu.diagnosis.report.rivals import is_reported, relevant_effects, rivals
from reefmu.diagnosis.report.text import CALIBRATION, cautions
from reefmu.effects import EFFECTS

HYSTERESIS = NamedEffect("hysteresis", {"torque": Value(4.0, 3.9, 4.1, "N.m")}, 0.9)
HYPOTHESES = (
    Hypothesis(("hysteresis",), False, 0.6),
    Hypothesis(("hysteresis", "preload"), False, 0.25),
    Hypothesis(("hysteresis",), True, 0.08),
    Hypothesis((), True, 0.04),
    Hypothesis((), False, 0.02),
    Hypothesis(("creep",), False, 0.008),
    Hypothesis(("wear",), False, 0.002),
)
PLAIN = Diagnosis("named", "Hysteresis is missing.", (HYSTERESIS,), (), (), Gap(5.0, 1.0, 0.9), ("hold it still",))


def matrix_of(*names: str, wrong: dict[tuple[str, str], float] | None = None) -> IsolabilityMatrix:
    """Each effect is named with 0.9 when it is missing; wrong: by (missing, named)."""
    errors = wrong or {}
    rows = [tuple(0.9 if a == b else errors.get((a, b), 0.0) for b in names) for a in names]
    return IsolabilityMatrix(names, tuple(rows))


def made(verdict: str = "named", **changes: object) -> Diagnosis:
    whole = PLAIN.with_probabilities(HYPOTHESES, 0.31, matrix_of("wear", "preload", "hysteresis", "damping", "creep"))
    return replace(whole, verdict=verdict, **changes)  # type: ignore[arg-type]


def bars(text: str) -> list[tuple[str, str, str]]:
    """Label, width and probability of each bar."""
    return re.findall(
        r"<li[^>]*><span>([^<]*)</span><span class=track><span style='width:([^']*)'>.*?<b>(.*?)</b>", text
    )


@pytest.mark.parametrize(
    ("verdict", "effects", "covered"),
    [
        ("named", (HYSTERESIS,), [0]),
        ("partly", (HYSTERESIS,), [2]),
        ("ambiguous", (HYSTERESIS,), [0, 1, 2]),
        ("unknown", (), [3]),
        ("none", (), [4]),
    ],
)
def test_the_hypotheses_that_a_verdict_covers(
    verdict: str, effects: tuple[NamedEffect, ...], covered: list[int]
) -> None:
    found = made(verdict, effects=effects, alternatives=(("preload", "hysteresis"),))
    assert [k for k, h in enumerate(HYPOTHESES) if is_reported(found, h)] == covered


def test_rivals_are_the_other_probable_hypotheses() -> None:
    assert [h.probability for h in rivals(made())] == [0.25, 0.08, 0.04, 0.02, 0.008]
    assert 0.6 in [h.probability for h in rivals(made("none", effects=()))]
    assert rivals(PLAIN.with_probabilities([Hypothesis(("hysteresis",), False, 1.0)], None, None)) == ()


def test_bars_show_the_likeliest_hypotheses_and_the_sum_of_the_others() -> None:
    text = report_html(made())
    found = bars(text)
    assert found[0] == ("hysteresis", "60.0%", "60 %")
    assert found[1] == ("hysteresis and preload", "25.0%", "25 %")
    assert [label for label, _, _ in found[2:5]] == [
        "hysteresis and something without a name",
        "something without a name",
        "nothing is missing",
    ]
    many = [Hypothesis((), False, 0.5), *(Hypothesis((name,), False, 0.05) for name in list(EFFECTS)[:10])]
    assert bars(report_html(PLAIN.with_probabilities(many, None, None)))[-1] == ("5 others together", "25.0%", "25 %")


def test_the_page_leads_with_the_probabilities() -> None:
    text = report_html(made())
    parts = [
        "Hysteresis is missing.",
        "60 %",
        "p = 0.31",
        CALIBRATION,
        "What would change the verdict",
        "hold it still",
    ]
    places = [text.index(part) for part in [*parts, "What this record tells apart", "class=cards"]]
    assert places == sorted(places)
    assert text.count("hold it still") == 1


def test_a_page_without_hypotheses_has_no_empty_parts() -> None:
    text = report_html(PLAIN)
    for part in (CALIBRATION, "What would change", "tells apart", "overview>"):
        assert part not in text
    assert "What to measure next" in text


def test_a_small_p_value_is_a_caution() -> None:
    assert cautions(made()) == []
    poor = made(global_p=0.0002)
    assert len(cautions(poor)) == 1
    assert "does not explain the record: p &lt; 0.001" in report_html(poor)
    assert "The chosen model" not in report_html(made(global_p=None))


def test_effects_that_matter_are_the_named_their_rivals_and_what_is_taken_for_them() -> None:
    names = ("wear", "damping", "preload", "hysteresis", "creep", "thermal_clearance")
    found = made(isolability=matrix_of(*names, wrong={("damping", "hysteresis"): 0.1, ("wear", "hysteresis"): 0.04}))
    assert relevant_effects(found) == ("hysteresis", "preload", "creep", "damping")


def test_where_nothing_is_named_the_matrix_shows_what_the_record_may_hide() -> None:
    names = [*(f"effect_{k}" for k in range(15)), "hysteresis", "preload"]
    rows = tuple(tuple(k / 17 if k == j else 0.0 for j in range(17)) for k in range(17))
    found = made("none", effects=(), isolability=IsolabilityMatrix(tuple(names), rows))
    assert relevant_effects(found) == ("hysteresis", "preload", *names[:8])
    assert report_html(found).count("<th scope=row>") == 10


def test_cells_of_the_matrix_are_percent_and_grey_where_zero() -> None:
    matrix = IsolabilityMatrix(("hysteresis", "preload", "creep"), ((0.9, 0.06, 0.0), (0.0, 0.7, 0.3), (0.2, 0.0, 0.6)))
    found = made(isolability=matrix, hypotheses=HYPOTHESES[:2])
    text = report_html(found).split("<table class=heat>")[1].split("</table>")[0]
    rows = [re.findall(r"<td( class=zero)?[^>]*>(\d+)</td>", row) for row in text.split("<th scope=row>")[1:]]
    assert [[int(cell) for _, cell in row] for row in rows] == [[90, 6, 0, 4], [0, 70, 30, 0], [20, 0, 60, 20]]
    assert all((cell == "0") == bool(zero) for row in rows for zero, cell in row)
    assert "another effect" not in text
    others = matrix_of("hysteresis", "preload", "damping", wrong={("hysteresis", "damping"): 0.03})
    text = report_html(replace(found, isolability=others)).split("<table class=heat>")[1].split("</table>")[0]
    assert re.findall(r"<span>([^<]*)</span>", text) == ["hysteresis", "preload", "another effect", "none of them"]
