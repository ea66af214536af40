"""The table in a text: comments, preamble, separator, header, a row of units, and rows of fields."""

from __future__ import annotations

import csv
import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from stiffness_model.errors import InputError, expect

from .number_format import is_number

SEPARATORS = {"\t": "tab", ";": "semicolon", "|": "vertical bar", ",": "comma", " ": "spaces"}
"""Separators in the order in which they are tried; the comma late, because it may be a decimal mark."""
SAMPLE_ROWS = 200
"""Rows from which the separator is found. Chosen by judgement, far more than a preamble has."""
MAX_TITLE = 200
"""Characters of a title. Chosen by judgement, to refuse text that is no table."""
NO_UNIT = ("-", "--", "1")
"""What a row of units holds for a column without a unit."""
_COMMENT = ("#", "%", "//")
_TOKEN = re.compile(r"\S+(?:\s*(?:\[[^\]]*\]|\([^)]*\)))?")
"""A field between spaces, with the unit that may follow it."""
Row = tuple[int, list[str]]
"""Line number and fields."""


@dataclass(frozen=True)
class Table:
    """titles, units: (k,) of the columns, units "" where no row states them; rows: n rows of k fields; lines: (n,)
    line numbers; separator: one of `SEPARATORS`; skipped: lines before the header; has_units_row: whether a row below
    the header holds units; header_in_comment: whether the header is a comment, as numpy.savetxt writes it."""

    titles: list[str]
    units: list[str]
    rows: list[list[str]]
    lines: list[int]
    separator: str
    skipped: int
    has_units_row: bool
    header_in_comment: bool

    def column(self, index: int) -> list[str]:
        """The n fields of one column."""
        return [row[index] for row in self.rows]


def find_table(text: str, where: str, separator: str | None = None) -> Table:
    """The table in a text.

    separator: one of `SEPARATORS`; found from the rows if None. Raises `InputError` for a text without a header and two
    rows, for rows of different lengths, and where a comma both separates columns and marks decimals.
    """
    lines = text.replace("\r\n", "\n").replace("\r", "\n").split("\n")
    if stated := re.fullmatch(r"sep=(.)", lines[0].strip('\ufeff" ')):
        separator, lines[0] = separator or stated[1], ""
    comments = {k: line for k, line in enumerate(lines, 1) if line.lstrip().startswith(_COMMENT)}
    content = ["" if k in comments else line for k, line in enumerate(lines, 1)]
    separator = separator or _find_separator([line for line in content if line.strip()])
    expect(separator in SEPARATORS, "a separator among " + " ".join(map(repr, SEPARATORS)), separator, where)
    rows = _without_empty_end(_split(content, separator, where))
    width = Counter(len(fields) for _, fields in rows).most_common(1)[0][0] if rows else 0
    head = _first_row(rows, width)
    titles, first, in_comment = _header(rows, head, comments, separator, where)
    # A title of several lines is one of several words.
    titles = [" ".join(title.split()) for title in titles]
    longest = max(titles, key=len)
    expect(len(longest) <= MAX_TITLE, f"titles of at most {MAX_TITLE} characters", longest[:40] + "...", where)
    skipped = (rows[head][0] - 1 if rows else 0) - in_comment
    units = [""] * len(titles)
    data = rows[first:]
    if data and _is_units_row(data[0][1], len(titles)):
        units, data = [_bare_unit(field) for field in data[0][1]], data[1:]
    expect(len(data) >= 2, "a header and at least two rows of numbers", f"{len(data) + 1} rows", where)
    _check_widths(data, len(titles), separator, where)
    return Table(
        titles,
        units,
        [fields for _, fields in data],
        [line for line, _ in data],
        separator,
        skipped,
        any(units),
        in_comment,
    )


def _split(lines: Sequence[str], separator: str, where: str) -> list[Row]:
    """Rows with at least one field that is not empty."""
    if separator == " ":
        return [(k, _TOKEN.findall(line)) for k, line in enumerate(lines, 1) if line.strip()]
    try:
        reader = csv.reader((line + "\n" for line in lines), delimiter=separator, skipinitialspace=True)
        rows = [(reader.line_num, [field.strip() for field in row]) for row in reader]
    except csv.Error as error:
        raise InputError(f"{where}: expected a readable CSV file, got {error}") from None
    return [row for row in rows if any(row[1])]


def _find_separator(lines: Sequence[str]) -> str:
    sample = lines[:SAMPLE_ROWS]
    for separator in (s for s in SEPARATORS if s != " "):
        try:
            counts = Counter(len(row) for row in csv.reader(sample, delimiter=separator, skipinitialspace=True))
        except csv.Error:
            continue
        width, rows = counts.most_common(1)[0] if counts else (1, 0)
        if width >= 2 and 2 * rows >= len(sample):
            if separator == "," and _is_spaced(sample[-1]):
                return " "
            return separator
    return " " if sample and _is_spaced(sample[-1]) else ","


def _is_spaced(line: str) -> bool:
    """Whether a line consists of numbers between spaces, which may have decimal commas."""
    fields = line.split()
    return len(fields) >= 2 and all(is_number(field) for field in fields) and not line.rstrip().endswith(",")


def _without_empty_end(rows: list[Row]) -> list[Row]:
    """Rows without the empty last field of files whose lines end with a separator."""
    width = max((len(fields) for _, fields in rows), default=0)
    if width < 2 or any(len(fields) == width and fields[-1] for _, fields in rows):
        return rows
    return [(line, fields[:-1] if len(fields) == width else fields) for line, fields in rows]


def _first_row(rows: list[Row], width: int) -> int:
    """Index of the row of titles, or of numbers where none stands above them.

    Spreadsheets fill the lines above a table to its width with empty fields.
    """
    wide = [k for k, (_, fields) in enumerate(rows) if len(fields) >= width]
    first_numbers = next((k for k in wide if is_number(rows[k][1][0])), len(rows))
    full = [k for k in wide if k < first_numbers and rows[k][1][-1]]
    return next(iter(full or wide), 0)


def _header(
    rows: list[Row], head: int, comments: dict[int, str], separator: str, where: str
) -> tuple[list[str], int, bool]:
    """Titles, index of the first row below them, and whether they stand in a comment."""
    expect(bool(rows), "a header and at least two rows of numbers", "0 rows", where)
    line, fields = rows[head]
    if not all(is_number(field) for field in fields):
        return fields, head + 1, False
    before = [k for k in comments if k < line]
    if before:
        title_line = comments[before[-1]].lstrip().lstrip("#%/ ")
        titles = _split([title_line], separator, where)
        if titles and len(titles[0][1]) == len(fields):
            return titles[0][1], head, True
    if head > 0 and separator == ",":
        raise _two_commas(len(rows[head - 1][1]), len(fields), line, where)
    raise InputError(
        f"{where}: expected a header row of `name [unit]` above the numbers, got {', '.join(fields[:3])} in line {line}"
    )


def _check_widths(data: list[Row], width: int, separator: str, where: str) -> None:
    for line, fields in data:
        if len(fields) != width:
            longer = sum(len(f) > width for _, f in data)
            if separator == "," and 2 * longer > len(data):
                raise _two_commas(width, len(fields), line, where)
            raise InputError(
                f"{where}: expected {width} values in every row, got {len(fields)} in line {line}; complete it or "
                "remove the row"
            )


def _two_commas(titles: int, fields: int, line: int, where: str) -> InputError:
    return InputError(
        f"{where}: expected {titles} values in every row, got {fields} in line {line}: a comma that separates columns "
        "and marks decimals is ambiguous; export with semicolons between columns, or with decimal points"
    )


def _is_units_row(fields: Sequence[str], width: int) -> bool:
    """Whether fields are units: texts, of which those that are numbers say that a column has no unit."""
    texts = [field for field in fields if field and _bare_unit(field)]
    return len(fields) == width and bool(texts) and not any(is_number(text) for text in texts)


def _bare_unit(field: str) -> str:
    """A unit without the brackets of some files; "" for those that say that there is none.

    >>> [_bare_unit(field) for field in ("[N.m]", "(s)", "[-]", "1", "deg")]
    ['N.m', 's', '', '', 'deg']
    """
    text = field.strip()
    text = text[1:-1].strip() if text[:1] + text[-1:] in ("[]", "()") else text
    return "" if text in NO_UNIT else text
