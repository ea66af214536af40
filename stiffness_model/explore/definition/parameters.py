"""What a study varies: every parameter maps the unit interval onto its values.

A sampler and an optimiser see the unit cube alone. A discrete parameter cuts its interval into equal cells.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...drawing.drive import PARTS
from ...errors import InputError, expect, refuse_unknown, unknown_name
from ...units import format_quantity, parse_quantity

Value = float | int | str

SIZES = (
    "element_radius",
    "element_length",
    "crank_radius",
    "eccentricity",
    *(f"{part}_tolerance" for part in PARTS),
    *(f"{part}_offset" for part in PARTS),
)
COUNTS = ("lobes", "eccentrics", "elements_per_row")
NAMES = ("element", "crank_deviation", *(f"{part}_material" for part in PARTS))
FIELDS = (*SIZES, *COUNTS, *NAMES)
"""What can vary. The transmission ratio follows the lobes, the elements follow the rows (eccentrics)."""
FILL = "fill"
"""As elements_per_row: as many as fit side by side, and no more than |i|."""
_GRADE = re.compile(r"(?:ISO 286 )?IT ?(\d+)")


@dataclass(frozen=True)
class Parameter:
    """One field of the drawing that varies.

    values: all of them in their order, or () for a range from `low` to `high`. quantity: "length" (m), "sigma"
    (multiples of the part's own sigma) or "" (a count or a name).
    """

    name: str
    low: float = 0.0
    high: float = 1.0
    values: tuple[Value, ...] = ()
    quantity: str = ""

    def at(self, position: float) -> Value:
        """The value at a position of the unit interval, as `drive_from_dict` takes it.

        >>> Parameter("lobes", values=(28, 29, 30)).at(0.5), Parameter("crank_radius", 0.04, 0.05).at(0.5)
        (29, 0.045)
        """
        if self.values:
            return self.values[self._cell(position)]
        value = self.low + (self.high - self.low) * position
        return f"{value!r} sigma" if self.quantity == "sigma" else value

    def snap(self, position: float) -> float:
        """The position itself, or the middle of its cell: equal designs have equal positions."""
        return (self._cell(position) + 0.5) / len(self.values) if self.values else position

    def axis_value(self, position: float) -> float:
        """The value on an axis: SI or a count; for names their place in the order."""
        value = self.at(position)
        if self.quantity == "sigma":
            return float(str(value).split()[0])
        return float(self._cell(position)) if isinstance(value, str) else float(value)

    def is_interior(self, position: float) -> bool:
        """Whether the value lies off both ends of its range; of two of names, which have no order, all do."""
        if self.values:
            ordered = len(self.values) > 2 and self.name not in NAMES
            return not ordered or 0 < self._cell(position) < len(self.values) - 1
        return 0.01 < position < 0.99

    @property
    def is_categorical(self) -> bool:
        """Whether the values are texts, which an axis needs ticks for."""
        return bool(self.values) and isinstance(self.values[0], str) and self.quantity != "sigma"

    @property
    def unit(self) -> str:
        """Unit of the stored column; "" for texts."""
        return "" if self.is_categorical else {"length": "m", "sigma": "sigma"}.get(self.quantity, "1")

    def _cell(self, position: float) -> int:
        return min(int(position * len(self.values)), len(self.values) - 1)


def read_parameter(name: str, table: Any, where: str) -> Parameter:
    """A parameter from {from, to}, {from, to, step} or {choices}. Raises `InputError` in one line.

    >>> read_parameter("gear_tolerance", {"from": "IT5", "to": "IT7"}, "study").values
    ('IT5', 'IT6', 'IT7')
    """
    if name not in FIELDS:
        raise unknown_name("parameter", name, FIELDS, where)
    at = f"{where} {name}"
    expect(isinstance(table, Mapping), "a table such as { from = ..., to = ... } or { choices = [...] }", table, at)
    refuse_unknown("key", table, ("from", "to", "step", "choices"), at)
    if "choices" in table:
        expect(len(table) == 1, "choices alone, or from and to", sorted(table), at)
        return _choices(name, table["choices"], at)
    for key in ("from", "to"):
        expect(key in table, f"the key {key!r}", sorted(table), at)
    expect(name not in NAMES, "choices: names have no range", sorted(table), at)
    if name in COUNTS:
        return _whole_range(name, table, at)
    ends = [str(table[key]).strip() for key in ("from", "to")]
    grades = [_GRADE.fullmatch(end) for end in ends]
    if name.endswith("_tolerance") and all(grades):
        first, last = (int(match[1]) for match in grades if match)
        expect("step" not in table, "grades without a step", table.get("step"), at)
        expect(first < last, "from the finer grade to the coarser", f"{ends[0]} to {ends[1]}", at)
        return Parameter(name, values=tuple(f"IT{g}" for g in range(first, last + 1)))
    if name.endswith("_offset") and all(end.endswith("sigma") for end in ends):
        return _range(name, [_sigmas(end, at) for end in ends], table, "sigma", at)
    return _range(name, [read_size(table[key], f"{at}: {key}") for key in ("from", "to")], table, "length", at)


def _choices(name: str, given: Any, at: str) -> Parameter:
    expect(isinstance(given, list) and len(given) > 0, "a list of choices", given, at)
    expect(len({repr(choice) for choice in given}) == len(given), "choices that differ", given, at)
    if name in COUNTS:
        for choice in given:
            if not (name == "elements_per_row" and choice == FILL):
                _whole(choice, at)
        return Parameter(name, values=tuple(given))
    if name in SIZES and not name.endswith(("_tolerance", "_offset")):
        return Parameter(name, values=tuple(read_size(choice, at) for choice in given), quantity="length")
    for choice in given:
        expect(isinstance(choice, str), "a text", choice, at)
    return Parameter(name, values=tuple(given))


def _whole_range(name: str, table: Mapping[str, Any], at: str) -> Parameter:
    low, high, step = (_whole(table.get(key, 1), f"{at}: {key}") for key in ("from", "to", "step"))
    expect(low < high, "from below to", f"{low} to {high}", at)
    return Parameter(name, values=tuple(range(low, high + 1, step)))


def _range(name: str, ends: list[float], table: Mapping[str, Any], quantity: str, at: str) -> Parameter:
    low, high = ends
    expect(low < high, "from below to", f"{table['from']} to {table['to']}", at)
    if "step" not in table:
        return Parameter(name, low, high, quantity=quantity)
    read = _sigmas if quantity == "sigma" else read_size
    step = read(table["step"], f"{at}: step")
    expect(0 < step <= (high - low) * (1 + 1e-9), "a step above zero and within the range", table["step"], at)
    # Through the drawing's text, so that 0.1 mm steps end where a drawing would write them.
    values = [low + k * step for k in range(1 + math.floor((high - low) / step + 1e-9))]
    if quantity == "sigma":
        return Parameter(name, values=tuple(f"{value:.9g} sigma" for value in values), quantity=quantity)
    tidy = [parse_quantity(format_quantity(float(f"{value:.9g}"), "length"), "length", at) for value in values]
    return Parameter(name, values=tuple(tidy), quantity=quantity)


def _whole(value: Any, at: str) -> int:
    expect(
        isinstance(value, int) and not isinstance(value, bool) and value >= 1, "a whole number of at least 1", value, at
    )
    return value


def read_size(value: Any, at: str) -> float:
    """A length of a file, m: with its unit, unless it is zero. Raises `InputError`."""
    if isinstance(value, (int, float)) and value != 0:
        raise InputError(f"{at}: expected a length with its unit, such as '41 mm', got {value!r}")
    number = parse_quantity(value, "length", at)
    expect(math.isfinite(number), "a finite length", value, at)
    return number


def _sigmas(text: Any, at: str) -> float:
    words = str(text).split()
    try:
        number = float(words[0])
    except (ValueError, IndexError):
        number = math.nan
    expect(len(words) == 2 and words[-1] == "sigma" and math.isfinite(number), "a text such as '3 sigma'", text, at)
    return number
