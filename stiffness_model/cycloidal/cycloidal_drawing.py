"""The drawing of a cycloidal drive as TOML tables: in, with every field checked, and out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..drawing.fields import REQUIRED
from ..drawing.material_library import material_labels
from ..io.field_tables import nested_tables, part_materials, read_fields
from ..io.material_tables import write_materials
from ..kinds import CYCLOIDAL, expect_kind
from .cycloidal_drive import CYCLOIDAL_FIELDS, CYCLOIDAL_PARTS, CycloidalDrive


def read_cycloidal(table: Mapping[str, Any], where: str = "drawing", **fields: Any) -> CycloidalDrive:
    """A cycloidal drive from a drawing's nested tables; keywords override its fields.

    table: as TOML gives it, with `kind = "cycloidal"`. Raises `InputError` with the field, what was expected and what
    came, and for a drawing of another kind.
    """
    expect_kind(table, CYCLOIDAL, where)
    stated, values = read_fields(table, CYCLOIDAL_FIELDS, fields, where)
    materials = part_materials(table, stated, CYCLOIDAL_PARTS, where)
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
