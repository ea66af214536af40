"""Tables of plain text."""

from __future__ import annotations

from collections.abc import Sequence


def aligned_table(heads: Sequence[str], units: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Columns aligned to the right under a line of names and a line of units.

    >>> print(aligned_table(["twist", "mean"], ["[arcmin]", "[N.m]"], [["0.0", "1.25"], ["10.0", "3.50"]]))
         twist   mean
      [arcmin]  [N.m]
           0.0   1.25
          10.0   3.50
    """
    lines = [heads, units, *rows]
    widths = [max(len(line[k]) for line in lines) for k in range(len(heads))]
    return "\n".join(
        "  " + "  ".join(text.rjust(width) for text, width in zip(line, widths, strict=True)) for line in lines
    )
