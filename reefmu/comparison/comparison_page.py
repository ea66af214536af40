"""compare.html: states and changes as tables; self-contained, without scripts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from ..diagnosis.report.html.style import STYLE
from .comparison_text import direction_text, estimate_text, probability_up_text
from .loop_quantities import STIFFNESS_LOADS
from .state_changes import StateComparison

DIRECTIONS = """
.up,.down{font-weight:600}.up{color:#b2382a}.down{color:#1f6fb2}.decided{color:#555}td{overflow-wrap:normal}
"""
"""Style of the directions of changes and of names, which do not break, beside that of the reports."""
METHOD = (
    "Values are posterior medians with 95 % intervals. Play is what is lost to either side, between straight lines "
    "through both flanks of the mean of both directions. Friction is half the width of the loop at small load; its "
    "load-dependent part is its growth over the load. Positions of one state scatter about the state's mean with a "
    "variance that all states inform; probabilities are not corrected for the number of pairs and quantities."
)


def comparison_html(comparison: StateComparison) -> str:
    """The page as HTML."""
    loads = ", ".join(f"{name} at {share * comparison.load:.3g} N.m" for name, share in STIFFNESS_LOADS.items())
    quantities = list(comparison.basis)
    states = [
        [state.name, str(state.positions), str(state.cycles), *(estimate_text(state.values[q]) for q in quantities)]
        for state in comparison.states
    ]
    changes = [
        [
            change.start,
            change.end,
            change.quantity,
            direction_text(comparison, change),
            estimate_text(change.difference, signed=True),
            probability_up_text(change.probability_up),
        ]
        for change in comparison.changes
    ]
    notes = "".join(f"<li>{escape(note)}</li>" for note in comparison.notes)
    heads = ["from", "to", "quantity", "direction", "difference", "probability of up"]
    return (
        "<!doctype html><html lang=en><head><meta charset=utf-8><meta name=viewport content='width=device-width'>"
        f"<title>Comparison</title><style>{STYLE}{DIRECTIONS}</style></head><body>"
        "<h1>What changed between the states</h1>"
        f"{f'<ul>{notes}</ul>' if notes else ''}"
        f"<h2>Changes</h2>{_table(heads, changes)}"
        f"<h2>States</h2>{_table(['state', 'positions', 'cycles', *quantities], states)}"
        f"<h2>Method</h2><p>{escape(METHOD)} Common load {comparison.load:.3g} N.m: {escape(loads)}.</p>"
        "</body></html>\n"
    )


def _style(cell: str) -> str:
    """Class of a cell, by the direction that it states."""
    if cell == "not decided":
        return "decided"
    return next((sign for sign in ("up", "down") if cell in (sign, f"{sign} at this position")), "")


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of texts, which are escaped; directions of changes are coloured."""
    top = "".join(f"<th>{escape(cell)}</th>" for cell in head)
    body = "".join(
        "<tr>" + "".join(f"<td class='{_style(cell)}'>{escape(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<div class=table><table><tr>{top}</tr>{body}</table></div>"
