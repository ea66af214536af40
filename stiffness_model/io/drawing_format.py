"""The documentation of drawings, from the table of their fields: `python -m stiffness_model.io.drawing_format`.

It prints docs/reference/drawing_format.md.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from ..drawing.drive import FIELDS
from ..drawing.fields import COUNT, NUMBER, REQUIRED, Field, FurtherKey
from ..drawing.materials import MATERIAL_TABLE
from ..frozen_mapping import FrozenMapping
from ..kinds import KINDS, ROLLING_ELEMENT_ECCENTRIC
from ..units import UNITS
from .material_tables import FIELDS as MATERIAL_FIELDS

_INTRODUCTION = """\
# The drawing of a drive

A drawing is a TOML file. Every field of it is also a keyword of `stiffness_model.load_drive` and a name for `--set
FIELD=VALUE`. Quantities are texts with their units; in Python a bare number is SI. `reefmu new FILE.toml` writes a
drawing with all fields, `drive_1.toml` among the presets is another example. Without a line `kind` at its head it is
the drawing of a rolling element eccentric drive, whose fields come first on this page. {others} makes it that of
another kind, whose fields stand in a section of its own; `reefmu new FILE.toml --kind KIND` writes one.
"""
_MATERIALS = """
The parts name a material of the package, which `reefmu materials` lists with its source, or one of these tables, `NAME`
standing for its name.
"""


class Row(NamedTuple):
    """One line of the documentation of a drawing's fields; unit: "" for a field without one."""

    name: str
    section: str
    value: str
    unit: str
    default: str
    example: str
    meaning: str


def table(fields: Mapping[str, Field]) -> list[Row]:
    """The documentation of the fields, section by section.

    >>> [row[:6] for row in table(FIELDS) if row.name == "crank_radius"]
    [('crank_radius', 'geometry', 'length', 'mm', 'required', '41 mm')]
    """
    sections = list(dict.fromkeys(field.section for field in fields.values()))
    return [
        Row(f.name, f.section, value_text(f), f.unit, default_text(f), f.example or str(f.default), f.doc)
        for f in sorted(fields.values(), key=lambda f: sections.index(f.section))
    ]


def value_text(field: Field) -> str:
    """What a field takes: its quantity or kind of value, or the words that it may be."""
    alternatives = field.choices or ((field.infinite,) if field.infinite else ())
    words = [repr(word) for word in alternatives]
    return " or ".join(words if field.choices else [field.quantity, *words])


def default_text(field: Field) -> str:
    """The default of a field as a drawing writes it; "required" for a field without one."""
    if field.default is REQUIRED:
        return "required"
    value = "" if field.default is None else field.write(field.default)
    return f"{value:g}" if isinstance(value, float) else str(value)


def markdown() -> str:
    """The page docs/reference/drawing_format.md.

    >>> markdown().splitlines()[0]
    '# The drawing of a drive'
    """
    sections = dict.fromkeys(field.section for field in FIELDS.values())
    notes = KINDS[ROLLING_ELEMENT_ECCENTRIC].section_notes
    others = [kind for kind in KINDS.values() if kind.name != ROLLING_ELEMENT_ECCENTRIC]
    lines = " or ".join(f'`kind = "{kind.name}"`' for kind in others)
    title, text = _INTRODUCTION.format(others=lines).split("\n\n")
    parts = [f"{title}\n\n{textwrap.fill(text, 120, break_on_hyphens=False)}\n"]
    for section in sections:
        fields = {name: field for name, field in FIELDS.items() if field.section == section}
        note = f"\n{notes[section]}" if section in notes else ""
        parts.append(f"\n## {f'[{section}]' if section else 'Head of the file'}\n{note}")
        parts.append(_fields(fields))
    parts += [f"\n## [{MATERIAL_TABLE}]\n{_MATERIALS}", _fields(MATERIAL_FIELDS)]
    varied = ", ".join(f"`{name}`" for name, field in FIELDS.items() if field.varies)
    studies = f"A study varies {varied} and, in place of `elements`, `elements_per_row`."
    parts.append(f"\n## Design studies\n\n{textwrap.fill(studies, 120, break_on_hyphens=False)}\n")
    for kind in others:
        text = textwrap.fill(kind.documentation, 120, break_on_hyphens=False, break_long_words=False)
        parts.append(f'\n## Kind "{kind.name}"\n\nFields of a drawing with `kind = "{kind.name}"`.\n')
        parts += [f"\n{text}\n" if text else "", _fields(kind.fields, kind.keys_beside_fields)]
    all_fields = [*FIELDS.values(), *MATERIAL_FIELDS.values(), *(f for kind in others for f in kind.fields.values())]
    used = {field.quantity for field in all_fields}
    units = [(quantity, ", ".join(f"`{unit}`" for unit in UNITS[quantity])) for quantity in UNITS if quantity in used]
    parts += ["\n## Units\n", _lines(("quantity", "units"), units)]
    return "".join(parts)


def _fields(fields: Mapping[str, Field], further: Mapping[str, FurtherKey] = FrozenMapping({})) -> str:
    rows = [
        (f"`{row.name}`", row.value.replace("'", '"'), row.default, f"`{_toml(fields[row.name], row)}`", row.meaning)
        for row in table(fields)
    ]
    rows += [_further_row(name, key) for name, key in further.items()]
    return _lines(("field", "value", "default", "example", "meaning"), rows)


def _further_row(name: str, key: FurtherKey) -> tuple[str, str, str, str, str]:
    """The line of a key that is not a single value; each line of a table's example is a code of its own."""
    lines = key.example.split("\n")[1:] if key.is_table else [key.example.partition(" = ")[2]]
    return f"`[{name}]`" if key.is_table else f"`{name}`", key.value, "", " ".join(f"`{x}`" for x in lines), key.meaning


def _toml(field: Field, row: Row) -> str:
    return row.example if field.quantity in (COUNT, NUMBER) else f'"{row.example}"'


def _lines(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [head, ["---"] * len(head), *([cell.replace("|", "\\|") for cell in row] for row in rows)]
    return "\n" + "\n".join("| " + " | ".join(line) + " |" for line in lines) + "\n"


if __name__ == "__main__":
    print(markdown(), end="")
