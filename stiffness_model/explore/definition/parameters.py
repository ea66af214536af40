"""The parameters of a study: each maps the unit interval onto values of a field of the drawing.

A sampler and an optimiser see only the unit cube. A discrete parameter divides its interval into equal cells.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...drawing import drive
from ...drawing.fields import COUNT, OFFSET, TOLERANCE, Field
from ...errors import InputError, expect, refuse_unknown, unknown_name
from ...frozen_mapping import FrozenMapping
from ...units import UNITS, format_quantity, parse_quantity, si_unit

Value = float | int | str

ELEMENTS_PER_ROW = Field(
    COUNT, "geometry", "Rolling elements on each eccentric, or as many as fit.", "fill", name="elements_per_row"
)
"""Takes the place of the drawing's `elements`, which are those of all rows together."""
FIELDS: Mapping[str, Field] = FrozenMapping(
    {
        **{name: field for name, field in drive.FIELDS.items() if field.varies},
        ELEMENTS_PER_ROW.name: ELEMENTS_PER_ROW,
    }
)
"""Fields that a study may vary. The transmission ratio follows from the lobes, `elements` from the eccentrics."""
FILL = "fill"
"""As elements_per_row: as many as fit (`design.Packing`), at most |i|."""
SIGMA = "sigma"
"""Quantity of an offset in multiples of the part's standard deviation."""
_GRADE = re.compile(r"(?:ISO 286 )?IT ?(\d+)")


@dataclass(frozen=True)
class Parameter:
    """One field of the drawing that varies.

    values: of a discrete parameter, in their order, or () for a range from `low` to `high`. quantity: of `units.UNITS`
    (SI values), `SIGMA` (multiples of the part's own sigma) or "" (a count or a name).
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
        return f"{value!r} sigma" if self.quantity == SIGMA else value

    def snap(self, position: float) -> float:
        """The position itself, or the middle of its cell, so that equal designs have equal positions."""
        return (self._cell(position) + 0.5) / len(self.values) if self.values else position

    def axis_value(self, position: float) -> float:
        """The value on an axis: SI or a count; for a name its index among the values."""
        value = self.at(position)
        if self.quantity == SIGMA:
            return float(str(value).split()[0])
        return float(self._cell(position)) if isinstance(value, str) else float(value)

    def is_interior(self, position: float) -> bool:
        """Whether the value is at neither end of its range; always so for names and for two values."""
        if self.values:
            ordered = len(self.values) > 2 and not FIELDS[self.name].is_named
            return not ordered or 0 < self._cell(position) < len(self.values) - 1
        return 0.01 < position < 0.99

    @property
    def is_categorical(self) -> bool:
        """Whether the values are texts, shown as ticks of an axis."""
        return bool(self.values) and isinstance(self.values[0], str) and self.quantity != SIGMA

    @property
    def unit(self) -> str:
        """Unit of the stored column; "" for texts."""
        if self.quantity in UNITS:
            return si_unit(self.quantity)
        return "" if self.is_categorical else self.quantity or "1"

    @property
    def display_unit(self) -> str:
        """Unit of axes: that of the drawing's field, `SIGMA`, or "" for counts and names."""
        return FIELDS[self.name].unit if self.quantity in UNITS else self.quantity

    @property
    def scale(self) -> float:
        """Values of `axis_value` in one `display_unit`."""
        return UNITS[self.quantity][self.display_unit] if self.quantity in UNITS else 1.0

    def text(self, position: float) -> str:
        """The value for a table, with its unit."""
        value = self.at(position)
        if self.quantity == "length":
            size = float(value)
            return f"{1e6 * size:.4g} um" if abs(size) < 1e-4 else f"{1e3 * size:.6g} mm"
        if self.quantity in UNITS:
            return f"{float(value) / self.scale:.6g} {self.display_unit}"
        words = str(value).split()
        return f"{float(words[0]):.3g} sigma" if words[-1] == SIGMA else str(value)

    def _cell(self, position: float) -> int:
        return min(int(position * len(self.values)), len(self.values) - 1)


def read_parameter(name: str, table: Any, where: str) -> Parameter:
    """A parameter from {from, to}, {from, to, step} or {choices}. Raises `InputError` in one line.

    >>> read_parameter("gear_tolerance", {"from": "IT5", "to": "IT7"}, "study").values
    ('IT5', 'IT6', 'IT7')
    """
    if name not in FIELDS:
        raise unknown_name("parameter", name, FIELDS, where)
    field, at = FIELDS[name], f"{where} {name}"
    expect(isinstance(table, Mapping), "a table such as { from = ..., to = ... } or { choices = [...] }", table, at)
    refuse_unknown("key", table, ("from", "to", "step", "choices"), at)
    if "choices" in table:
        expect(len(table) == 1, "choices alone, or from and to", sorted(table), at)
        return _choices(field, table["choices"], at)
    for key in ("from", "to"):
        expect(key in table, f"the key {key!r}", sorted(table), at)
    expect(not field.is_named, "choices: names have no range", sorted(table), at)
    if field.quantity == COUNT:
        return _whole_range(name, table, at)
    ends = [str(table[key]).strip() for key in ("from", "to")]
    grades = [_GRADE.fullmatch(end) for end in ends]
    if field.quantity == TOLERANCE and all(grades):
        first, last = (int(match[1]) for match in grades if match)
        expect("step" not in table, "grades without a step", table.get("step"), at)
        expect(first < last, "from the finer grade to the coarser", f"{ends[0]} to {ends[1]}", at)
        return Parameter(name, values=tuple(f"IT{g}" for g in range(first, last + 1)))
    if field.quantity == OFFSET and all(end.endswith(SIGMA) for end in ends):
        return _range(name, [_sigmas(end, at) for end in ends], table, SIGMA, at)
    quantity = _physical(field)
    sizes = [read_size(table[key], f"{at}: {key}", quantity) for key in ("from", "to")]
    return _range(name, sizes, table, quantity, at)


def _physical(field: Field) -> str:
    """The quantity of the field's numbers: windows and offsets are lengths."""
    return field.quantity if field.quantity in UNITS else "length"


def _choices(field: Field, given: Any, at: str) -> Parameter:
    name = field.name
    expect(isinstance(given, list) and len(given) > 0, "a list of choices", given, at)
    expect(len({repr(choice) for choice in given}) == len(given), "choices that differ", given, at)
    if field.quantity == COUNT:
        for choice in given:
            if not (field is ELEMENTS_PER_ROW and choice == FILL):
                _whole(choice, at)
        return Parameter(name, values=tuple(given))
    if field.quantity in UNITS:
        sizes = tuple(read_size(choice, at, field.quantity) for choice in given)
        return Parameter(name, values=sizes, quantity=field.quantity)
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
    step_at = f"{at}: step"
    step = _sigmas(table["step"], step_at) if quantity == SIGMA else read_size(table["step"], step_at, quantity)
    expect(0 < step <= (high - low) * (1 + 1e-9), "a step above zero and within the range", table["step"], at)
    values = [float(f"{low + k * step:.9g}") for k in range(1 + math.floor((high - low) / step + 1e-9))]
    if quantity == SIGMA:
        return Parameter(name, values=tuple(f"{value:.9g} sigma" for value in values), quantity=quantity)
    # By way of the drawing's text, so that steps of 0.1 mm are the numbers that a drawing would state.
    stated = tuple(parse_quantity(format_quantity(value, quantity), quantity, at) for value in values)
    return Parameter(name, values=stated, quantity=quantity)


def _whole(value: Any, at: str) -> int:
    expect(
        isinstance(value, int) and not isinstance(value, bool) and value >= 1, "a whole number of at least 1", value, at
    )
    return value


def read_size(value: Any, at: str, quantity: str = "length") -> float:
    """A quantity of a file, SI: with its unit, unless it is zero. Raises `InputError`."""
    if isinstance(value, (int, float)) and value != 0:
        example = next(field.example for field in drive.FIELDS.values() if field.quantity == quantity)
        raise InputError(f"{at}: expected a {quantity} with its unit, such as {example!r}, got {value!r}")
    number = parse_quantity(value, quantity, at)
    expect(math.isfinite(number), f"a finite {quantity}", value, at)
    return number


def _sigmas(text: Any, at: str) -> float:
    words = str(text).split()
    try:
        number = float(words[0])
    except (ValueError, IndexError):
        number = math.nan
    expect(len(words) == 2 and words[-1] == SIGMA and math.isfinite(number), "a text such as '3 sigma'", text, at)
    return number
