"""Numbers as files write them: decimal point or comma, thousands separators, signs."""

from __future__ import annotations

import re
from collections.abc import Sequence

import numpy as np

from stiffness_model.errors import InputError
from stiffness_model.numerics.arrays import Array

_EXPONENT = r"(?:[eE][+-]?\d+)?"
_READINGS = {
    ".": re.compile(rf"[+-]?(?:[1-9]\d{{0,2}}(?:,\d{{3}})+|\d+)?(?:\.\d*)?{_EXPONENT}"),
    ",": re.compile(rf"[+-]?(?:[1-9]\d{{0,2}}(?:\.\d{{3}})+|\d+)?(?:,\d*)?{_EXPONENT}"),
}
"""A number by its decimal mark; the other mark may group its thousands."""
_NUMBER = re.compile(rf"[+-]?(?:\d[\d.,]*|[.,]\d+){_EXPONENT}|[+-]?(?:nan|inf|infinity)", re.IGNORECASE)
MAX_SHOWN = 60
"""Characters of a text that a message shows. Chosen by judgement."""
_CLOCK = re.compile(r".*\d:\d\d.*|\d{4}-\d\d-\d\d.*|\d\d?\.\d\d?\.\d{4}.*")


def is_number(text: str) -> bool:
    """Whether a text is a number in any of the ways of writing.

    >>> is_number("-1,5e3"), is_number(".5"), is_number("nan"), is_number("N.m")
    (True, True, True, False)
    """
    return _NUMBER.fullmatch(_plain(text)) is not None


def decimal_mark(columns: Sequence[Sequence[str]], where: str) -> str:
    """The decimal mark of columns of numbers, "." or ",".

    Raises `InputError` where the columns allow both, such as "1,234", or mix them.

    >>> decimal_mark([["0", "0,5"], ["1,234", "2,345"]], "record.csv")
    ','
    >>> decimal_mark([["1,234", "2,345"]], "record.csv")
    Traceback (most recent call last):
    ...
    stiffness_model.errors.InputError: record.csv: expected numbers with one decimal mark, got '1,234', which may be \
1.234 or 1234; state which with decimal = "," or decimal = "." in the file of --columns
    """
    # Texts that are no numbers, such as times of day, say nothing; `parse_numbers` refuses them.
    numbers = [text for column in columns for text in column if ("," in text or "." in text) and is_number(text)]
    with_comma = [text for text in numbers if "," in text]
    if not with_comma:
        return "."
    doubtful = with_comma + [text for text in numbers if "," not in text]
    fits = [mark for mark, pattern in _READINGS.items() if all(pattern.fullmatch(_plain(t)) for t in doubtful)]
    if len(fits) == 1:
        return fits[0]
    if fits:
        text = _plain(with_comma[0])[:MAX_SHOWN]
        raise InputError(
            f"{where}: expected numbers with one decimal mark, got {text!r}, which may be {text.replace(',', '.')} or "
            f'{text.replace(",", "")}; state which with decimal = "," or decimal = "." in the file of --columns'
        )
    other = next((text for text in doubtful if not _READINGS[","].fullmatch(_plain(text))), doubtful[-1])
    both = " and ".join(repr(text[:MAX_SHOWN]) for text in (with_comma[0], other))
    raise InputError(f"{where}: expected numbers with one decimal mark, got {both}; write all with decimal points")


def parse_numbers(texts: Sequence[str], mark: str, column: str, lines: Sequence[int], where: str) -> Array:
    """The numbers (n,) of a column of texts with a decimal mark.

    lines: (n,) line numbers in the file, for errors. Raises `InputError` for the first text that is no number.
    """
    try:
        everything = "".join(texts)
        plain = mark == "." and "," not in everything and "−" not in everything
        return np.array(texts if plain else _rewritten(texts, mark), dtype=float)
    except ValueError:
        pass
    rewritten = _rewritten(texts, mark)
    bad = next(k for k, text in enumerate(rewritten) if not _is_float(text))
    text, line = rewritten[bad][:MAX_SHOWN], lines[bad]
    if not text.strip():
        raise InputError(
            f"{where}: expected numbers in column {column!r}, got an empty field in line {line}; fill it or remove "
            "the row"
        )
    is_clock = _CLOCK.fullmatch(text)
    remedy = "; write the time in seconds from a start" if is_clock else "; correct it or remove the row"
    raise InputError(f"{where}: expected numbers in column {column!r}, got {text!r} in line {line}{remedy}")


def _is_float(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _rewritten(texts: Sequence[str], mark: str) -> list[str]:
    group = "," if mark == "." else "."
    # Text that is no number stays as it is, for the message that shows it.
    return [
        _plain(text).replace(group, "").replace(mark, ".") if _READINGS[mark].fullmatch(_plain(text)) else text
        for text in texts
    ]


def _plain(text: str) -> str:
    return text.strip().replace("−", "-")
