"""The drawing of a drive as a TOML file: in, with every field checked, and out."""

from __future__ import annotations

import math
import os
import warnings
from collections.abc import Mapping
from typing import Any

from ..drawing.drive import FIELDS, HOLES, Drive
from ..drawing.fields import PARTS, REQUIRED, fields_of
from ..drawing.fits import read_zone, tolerance_from_zone, zone_text
from ..drawing.materials import material_labels
from ..drawing.options import ModelOptions, write_options
from ..drawing.tolerances import Tolerance, clearance_offset, diameters
from ..errors import DoesNotFitWarning, InputError, expect, refuse_unknown
from ..units import format_quantity
from .atomic_files import atomic_file
from .material_tables import material_named, read_materials, write_materials
from .toml_files import packaged_names, read_named

_OWN, _OPTIONS = fields_of(Drive), fields_of(ModelOptions)

DriveLike = Drive | str | os.PathLike[str]
"""What the public functions take for a drive: the drive itself, a preset's name, or a drawing's path (`as_drive`)."""


def presets() -> list[str]:
    """Names of the drawings that come with the package.

    >>> presets()
    ['drive_1', 'drive_2', 'drive_3', 'workshop']
    """
    return packaged_names("presets")


def load_drive(source: str | os.PathLike[str], **fields: Any) -> Drive:
    """A drive from its drawing; keywords override the drawing's fields.

    source: a preset's name or a TOML file's path. Keywords take what TOML takes ("41 mm", "IT5", "3 sigma") and, for
    quantities, SI numbers (0.041). Raises `InputError` with the file, the field, what was expected and what came; warns
    (`DoesNotFitWarning`) if bores overlap, with seats, chord, wall and what fits (`seats`).

    >>> load_drive("drive_1", lobes=28).ratio
    29
    >>> load_drive("drive_1").ratio
    -29
    """
    table, where = read_table(source)
    drive = drive_from_dict(table, where, **fields)
    if not drive.seats.fits:
        warnings.warn(f"{where}: {drive.seats.overlap_message()}", DoesNotFitWarning, stacklevel=2)
    return drive


def as_drive(drive: DriveLike) -> Drive:
    """The drive itself, or that of a preset's name or a drawing's path: what every function takes for a drive.

    Raises `InputError` for anything else.

    >>> as_drive("drive_1") == load_drive("drive_1") == as_drive(load_drive("drive_1"))
    True
    """
    if isinstance(drive, Drive):
        return drive
    if not isinstance(drive, (str, os.PathLike)):
        raise InputError(f"drive: expected a Drive, a preset's name or a drawing's path, got {drive!r}")
    return load_drive(drive)


def read_table(source: str | os.PathLike[str]) -> tuple[dict[str, Any], str]:
    """The tables of a drawing as TOML gives them, for `drive_from_dict`, and what to call it in an error.

    Raises `InputError` where there is no such preset or file, or no TOML in it.
    """
    table, where, _ = read_named(source, "presets", "drive", "TOML drawing")
    return table, where


def drive_from_dict(table: Mapping[str, Any], where: str = "drawing", **fields: Any) -> Drive:
    """A drive from a drawing's nested tables; keywords override its fields.

    table: as TOML gives it. where: the name of the drawing in messages. Raises `InputError` with the field, what was
    expected and what came.

    >>> drive = load_drive("drive_2")
    >>> drive_from_dict(drive_to_dict(drive)) == drive
    True
    """
    stated = _flatten(table, where)
    own = read_materials(table.get("material", {}), where)
    refuse_unknown("field", fields, FIELDS, where)
    stated.update(fields)
    missing = [name for name, field in FIELDS.items() if field.default is REQUIRED and name not in stated]
    expect(not missing, f"the field {missing[0]!r}" if missing else "", "none", where)
    values = {
        name: FIELDS[name].read(value, where, from_code=name in fields)
        for name, value in stated.items()
        if FIELDS[name].attribute == name
    }
    options = {name: values.pop(name) for name in _OPTIONS if name in values}
    materials = {part: material_named(stated[f"{part}_material"], own, f"{where}: {part}_material") for part in PARTS}
    return Drive(
        **values,
        materials=materials,
        tolerances=_read_tolerances(stated, fields, values["element_radius"], values["crank_radius"], where),
        beyond=ModelOptions(**options),
        where=where,
    )


def _flatten(table: Mapping[str, Any], where: str) -> dict[str, Any]:
    """The stated fields by name. Raises `InputError` for a section or field that does not exist or stands elsewhere."""
    sections = dict.fromkeys(field.section for field in FIELDS.values() if field.section)
    head = [name for name, field in FIELDS.items() if not field.section]
    refuse_unknown("section or field", table, (*head, *sections, "material"), where)
    stated = {name: table[name] for name in head if name in table}
    for section in sections:
        part = table.get(section, {})
        expect(isinstance(part, Mapping), f"a table [{section}]", part, where)
        at, names = f"{where} [{section}]", [name for name, field in FIELDS.items() if field.section == section]
        for name in part:
            place = FIELDS[name].section if name in FIELDS else section
            if place != section:
                expected = f"under [{place}]" if place else "before all tables"
                raise InputError(f"{at}: expected {name} {expected}, got it here")
        refuse_unknown("field", part, names, at)
        stated.update(part)
    for name, value in stated.items():
        if isinstance(value, float) and math.isnan(value):
            raise InputError(f"{where}: {name}: expected a value, got nan")
    return stated


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


def drive_to_dict(drive: Drive) -> dict[str, Any]:
    """The drawing of `drive` as nested tables, such that `drive_from_dict` gives it back."""
    labels = material_labels(drive.materials[part] for part in PARTS)
    written = {
        **{name: field.write(getattr(drive, name)) for name, field in _OWN.items() if field.attribute == name},
        **{f"{part}_material": labels[drive.materials[part]] for part in PARTS},
        **_tolerance_texts(drive),
        # Only what is switched on: a plain drawing stays as it was.
        **write_options(drive.beyond),
    }
    values: dict[str, Any] = {name: written[name] for name, field in FIELDS.items() if not field.section}
    materials = write_materials(labels)
    if materials:
        values["material"] = materials
    for name, field in FIELDS.items():
        if field.section and name in written:
            values.setdefault(field.section, {})[name] = written[name]
    return values


def _tolerance_texts(drive: Drive) -> dict[str, str]:
    """The fields of the tolerances; no offset where a fit or limits state it."""
    texts: dict[str, str] = {}
    for part, tolerance in drive.tolerances.items():
        texts[f"{part}_tolerance"], states_offset = zone_text(tolerance, drive.size(part), part in HOLES)
        if not states_offset:
            texts[f"{part}_offset"] = format_quantity(tolerance.offset, "length")
    return texts


def save_drive(drive: Drive, path: str | os.PathLike[str]) -> None:
    """Write the drawing of `drive` to `path` as TOML, whole or not at all; `load_drive` gives back an equal drive."""
    import tomli_w

    with atomic_file(path) as temporary:
        temporary.write_text(tomli_w.dumps(drive_to_dict(drive)), encoding="utf-8")
