"""Parts of a page: tables, lists and figures as HTML."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from stiffness_model.units import interval_text, quantity_text

from ...fitted_values import AmplitudeTest
from .next_commands import NextCommand

MAX_RECORDS = 3
"""Records that the heading lists at most, for a reader's sake."""


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
