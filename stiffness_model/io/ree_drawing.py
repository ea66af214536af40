"""The drawing of a rolling element eccentric drive as TOML tables: in, with every field checked, and out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ..drawing.drive import FIELDS, HOLES, Drive
from ..drawing.fields import PARTS, fields_of
from ..drawing.fits import read_zone, tolerance_from_zone, zone_text
from ..drawing.material_library import material_labels
from ..drawing.options import ModelOptions, write_options
from ..drawing.tolerances import Tolerance, clearance_offset, diameters
from ..kinds import ROLLING_ELEMENT_ECCENTRIC, expect_kind
from ..units import format_quantity
from .field_tables import nested_tables, part_materials, read_fields
from .material_tables import write_materials

_OWN, _OPTIONS = fields_of(Drive), fields_of(ModelOptions)


def read_drawing(table: Mapping[str, Any], where: str = "drawing", **fields: Any) -> Drive:
    """A drive from a drawing's nested tables; keywords override its fields.

    table: as TOML gives it. where: the name of the drawing in messages. Raises `InputError` with the field, what was
    expected and what came, and for a drawing of another kind.
    """
    expect_kind(table, ROLLING_ELEMENT_ECCENTRIC, where)
    stated, values = read_fields(table, FIELDS, fields, where)
    options = {name: values.pop(name) for name in _OPTIONS if name in values}
    return Drive(
        **values,
        materials=part_materials(table, stated, PARTS, where),
        tolerances=_read_tolerances(stated, fields, values["element_radius"], values["crank_radius"], where),
        beyond=ModelOptions(**options),
        where=where,
    )


def _read_tolerances(
    stated: Mapping[str, Any], overrides: Mapping[str, Any], element_radius: float, crank_radius: float, where: str
) -> dict[str, Tolerance]:
    """The tolerance of every part, whose grades and fits depend on its nominal size."""
    tolerances: dict[str, Tolerance] = {}
    for part, size in diameters(element_radius, crank_radius).items():
        zone_name, offset_name = f"{part}_tolerance", f"{part}_offset"
        text, offset = stated[zone_name], stated.get(offset_name)
        for name, value in ((zone_name, text), (offset_name, offset)):
            if name not in overrides:
                FIELDS[name].require_unit(value, where)
        zone = read_zone(text, size, part in HOLES, f"{where}: {zone_name}")
        if zone_name in overrides and offset_name not in overrides and zone.offset is not None:
            offset = None  # A fit that overrides the drawing's zone overrides its offset too.
        # Bores for which nothing states an offset clear their elements.
        default = clearance_offset(zone.window, tolerances["element"]) if part == "cage" else 0.0
        tolerances[part] = tolerance_from_zone(zone, offset, text, f"{where}: {part}", default)
    return tolerances


def write_drawing(drive: Drive) -> dict[str, Any]:
    """The drawing of `drive` as nested tables, which `read_drawing` reads back; without its kind, the default."""
    labels = material_labels(drive.materials[part] for part in PARTS)
    written = {
        **{name: field.write(getattr(drive, name)) for name, field in _OWN.items() if field.attribute == name},
        **{f"{part}_material": labels[drive.materials[part]] for part in PARTS},
        **_tolerance_texts(drive),
        # Only what is switched on: a plain drawing stays as it was.
        **write_options(drive.beyond),
    }
    return nested_tables(written, FIELDS, write_materials(labels))


def _tolerance_texts(drive: Drive) -> dict[str, str]:
    """The fields of the tolerances; no offset where a fit or limits state it."""
    texts: dict[str, str] = {}
    for part, tolerance in drive.tolerances.items():
        texts[f"{part}_tolerance"], states_offset = zone_text(tolerance, drive.size(part), part in HOLES)
        if not states_offset:
            texts[f"{part}_offset"] = format_quantity(tolerance.offset, "length")
    return texts
