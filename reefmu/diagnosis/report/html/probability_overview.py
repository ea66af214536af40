"""The first part of the page: probabilities of the hypotheses, what the record tells apart, what would change the
verdict.

Bars and heat map are HTML, not SVG: their text keeps its size on a phone and can be selected.
"""

from __future__ import annotations

from html import escape

from ...hypotheses import hypothesis_text, likeliest, probability_text
from ...schema import Diagnosis, IsolabilityMatrix
from ..rivals import is_reported, relevant_effects, rivals
from ..text import CALIBRATION, POOR_FIT, global_p_text
from .elements import bulleted

MAX_BARS = 6
"""Hypotheses with a bar of their own at most, for a reader's sake."""
RIGHT, WRONG, NOT_NAMED = (31, 111, 178), (194, 69, 45), (110, 110, 110)
"""Colours, RGB, of cells: the effect that is missing is named; another one is; none is."""
WHITE_TEXT = 0.85
"""Share of the full colour above which white text has more contrast than the page's dark grey (WCAG 2.2, relative
luminance of the three colours)."""


def probability_overview(diagnosis: Diagnosis) -> str:
    """Bars of the hypotheses with the p-value of the chosen model, the note on calibration and what would change the
    verdict, beside the isolability matrix; empty where no hypotheses were compared."""
    if not diagnosis.hypotheses:
        return ""
    return (
        "<div class=overview><section><h2>Probability of each explanation</h2>"
        f"{_bars(diagnosis)}{_notes(diagnosis)}</section>{_changes(diagnosis)}{_isolability(diagnosis)}</div>"
    )


def _bars(diagnosis: Diagnosis) -> str:
    shown = likeliest(diagnosis.hypotheses, MAX_BARS)
    rows = [(hypothesis_text(h), h.probability, is_reported(diagnosis, h)) for h in shown]
    others = sum(h.probability for h in diagnosis.hypotheses) - sum(h.probability for h in shown)
    if others >= 0.005:
        rows.append((f"{len(diagnosis.hypotheses) - len(shown)} others together", others, False))
    bars = "".join(
        f"<li{' class=said' if said else ''}><span>{escape(label)}</span>"
        f"<span class=track><span style='width:{100 * p:.1f}%'></span></span><b>{escape(probability_text(p))}</b></li>"
        for label, p, said in rows
    )
    return f"<ul class=bars>{bars}</ul>"


def _notes(diagnosis: Diagnosis) -> str:
    p = diagnosis.global_p
    fit = "" if p is None else f"<p{' class=warn' if p < POOR_FIT else ''}>{escape(global_p_text(p))}</p>"
    return f"{fit}<p class=small>Dark bars are what the verdict covers. {escape(CALIBRATION)}</p>"


def _isolability(diagnosis: Diagnosis) -> str:
    names = relevant_effects(diagnosis)
    if diagnosis.isolability is None or not names:
        return ""
    return (
        f"<section><h2>What this record tells apart</h2>{_heat_map(diagnosis.isolability, names)}"
        "<p class=small>Probability, in percent, at most, that a record like this one names the effect of the column "
        "if the effect of the row is missing at its typical size.</p></section>"
    )


def _heat_map(isolability: IsolabilityMatrix, names: tuple[str, ...]) -> str:
    index = [isolability.names.index(name) for name in names]
    rows = [isolability.matrix[k] for k in index]
    columns = {name.replace("_", " "): [row[k] for row in rows] for name, k in zip(names, index, strict=True)}
    elsewhere = [sum(row) - sum(row[k] for k in index) for row in rows]
    if max(elsewhere) >= 0.005:
        columns["another effect"] = elsewhere
    columns["none of them"] = [max(0.0, 1 - sum(row)) for row in rows]
    head = "".join(f"<th scope=col><span>{escape(label)}</span></th>" for label in columns)
    body = ""
    for i, name in enumerate(names):
        cells = ""
        for j, label in enumerate(columns):
            colour = RIGHT if i == j else NOT_NAMED if label == "none of them" else WRONG
            cells += _cell(columns[label][i], colour)
        body += f"<tr><th scope=row>{escape(name.replace('_', ' '))}</th>{cells}</tr>"
    return f"<div class=table><table class=heat><tr><td></td>{head}</tr>{body}</table></div>"


def _cell(probability: float, colour: tuple[int, int, int]) -> str:
    percent = round(100 * probability)
    if percent < 1:
        return "<td class=zero>0</td>"
    share = min(probability, 1.0)
    red, green, blue = (round(255 + share * (full - 255)) for full in colour)
    text = ";color:#fff" if share > WHITE_TEXT else ""
    return f"<td style='background:rgb({red},{green},{blue}){text}'>{percent}</td>"


def _changes(diagnosis: Diagnosis) -> str:
    """The next experiments, whose records would make other explanations more or less likely than the bars show."""
    content = "" if rivals(diagnosis) else "<p>No other explanation reaches a probability of 1 %.</p>"
    if diagnosis.next_experiment:
        content += f"<p>What to measure next:</p>{bulleted(diagnosis.next_experiment)}"
    return f"<section><h2>What would change the verdict</h2>{content}</section>" if content else ""
