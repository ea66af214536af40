"""diagnosis.json follows schema 2, and a diagnosis shows its probabilities."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reefmu.commands.records.diagnose import diagnosis_text
from reefmu.diagnosis import Diagnosis, Gap, Hypothesis, IsolabilityMatrix, Location, NamedEffect, Value
from reefmu.diagnosis.fitted_values import CrankLosses
from reefmu.diagnosis.hypotheses import effect_probability, likeliest, reported_hypotheses
from reefmu.diagnosis.preprocessing.audit import Audit
from reefmu.diagnosis.report.assemble import insufficient_diagnosis

DOCUMENT = Path(__file__).parents[4] / "docs/reference/diagnosis_json.md"
HYPOTHESES = (
    Hypothesis((), True, 0.03),
    Hypothesis(("preload", "hysteresis"), False, 0.3),
    Hypothesis(("hysteresis",), False, 0.6),
    Hypothesis(("hysteresis",), True, 0.05),
    Hypothesis((), False, 0.012),
    Hypothesis(("creep",), False, 0.0075),
    Hypothesis(("wear",), False, 0.0005),
)
MATRIX = IsolabilityMatrix(("hysteresis", "preload"), ((0.97, 0.0), (0.125, 0.7)))
PLAIN = Diagnosis(
    "ambiguous",
    "Hysteresis, or hysteresis and preload.",
    (NamedEffect("hysteresis", {"torque": Value(4.0, 3.9, 4.1, "N.m")}, 0.9),),
    (("hysteresis", "preload"),),
    (Location("direction", "growing", 0.9),),
    Gap(5.0, 1.0, 0.9, 5.1, 1.1),
    ("hold the drive still",),
    shown_alternatives=(("hysteresis", "preload"),),
)
MADE = PLAIN.with_probabilities(HYPOTHESES, 0.31, MATRIX)


def written(diagnosis: Diagnosis) -> dict[str, Any]:
    return json.loads(diagnosis.to_json())


def read(entry: dict[str, Any]) -> Hypothesis:
    """An entry of `hypotheses` as the documentation explains it."""
    names = entry["effects"]
    return Hypothesis(tuple(names or ()), names is None or entry.get("unnamed", False), entry["probability"])


def test_hypotheses_are_sorted_and_leave_out_a_hundredth_at_most() -> None:
    entries = written(MADE)["hypotheses"]
    chances = [entry["probability"] for entry in entries]
    assert chances == sorted(chances, reverse=True)
    assert sum(chances) == pytest.approx(1, abs=0.01)
    assert [entry["effects"] for entry in entries] == [
        ["hysteresis"],
        ["hysteresis", "preload"],
        ["hysteresis"],
        None,
        [],
    ]


def test_null_is_something_unnamed_alone_and_an_empty_list_is_nothing() -> None:
    assert Hypothesis((), True, 0.5).to_dict() == {"effects": None, "probability": 0.5}
    assert Hypothesis((), False, 0.5).to_dict() == {"effects": [], "probability": 0.5}
    assert Hypothesis(("wear", "creep"), False, 0.5).to_dict() == {"effects": ["creep", "wear"], "probability": 0.5}
    beside = {"effects": ["wear"], "probability": 0.5, "unnamed": True}
    assert Hypothesis(("wear",), True, 0.5).to_dict() == beside


def test_what_is_written_reads_back_as_the_same_hypotheses() -> None:
    found = written(MADE)
    expected = [replace(h, effects=tuple(sorted(h.effects))) for h in MADE.hypotheses[: len(found["hypotheses"])]]
    assert [read(entry) for entry in found["hypotheses"]] == expected
    matrix = found["isolability"]
    assert IsolabilityMatrix(tuple(matrix["names"]), tuple(tuple(row) for row in matrix["matrix"])) == MATRIX
    assert found["global_p"] == 0.31
    assert found == MADE.to_dict()


def test_the_probability_of_an_effect_is_the_sum_over_its_hypotheses() -> None:
    (effect,) = written(MADE)["effects"]
    assert effect["name"] == "hysteresis"
    assert effect["probability"] == pytest.approx(0.6 + 0.3 + 0.05)
    assert effect_probability("preload", HYPOTHESES) == 0.3
    assert effect_probability("damping", HYPOTHESES) == 0


@pytest.mark.parametrize("count", [1, 3, 250, 1668])
@pytest.mark.parametrize("concentration", [0.01, 1.0, 1e4])
def test_any_distribution_is_written_with_a_sum_of_one(count: int, concentration: float) -> None:
    """From one certain hypothesis to all that three of seventeen effects make, equally probable."""
    chances = np.random.default_rng(count).dirichlet(np.full(count, concentration))
    hypotheses = [Hypothesis((f"effect {k}",), False, float(p)) for k, p in enumerate(chances)]
    entries = reported_hypotheses(hypotheses)
    assert sum(entry["probability"] for entry in entries) == pytest.approx(1, abs=0.01 + 1e-12)
    kept = {name for entry in entries for name in entry["effects"]}
    assert sum(h.probability for h in hypotheses if h.effects[0] not in kept) < 0.01 + 1e-3


def test_a_record_without_a_diagnosis_has_no_probabilities() -> None:
    found = written(insufficient_diagnosis(Audit(400, 1, 100.0, 0.0, (), ()), ["the twist never changes"]))
    assert (found["schema"], found["verdict"], found["effects"]) == (1, "insufficient", [])
    assert not {"hypotheses", "global_p", "isolability"} & set(found)


def test_an_effect_without_hypotheses_has_no_probability() -> None:
    """Zero would claim that it is not there."""
    found = written(PLAIN)
    assert found["schema"] == 1
    assert "probability" not in found["effects"][0]


def test_every_key_is_documented_and_every_documented_key_written() -> None:
    section = DOCUMENT.read_text("utf-8")
    keys = re.findall(r"^\| `([^`]+)` \|", section, re.MULTILINE)
    found = written(replace(MADE, losses=CrankLosses({}, {}, (), 0.0, 0.0, 0.0, 4, "cycles")))
    lists = {"hypotheses", "effects", "where"}
    assert [key for key in keys if "." not in key] == [f"{key}[]" if key in lists else key for key in found]
    assert {key.split(".")[1] for key in keys if key.startswith("effects[].")} == set(found["effects"][0])
    beside = next(entry for entry in found["hypotheses"] if "unnamed" in entry)
    assert {key.split(".")[1] for key in keys if key.startswith("hypotheses[].")} == set(beside)
    assert all(f"`{key}`" in section for key in (*found["gap"], *found["remainder"], *found["isolability"]))


def test_the_likeliest_hypotheses_are_few_and_none_is_negligible() -> None:
    assert [h.probability for h in likeliest(HYPOTHESES)] == [0.6, 0.3, 0.05, 0.03]
    flat = [Hypothesis((f"effect {k}",), False, 0.001) for k in range(1000)]
    assert len(likeliest(flat)) == 1
    assert likeliest(()) == ()


def test_repr_and_notebook_table_show_the_probabilities() -> None:
    assert "hysteresis 95 %" in repr(MADE)
    assert "%" not in repr(PLAIN)
    table = MADE._repr_html_()
    assert "<th>hypothesis: hysteresis and preload</th><td>30 %</td>" in table
    assert "<th>hypothesis: something without a name</th><td>3 %</td>" in table
    assert "<th>hysteresis is missing</th><td>95 %</td>" in table


def test_the_plot_shows_probabilities_where_there_are_any() -> None:
    ax = MADE.plot()
    assert [round(bar.get_width(), 6) for bar in ax.patches] == [0.03, 0.05, 0.3, 0.6]  # type: ignore[attr-defined]
    labels = [label.get_text() for label in ax.get_yticklabels()]
    assert labels[::-1][:2] == ["hysteresis", "hysteresis and preload"]
    assert "gap" in PLAIN.plot().get_xlabel()


@pytest.mark.parametrize("with_hypotheses", [True, False])
def test_long_texts_stay_within_the_plot(with_hypotheses: bool) -> None:
    names = ("load_dependent_hysteresis", "structural_compliance", "torque_sensor_offset")
    found = replace(PLAIN, sentence="A sentence of an ambiguous verdict that names many effects. " * 4)
    if with_hypotheses:
        found = found.with_probabilities([Hypothesis(names, True, 0.7), Hypothesis((), False, 0.3)], None, None)
    ax = found.plot()
    figure = ax.get_figure(root=True)
    assert figure is not None
    figure.draw_without_rendering()
    for text in (ax.title, ax._left_title, ax.xaxis.label, *ax.get_yticklabels(), *ax.texts):  # type: ignore[attr-defined]
        box = text.get_window_extent()
        assert box.x0 >= 0, text
        assert box.x1 <= figure.bbox.x1, text
        assert box.y1 <= figure.bbox.y1, text
    assert ax.get_window_extent().width > 0.4 * figure.bbox.width


def test_the_command_line_prints_the_likeliest_hypotheses() -> None:
    lines = diagnosis_text("gear", MADE).splitlines()
    assert lines[0] == "gear: ambiguous: hysteresis"
    assert lines[1:5] == [
        "    60 %  hysteresis",
        "    30 %  hysteresis and preload",
        "     5 %  hysteresis and something without a name",
        "     3 %  something without a name",
    ]
    assert lines[5].startswith("  gap")
    assert diagnosis_text("gear", PLAIN).splitlines()[1].startswith("  gap")


def test_the_command_line_lists_a_few_alternatives() -> None:
    four = tuple((name,) for name in ("creep", "damping", "preload", "wear"))
    assert "  or: hysteresis and preload" in diagnosis_text("gear", PLAIN).splitlines()
    assert (
        "  or: creep, or damping, or preload"
        in diagnosis_text("gear", replace(PLAIN, alternatives=four[:3], shown_alternatives=four[:3])).splitlines()
    )
    found = diagnosis_text("gear", replace(PLAIN, alternatives=(*four, ("wear", "creep")))).splitlines()
    hidden = "4 other sets of effects with one that is too small for this record to show"
    assert f"  or: hysteresis and preload; or {hidden}" in found
    found = diagnosis_text("gear", replace(PLAIN, alternatives=four, shown_alternatives=four)).splitlines()
    assert "  or: creep, or damping, or preload, or one of 1 other" in found
