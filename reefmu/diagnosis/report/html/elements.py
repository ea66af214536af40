"""Parts of a page: tables, lists, figures and the section on losses, as HTML."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from stiffness_model.units import interval_text, quantity_text

from ....effects import find_effect
from ...fitted_values import AmplitudeTest, CrankLosses, Value
from ...schema import Location
from ..text import efficiency_text
from .next_commands import NextCommand

MAX_RECORDS = 3
"""Records that the heading lists at most, for a reader's sake."""
SENSORS = {
    "offset": "Motor's torque less that at the output over the ratio, in both directions of motion",
    "scale": "Motor's torque over that at the output, in both directions of power",
}
"""What the sensors' values mean."""


def figure(picture: str, caption: str) -> str:
    """A picture, as HTML, over its caption, as HTML."""
    return f"<figure>{picture}<figcaption>{caption}</figcaption></figure>"


def breakable(name: str) -> str:
    """A name, escaped, that may break after an underscore where a column is narrow."""
    return escape(name).replace("_", "_<wbr>")


def bulleted(lines: Iterable[str]) -> str:
    """A list of lines, which are escaped."""
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>"


def explanation(text: str) -> str:
    """A sentence on quantities beside it, which is escaped."""
    return f"<p class=explain>{escape(text)}</p>"


def section_list(title: str, lines: Iterable[str]) -> list[str]:
    """A heading and a list of lines, which are escaped; nothing where there are no lines."""
    lines = list(lines)
    return [f"<h2>{title}</h2>{bulleted(lines)}"] if lines else []


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of cells that are HTML, which scrolls sideways where the window is too narrow."""
    top = "".join(f"<th>{h}</th>" for h in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<div class=table><table><tr>{top}</tr>{body}</table></div>"


def origin_line(rows: Sequence[tuple[str, str]]) -> str:
    """Date, version, command and files of a report, by name and text, which is escaped; many records are folded."""
    records = [text for name, text in rows if name == "record"]
    folded = len(records) > MAX_RECORDS
    parts = [
        f"<span><strong>{escape(name)}</strong> <{tag}>{escape(text)}</{tag}></span>"
        for name, text, tag in ((name, text, "code" if name == "command" else "span") for name, text in rows)
        if not (folded and name == "record")
    ]
    more = f"<details class=origin><summary>{len(records)} records</summary>{bulleted(records)}</details>"
    return f"<p class=origin>{' '.join(parts)}</p>{more if folded else ''}"


def command_list(title: str, commands: Iterable[NextCommand]) -> str:
    """A heading and commands to type, each with its purpose; nothing where there are none."""
    items = "".join(
        f"<li><code class=command>{escape(step.command)}</code><br><span class=small>{escape(step.purpose)}</span></li>"
        for step in commands
    )
    return f"<h2>{title}</h2><ul class=steps>{items}</ul>" if items else ""


def amplitude_table(tests: Sequence[AmplitudeTest]) -> str:
    """A row for each amplitude of every test."""
    return table(
        ["effect", "amplitude", "size", "95 % interval", "p"],
        [
            [
                breakable(f"{test.effect}.{test.parameter}"),
                f"{size.amplitude:.3g} N.m",
                quantity_text(size.value, test.unit),
                interval_text(size.low, size.high, test.unit),
                f"{test.p:.2g}",
            ]
            for test in tests
            for size in test.sizes
        ],
    )


def caution_box(lines: Sequence[str]) -> str:
    """What a reader must know before relying on the numbers; empty without lines."""
    items = "".join(f"<li>{escape(line)}</li>" for line in lines)
    return f"<div class=caution><b>Caution</b><ul>{items}</ul></div>" if lines else ""


def losses_card(losses: CrankLosses) -> tuple[str, list[str]]:
    """Title and lines of friction at the crank on the first screen."""
    lines = [
        f"<p>{name} {quantity_text(value.value, value.unit)} "
        f"(95 %: {interval_text(value.low, value.high, value.unit)})</p>"
        for name, value in losses.parameters.items()
    ]
    lines += [f"<p>{escape(efficiency_text(at))}</p>" for at in losses.efficiencies[-1:]]
    return "Friction at the crank, from both torques", lines


def losses_section(losses: CrankLosses) -> list[str]:
    """Friction at the crank: heading, parameters, efficiencies, and what the intervals count."""
    effect = find_effect("crank_friction")
    descriptions = {p.name: p.description for p in effect.parameters} | SENSORS
    rows = [
        [f"{breakable(name)}<br><span class=small>{escape(descriptions[name])}</span>", *_cells(value)]
        for name, value in (losses.parameters | losses.sensors).items()
    ]
    efficiencies = [
        [
            quantity_text(at.load, "N.m"),
            f"{at.speed:.3g} rad/s",
            _efficiency(at.driving),
            _efficiency(at.driven_back) if at.driven_back.value > 0 else "locked against the output",
        ]
        for at in losses.efficiencies
    ]
    counted = (
        "From the torques of crank and output, and so whatever the base curve. Intervals are 95 % and count what "
        f"{losses.replicates} {losses.kind} differ by. At the crank the motor's torque exceeds that of the output by "
        f"{losses.before:.3g} N.m rms; this friction leaves {losses.after:.3g} N.m of it."
    )
    return [
        f"<h2>{escape(effect.title)} <span class=small>(crank_friction)</span></h2>",
        table(["parameter", "value", "95 % interval"], rows),
        table(["load at the output", "crank speed", "efficiency, crank driving", "driven back"], efficiencies)
        if efficiencies
        else "",
        explanation(" ".join([counted, *(f"{text[0].upper()}{text[1:]}." for text in losses.assumptions)])),
    ]


def _cells(value: Value) -> list[str]:
    return [quantity_text(value.value, value.unit), interval_text(value.low, value.high, value.unit)]


def _efficiency(value: Value) -> str:
    return f"{100 * value.value:.1f} % ({100 * value.low:.1f} ... {100 * value.high:.1f} %)"


def locations_table(locations: Sequence[Location]) -> str:
    """A row for each coordinate over which a gap varies."""
    return table(
        ["coordinate", "strongest at", "share of the gap"],
        [[p.coordinate.replace("_", " "), escape(p.region), f"{100 * p.share:.0f} %"] for p in locations],
    )
