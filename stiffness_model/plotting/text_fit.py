"""Texts that fit: their width before a picture is drawn, lines that break where the room ends, columns of a legend."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache

HANDLE_WIDTH = 2.8 + 0.8 + 1.6
"""Width of a legend's entry beside its text, in font sizes: handle, gap behind it, gap between the columns, as in
`style.legend_above`."""
POINTS_PER_INCH = 72.0


@lru_cache(maxsize=512)
def text_width(text: str, size: str = "medium") -> float:
    """Width of one line of text in inches, in the font of the pictures; size: a size of matplotlib such as "small"."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import text_to_path

    if not text.strip():
        return 0.0
    # The measure by which the picture is drawn; the extents of the outlines take twenty times as long.
    width, _, _ = text_to_path.get_text_width_height_descent(text, FontProperties(size=size), ismath=False)
    return float(width) / POINTS_PER_INCH


def fit_text(text: str, width: float, size: str = "medium") -> str:
    """The text with line breaks between words where a line would be wider than `width`, inches.

    Line breaks of the text remain. A word that is wider than a line stays whole.

    >>> fit_text("one two three", 0.7)
    'one two\\nthree'
    """
    return "\n".join(_broken(line, width, size) for line in text.split("\n"))


def _broken(line: str, width: float, size: str) -> str:
    lines: list[str] = []
    for word in line.split():
        if lines and text_width(f"{lines[-1]} {word}", size) <= width:
            lines[-1] += f" {word}"
        else:
            lines.append(word)
    return "\n".join(lines)


def legend_columns(names: Sequence[str], width: float, size: str = "medium", most: int = 3) -> int:
    """The number of columns, at most `most`, with which the entries of a legend stay within `width`, inches."""
    handle = HANDLE_WIDTH * text_width("M", size)
    # A legend fills its columns from top to bottom.
    for columns in range(min(most, len(names)), 1, -1):
        rows = -(-len(names) // columns)
        widest = [max(_widest(name, size) for name in names[k : k + rows]) for k in range(0, len(names), rows)]
        if sum(entry + handle for entry in widest) <= width:
            return columns
    return 1


def _widest(name: str, size: str) -> float:
    return max(text_width(line, size) for line in name.split("\n"))
