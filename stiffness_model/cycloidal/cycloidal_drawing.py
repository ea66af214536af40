"""The drawing of a cycloidal drive as TOML tables: in, with every field checked, and out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..drawing.fields import REQUIRED
from ..drawing.materials import material_labels
from ..errors import InputError, expect, refuse_unknown
from ..io.field_tables import nested_tables, stated_fields
from ..io.material_tables import material_named, read_materials, write_materials
from ..kinds import CYCLOIDAL
from .cycloidal_drive import CYCLOIDAL_FIELDS, CYCLOIDAL_PARTS, CycloidalDrive


def read_cycloidal(table: Mapping[str, Any], where: str = "drawing", **fields: Any) -> CycloidalDrive:
    """A cycloidal drive from a drawing's nested tables; keywords override its fields.

    table: as TOML gives it, with `kind = "cycloidal"`. Raises `InputError` with the field, what was expected and what
    came, and for a drawing of another kind.
    """
    if table.get("kind") != CYCLOIDAL:
        raise InputError(f"{where}: expected kind {CYCLOIDAL!r} here, got {table.get('kind')!r}")
    stated = stated_fields(table, CYCLOIDAL_FIELDS, where)
    own = read_materials(table.get("material", {}), where)
    refuse_unknown("field", fields, CYCLOIDAL_FIELDS, where)
    stated.update(fields)
    missing = [n for n, field in CYCLOIDAL_FIELDS.items() if field.default is REQUIRED and n not in stated]
    expect(not missing, f"the field {missing[0]!r}" if missing else "", "none", where)
    values = {
        name: CYCLOIDAL_FIELDS[name].read(value, where, from_code=name in fields)
        for name, value in stated.items()
        if CYCLOIDAL_FIELDS[name].attribute == name
    }
    materials = {
        part: material_named(stated[f"{part}_material"], own, f"{where}: {part}_material") for part in CYCLOIDAL_PARTS
    }
    return CycloidalDrive(**values, materials=materials, where=where)


def write_cycloidal(drive: CycloidalDrive) -> dict[str, Any]:
    """The drawing of `drive` as nested tables, which `read_cycloidal` reads back."""
    labels = material_labels(drive.materials[part] for part in CYCLOIDAL_PARTS)
    written = {
        name: field.write(getattr(drive, name))
        for name, field in CYCLOIDAL_FIELDS.items()
        if field.attribute == name and (field.default is REQUIRED or getattr(drive, name) != field.default)
    }
    written |= {"description": drive.description}
    written |= {f"{part}_material": labels[drive.materials[part]] for part in CYCLOIDAL_PARTS}
    return {"kind": CYCLOIDAL, **nested_tables(written, CYCLOIDAL_FIELDS, write_materials(labels))}
