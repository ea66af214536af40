"""compare.html: states and changes as tables; self-contained."""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Sequence
from html import escape

from ..diagnosis.report.html.elements import breakable, command_list, explanation, origin_line
from ..diagnosis.report.html.next_commands import NextCommand
from ..diagnosis.report.html.origin import Origin, command_text, origin_rows, with_options
from ..diagnosis.report.html.script import SCRIPT
from ..diagnosis.report.html.style import STYLE
from .comparison_text import direction_text, estimate_text, probability_up_text
from .loop_quantities import STIFFNESS_LOADS
from .state_changes import StateComparison

DIRECTIONS = """
.up,.down{font-weight:600}.up{color:#b2382a}.down{color:#1f6fb2}.decided{color:#555}td{overflow-wrap:normal}
"""
"""Style of the directions of changes and of names, which do not break, beside that of the reports."""
FILTER = """
{ const place = document.querySelector('.filter'), box = document.createElement('input'),
    label = document.createElement('label');
  box.type = 'checkbox'; label.append(box, ' only changes with a direction'); place.append(label);
  place.className = 'filter layers';
  box.onchange = () => document.querySelectorAll('td.decided').forEach(
    cell => { cell.parentNode.hidden = box.checked; });
}
"""
"""Script that hides the changes without a direction."""
CHANGE_MEANING = (
    "Difference: of the second state minus the first, with its 95 % interval. Probability of up: that the quantity is "
    "larger in the second state. A direction is stated where the interval excludes zero; 'at this position' where the "
    "interval counts cycles alone and another position may differ as much."
)
METHOD = (
    "Values are posterior medians with 95 % intervals. Play is what is lost to either side, between straight lines "
    "through both flanks of the mean of both directions. Friction is half the width of the loop at small load; its "
    "load-dependent part is its growth over the load. Friction at the crank is the same of what the motor's torque "
    "exceeds that of the output by, where both were measured. Positions of one state scatter about the state's mean "
    "with a variance that all states inform; probabilities are not corrected for the number of pairs and quantities."
)


def comparison_html(comparison: StateComparison, origin: Origin | None = None, records: Sequence[str] = ()) -> str:
    """The page as HTML. origin: what the caller knows of the command; records: paths of the records."""
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
        f"{origin_line(origin_rows(origin or Origin(), records))}"
        f"{f'<ul>{notes}</ul>' if notes else ''}"
        f"<h2>Changes</h2><div class=filter></div>{_table(heads, changes)}{explanation(CHANGE_MEANING)}"
        f"{command_list('What to do next', _next_commands(comparison, origin or Origin()))}"
        f"<h2>States</h2>{_table(['state', 'positions', 'cycles', *quantities], states)}"
        f"<h2>Method</h2><p>{escape(METHOD)} Common load {comparison.load:.3g} N.m: {escape(loads)}.</p>"
        f"<script>{SCRIPT}{FILTER}</script></body></html>\n"
    )


def _next_commands(comparison: StateComparison, origin: Origin) -> list[NextCommand]:
    """What one state is like, and positions where a change does not count them; with the drive of the command, whose
    ratio these records may need."""
    drive = f"--drive {command_text(shlex.quote(origin.base))}" if origin.base else ""
    last = comparison.states[-1].name
    diagnose = with_options(f"reefmu diagnose RECORD.csv {drive or '--power-law'}", origin.reading)
    found = [NextCommand(f"which effects the state {last} shows, from one of its records", f"{diagnose} --out found")]
    if "cycles" in comparison.basis.values():
        words = shlex.join(f"{state.name}={state.name}_*.csv" for state in comparison.states)
        again = with_options(f"reefmu diagnose {words} --compare{f' {drive}' if drive else ''}", origin.reading)
        found.append(
            NextCommand(
                "the same comparison with records at several positions of every state, which tells a change of the "
                "drive from a difference between positions",
                f"{again} --out changed",
            )
        )
    return found


def _style(cell: str) -> str:
    """Class of a cell, by the direction that it states."""
    if cell == "not decided":
        return "decided"
    return next((sign for sign in ("up", "down") if cell in (sign, f"{sign} at this position")), "")


def _table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of texts, which are escaped; directions of changes are coloured."""
    top = "".join(f"<th>{breakable(cell)}</th>" for cell in head)
    body = "".join(
        "<tr>" + "".join(f"<td class='{_style(cell)}'>{breakable(cell)}</td>" for cell in row) + "</tr>" for row in rows
    )
    return f"<div class=table><table><tr>{top}</tr>{body}</table></div>"
