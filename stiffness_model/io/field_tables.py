"""The sections of a drawing and the fields in them, as declared by `drawing.fields.Field`: in and out."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from ..drawing.fields import REQUIRED, Field
from ..drawing.materials import Material
from ..errors import InputError, expect, refuse_unknown
from .material_tables import material_named, read_materials


def stated_fields(table: Mapping[str, Any], fields: Mapping[str, Field], where: str) -> dict[str, Any]:
    """The values that a drawing's nested tables state, by the name of their field.

    table: as TOML gives it, where `kind` and the tables [material.NAME] are left out here; fields: those of the kind of
    drive; where: the name of the drawing in messages. Raises `InputError` for a section or field that does not exist or
    stands elsewhere, and for NaN.
    """
    sections = dict.fromkeys(field.section for field in fields.values() if field.section)
    head = [name for name, field in fields.items() if not field.section]
    refuse_unknown("section or field", table, (*head, *sections, "material", "kind"), where)
    stated = {name: table[name] for name in head if name in table}
    for section in sections:
        part = table.get(section, {})
        expect(isinstance(part, Mapping), f"a table [{section}]", part, where)
        at, names = f"{where} [{section}]", [name for name, field in fields.items() if field.section == section]
        for name in part:
            place = fields[name].section if name in fields else section
            if place != section:
                expected = f"under [{place}]" if place else "before all tables"
                raise InputError(f"{at}: expected {name} {expected}, got it here")
        refuse_unknown("field", part, names, at)
        stated.update(part)
    for name, value in stated.items():
        if isinstance(value, float) and math.isnan(value):
            raise InputError(f"{where}: {name}: expected a value, got nan")
    return stated


def read_fields(
    table: Mapping[str, Any], fields: Mapping[str, Field], overrides: Mapping[str, Any], where: str
) -> tuple[dict[str, Any], dict[str, Any]]:
    """What a drawing and the `overrides` of its fields state, by field name, and the values of the attributes in SI.

    table, fields, where: as for `stated_fields`. Raises `InputError` for what does not exist, is missing or is no value
    of its field.
    """
    stated = stated_fields(table, fields, where)
    refuse_unknown("field", overrides, fields, where)
    stated.update(overrides)
    missing = [name for name, field in fields.items() if field.default is REQUIRED and name not in stated]
    expect(not missing, f"the field {missing[0]!r}" if missing else "", "none", where)
    values = {
        name: fields[name].read(value, where, from_code=name in overrides)
        for name, value in stated.items()
        if fields[name].attribute == name
    }
    return stated, values


def part_materials(
    table: Mapping[str, Any], stated: Mapping[str, Any], parts: Sequence[str], where: str
) -> dict[str, Material]:
    """The material of every part that a drawing states, its own ([material.NAME]) or a known one.

    Raises `InputError` for a material that is unknown or badly described.
    """
    own = read_materials(table.get("material", {}), where)
    return {part: material_named(stated[f"{part}_material"], own, f"{where}: {part}_material") for part in parts}


def nested_tables(written: Mapping[str, Any], fields: Mapping[str, Field], materials: Any) -> dict[str, Any]:
    """The tables of a drawing from values as it writes them, by field name; the inverse of `stated_fields`.

    materials: the drawing's own materials as tables by name (`material_tables.write_materials`).
    """
    values: dict[str, Any] = {name: written[name] for name, field in fields.items() if not field.section}
    if materials:
        values["material"] = materials
    for name, field in fields.items():
        if field.section and name in written:
            values.setdefault(field.section, {})[name] = written[name]
    return values
