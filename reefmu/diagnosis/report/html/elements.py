"""Parts of a page: tables, lists and figures as HTML."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape


def figure(picture: str, caption: str) -> str:
    """A picture, as HTML, over its caption, as HTML."""
    return f"<figure>{picture}<figcaption>{caption}</figcaption></figure>"


def bulleted(lines: Iterable[str]) -> str:
    """A list of lines, which are escaped."""
    return f"<ul>{''.join(f'<li>{escape(line)}</li>' for line in lines)}</ul>"


def section_list(title: str, lines: Iterable[str]) -> list[str]:
    """A heading and a list of lines, which are escaped; nothing where there are no lines."""
    lines = list(lines)
    return [f"<h2>{title}</h2>{bulleted(lines)}"] if lines else []


def table(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """A table of cells that are HTML, which scrolls sideways where the window is too narrow."""
    top = "".join(f"<th>{h}</th>" for h in head)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>" for row in rows)
    return f"<div class=table><table><tr>{top}</tr>{body}</table></div>"
