"""How a field of a drawing is declared, and what follows from the declaration.

`Drive`, `ModelOptions` and `Material` annotate each attribute that a drawing states with one `Field`; the attribute
gives its name and default. `fields_of` collects the declarations into a table. The TOML reader and writer, `--set`, the
design studies, the checks of single values, "did you mean" and docs/reference/drawing_format.md read that table, so a
new field is one annotated attribute.
"""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Annotated, Any, NamedTuple, get_args, get_origin, get_type_hints

from ..errors import InputError, expect, expect_integer, expect_number, unknown_name
from ..units import UNITS, format_quantity, parse_quantity

TEXT, COUNT, NUMBER, CHOICE = "text", "whole number", "number", "choice"
MATERIAL, TOLERANCE, OFFSET = "material", "tolerance", "offset"
"""Kinds of values beside the quantities of `units.UNITS`."""
PARTS = ("element", "crank", "cage", "gear")
"""Parts with a material and a tolerance."""
_PART_NAMES = {
    "element": "rolling elements",
    "crank": "crank's raceways",
    "cage": "cage's bores",
    "gear": "gear's profile",
}


class FurtherKey(NamedTuple):
    """A key of a drawing that is not a single value.

    value: what it takes; meaning: in one sentence; example: in TOML, which begins with "[" for a table.
    """

    value: str
    meaning: str
    example: str

    @property
    def is_table(self) -> bool:
        """Whether the key is a table, which stands below all single values."""
        return self.example.startswith("[")


class Required:
    """The default of a field without one."""

    def __repr__(self) -> str:
        return "required"


REQUIRED = Required()

Check = Callable[[object, str], Any]
"""From a value and "FILE: FIELD" to the value as it is kept; raises `InputError`."""


def positive(expected: str) -> Check:
    """A check for finite numbers above zero."""
    return lambda value, where: expect_number(value, expected, where, low=0)


def number_between(low: float, high: float, expected: str) -> Check:
    """A check for numbers strictly between `low` and `high`."""
    return lambda value, where: expect_number(value, expected, where, low=low, high=high)


def ratio_above_one(value: object, where: str) -> float:
    """The magnitude of a transmission ratio; a plain int where it is whole."""
    ratio = expect_number(value, "the ratio's magnitude, above 1", where, low=1)
    return int(ratio) if ratio == int(ratio) else ratio


def optional(check: Check) -> Check:
    """The check, for a value that may be None."""
    return lambda value, where: None if value is None else check(value, where)


def _text(value: object, where: str) -> str:
    expect(isinstance(value, str), "a text", value, where)
    return str(value)


def _count(value: object, where: str) -> int:
    # As a plain int, whatever was counted with: NumPy's integers go neither into TOML nor into C.
    return expect_integer(value, "a whole number of at least 1", where)


def _one_of(choices: tuple[str, ...]) -> Check:
    def check(value: object, where: str) -> str:
        expect(isinstance(value, str), " or ".join(repr(choice) for choice in choices), value, where)
        if value not in choices:
            raise unknown_name("choice", value, choices, where)
        return str(value)

    return check


@dataclass(frozen=True)
class Field:
    """One field of a drawing: a key of its TOML section, a keyword of `load_drive` and a name for `--set`.

    quantity: of `units.UNITS`, or a kind such as `COUNT`; section: TOML table, "" for the head of the file; doc: its
    meaning in one sentence; example: a value as a drawing writes it, with the unit that pictures and tables show.
    check: of a single value; None for the usual one: a quantity is positive, or at least 0 where that is its default,
    a count is at least 1, a choice is one of `choices`. infinite: how a drawing writes infinity, "" where the value is
    finite; varies: whether a design study may vary it. `fields_of` fills in name, default and attribute (of the
    dataclass that keeps the value). A name with "{part}" declares a field for each of `PARTS`, as does the doc's.
    """

    quantity: str
    section: str
    doc: str
    example: str = ""
    check: Check | None = None
    choices: tuple[str, ...] = ()
    infinite: str = ""
    varies: bool = False
    name: str = ""
    default: Any = REQUIRED
    attribute: str = ""

    @property
    def has_unit(self) -> bool:
        """Whether a drawing writes it as a text with a unit."""
        return self.quantity in UNITS or self.quantity in (TOLERANCE, OFFSET)

    @property
    def unit(self) -> str:
        """The unit of a drawing, such as mm; "" for a field without one."""
        return self.example.split()[-1] if self.has_unit else ""

    @property
    def is_named(self) -> bool:
        """Whether its values are names, which have no order."""
        return self.quantity in (CHOICE, MATERIAL)

    def checked(self, value: object, where: str) -> Any:
        """The value as it is kept: a plain float, int or text. where: the drawing, or "". Raises `InputError`."""
        if self.infinite and value == math.inf:
            return math.inf
        return (self.check or self._usual_check())(value, f"{where}: {self.name}" if where else self.name)

    def _usual_check(self) -> Check:
        if self.quantity in UNITS and self.default == 0:
            return number_between(-math.ulp(0.0), math.inf, f"{_article(self.quantity)} {self.quantity} from zero on")
        if self.quantity in UNITS:
            return positive(f"a positive {self.quantity}" + (f" or {self.infinite!r}" if self.infinite else ""))
        return _one_of(self.choices) if self.quantity == CHOICE else _text if self.quantity == TEXT else _count

    def require_unit(self, value: object, where: str) -> None:
        """Raise `InputError` for a bare number of a file where a unit is needed; zero needs none."""
        if self.has_unit and isinstance(value, (int, float)) and value != 0:
            kind = f"{_article(self.quantity)} {self.quantity} with its unit, such as {self.example!r}"
            raise InputError(f"{where}: {self.name}: expected {kind}, got {value!r}")

    def read(self, value: object, where: str, *, from_code: bool = False) -> Any:
        """The checked SI value of what a drawing states. Raises `InputError`.

        from_code: a bare number is SI; otherwise it comes from a file and must have its unit.

        >>> Field("length", "geometry", "Radius.", "41 mm", name="crank_radius").read("42 mm", "mine.toml")
        0.042
        """
        if not from_code:
            self.require_unit(value, where)
        if self.infinite and isinstance(value, str) and value == self.infinite:
            return math.inf
        if self.quantity in UNITS:
            value = parse_quantity(value, self.quantity, f"{where}: {self.name}")
        return self.checked(value, where)

    def parse(self, text: str) -> object:
        """What `--set FIELD=TEXT` stands for: a number where the field is a bare one, else the text."""
        if self.quantity in (COUNT, NUMBER):
            for kind in (int, float):
                try:
                    return kind(text)
                except ValueError:
                    pass
        return text

    def write(self, value: Any) -> Any:
        """The value as a drawing writes it; `read` gives it back."""
        if self.infinite and value == math.inf:
            return self.infinite
        return format_quantity(value, self.quantity) if self.quantity in UNITS else value


def _article(noun: str) -> str:
    return "an" if noun[0] in "aeiou" else "a"


@functools.cache
def fields_of(owner: type) -> Mapping[str, Field]:
    """The fields that the attributes of a dataclass declare, by name, in the order of the attributes.

    >>> from stiffness_model.drawing.materials import Material
    >>> fields_of(Material)["density"].unit
    'kg/m3'
    """
    hints, found = get_type_hints(owner, include_extras=True), dict[str, Field]()
    for attribute in dataclasses.fields(owner):
        hint = hints[attribute.name]
        declared = [d for d in get_args(hint)[1:] if isinstance(d, Field)] if get_origin(hint) is Annotated else []
        for field in declared:
            made = replace(field, attribute=attribute.name)
            if not made.name:
                default = REQUIRED if attribute.default is dataclasses.MISSING else attribute.default
                made = replace(made, name=attribute.name, default=default if made.default is REQUIRED else made.default)
            found |= {one.name: one for one in _per_part(made)}
    return found


def _per_part(field: Field) -> Iterable[Field]:
    if "{part}" not in field.name:
        return (field,)
    return (
        replace(field, name=field.name.format(part=part), doc=field.doc.format(part=_PART_NAMES[part]))
        for part in PARTS
    )


def check_attributes(record: object, owner: type, where: str) -> None:
    """Replace every declared attribute of a frozen dataclass by its checked value. Raises `InputError`."""
    for name, field in fields_of(owner).items():
        if name == field.attribute:
            object.__setattr__(record, name, field.checked(getattr(record, name), where))
