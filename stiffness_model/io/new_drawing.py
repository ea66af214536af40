"""A new drawing of any kind: every field with its meaning, stated with an example's value or commented out."""

from __future__ import annotations

import json
import re
import textwrap
from collections.abc import Iterator, Mapping
from typing import Any

from ..drawing.fields import COUNT, MATERIAL, NUMBER, REQUIRED, TEXT, Field
from ..kinds import ROLLING_ELEMENT_ECCENTRIC, Kind
from ..units import UNITS
from .drawing_format import default_text, value_text
from .drawing_toml import read_table
from .material_tables import FIELDS as MATERIAL_FIELDS

WIDTH = 118
"""Characters of a line of comment without its "# "."""
NO_BREAK = "\xa0"
_INTRODUCTION = """\
Drawing of {noun}, with the values of {example}: replace them by your own. Above each field stand its \
meaning, what it takes and its default. A line that begins with # and no space is a field that is not stated, with an \
example: remove the # to state it. `reefmu curve FILE` computes the stiffness. Quantities are texts with one of these \
units:"""
_MATERIALS = """\
A part names a material that is built in (`reefmu materials` lists them) or one of tables such as this, NAME \
standing for its name."""


def new_drawing(kind: Kind, name: str) -> str:
    """The text of a drawing that `load_drive` reads, with the values of the kind's example.

    kind: of `KINDS`. name: of the new drive.

    >>> from stiffness_model.kinds import KINDS
    >>> print(new_drawing(KINDS["cycloidal"], "mine").split("[operation]")[1].split("\\n\\n")[0])
    <BLANKLINE>
    # Greatest twist in use, at the output. (angle; required)
    max_twist = "120 arcmin"
    """
    table: dict[str, Any] = {**_without_texts(kind), "name": name}
    lines = [*_comment(_INTRODUCTION.format(noun=kind.noun, example=kind.example)), *_units(kind)]
    if kind.documentation:
        lines += ["#", *_comment(kind.documentation)]
    if kind.name != ROLLING_ELEMENT_ECCENTRIC:
        lines += ["", _assignment("kind", kind.name)]
    for section in dict.fromkeys(field.section for field in kind.fields.values()):
        fields = [field for field in kind.fields.values() if field.section == section]
        stated = table.get(section, {}) if section else table
        lines += ["", f"[{section}]"] if section else [""]
        lines += [*_comment(kind.section_notes[section]), ""] if section in kind.section_notes else []
        for field in fields:
            lines += _field(field, stated)
    lines += _further_keys(kind, table)
    if _has_materials(kind):
        lines += _materials(table.get("material", {}))
    return "\n".join(lines) + "\n"


def _without_texts(kind: Kind) -> dict[str, Any]:
    """The table of the kind's example, whose texts would be untrue of another drive: required ones are to replace."""
    texts = [field for field in kind.fields.values() if field.quantity == TEXT]
    table = {name: value for name, value in read_table(kind.example)[0].items() if name not in {f.name for f in texts}}
    return table | {field.name: f"REPLACE: {field.doc}" for field in texts if field.default is REQUIRED}


def _units(kind: Kind) -> Iterator[str]:
    """The units of every quantity that the kind's fields state, in ASCII."""
    fields = [*kind.fields.values(), *(MATERIAL_FIELDS.values() if _has_materials(kind) else ())]
    used = {field.quantity for field in fields}
    for quantity, units in UNITS.items():
        if quantity in used:
            yield f"#   {quantity}: {', '.join(unit for unit in units if unit.isascii())}"


def _has_materials(kind: Kind) -> bool:
    return any(field.quantity == MATERIAL for field in kind.fields.values())


def _field(field: Field, stated: Mapping[str, Any]) -> Iterator[str]:
    """The comment on one field, and the field as stated or, after a #, its example."""
    default = default_text(field)
    default = default if default in ("", "required") else f"default {default}"
    words = value_text(field).replace("'", '"')
    # Spaces that do not break keep a number beside its unit.
    inside = "; ".join(word.replace(" ", NO_BREAK) for word in (words, default) if word)
    yield from _comment(f"{field.doc} ({inside})")
    if field.name in stated:
        yield _assignment(field.name, stated[field.name])
    else:
        example = field.example or str(field.default)
        number = field.quantity in (COUNT, NUMBER)
        yield f"#{field.name} = {example if number else json.dumps(example, ensure_ascii=False)}"


def _further_keys(kind: Kind, table: Mapping[str, Any]) -> Iterator[str]:
    """The keys that are not single values; tables of them last, as TOML needs."""
    for name, key in sorted(kind.keys_beside_fields.items(), key=lambda item: item[1].is_table):
        yield from ("", *_comment(key.meaning)) if key.is_table else _comment(key.meaning)
        lines = key.example.split("\n")
        yield from [_assignment(name, table[name])] if name in table else (f"#{line}" for line in lines)


def _materials(own: Mapping[str, Mapping[str, Any]]) -> Iterator[str]:
    """The tables of the example's own materials, or one that is commented out."""
    yield from ("", *_comment(_MATERIALS))
    for name, stated in own.items():
        yield f"[material.{name if re.fullmatch(r'[A-Za-z0-9_-]+', name) else json.dumps(name)}]"
        for field in MATERIAL_FIELDS.values():
            yield from _field(field, stated)
    if not own:
        yield "#[material.NAME]"
        for field in MATERIAL_FIELDS.values():
            yield from _field(field, {})


def _assignment(name: str, value: Any) -> str:
    import tomli_w

    return tomli_w.dumps({name: value}).rstrip("\n")


def _comment(text: str) -> list[str]:
    """The text as lines of comment."""
    lines = textwrap.wrap(re.sub(r"[ \n]+", " ", text), WIDTH, break_on_hyphens=False, break_long_words=False)
    return [f"# {line}".replace(NO_BREAK, " ") for line in lines]
