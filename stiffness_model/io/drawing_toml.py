"""The drawing of a drive as a TOML file: in, with every field checked, and out."""

from __future__ import annotations

import importlib.resources
import math
import os
import warnings
from collections.abc import Mapping
from pathlib import Path as FilePath
from typing import Any

from ..drawing import options
from ..drawing.drive import COUNTS, HOLES, PARTS, Drive, diameters
from ..drawing.fits import read_zone, tolerance_from_zone, zone_text
from ..drawing.materials import MATERIALS, Material, find_material, material_labels
from ..drawing.tolerances import Tolerance, clearance_offset
from ..errors import (
    DoesNotFitWarning,
    InputError,
    UnknownNameError,
    expect,
    expect_number,
    refuse_unknown,
    unknown_name,
)
from ..units import format_quantity, parse_quantity
from .atomic_files import atomic_file, parse_toml

_SECTIONS: dict[str, tuple[str, ...]] = {
    "geometry": (
        "element",
        "element_radius",
        "element_length",
        "elements",
        "eccentrics",
        "crank_radius",
        "eccentricity",
        "transmission_ratio",
        "lobes",
    ),
    "materials": tuple(f"{part}_material" for part in PARTS),
    "tolerances": (*(f"{part}_tolerance" for part in PARTS), *(f"{part}_offset" for part in PARTS), "crank_deviation"),
    "operation": ("max_twist",),
}
_OPTIONS = options.SECTIONS
_HEAD = ("name", "description")
_OPTION_NAMES = tuple(name for names in _OPTIONS.values() for name in names)
FIELDS = (*_HEAD, *(name for names in _SECTIONS.values() for name in names), *_OPTION_NAMES)
"""Every field of a drawing: TOML key, keyword of `load_drive` and name for `--set`."""
_ALLOWABLE = ("allowable_pressure", "allowable_line_pressure")
_LENGTHS = ("element_radius", "element_length", "crank_radius", "eccentricity")
_DEFAULTS: dict[str, Any] = {
    "description": "",
    "element": "ball",
    "element_length": 0.0,
    "eccentrics": 1,
    # None: what the field states; else 0, and for the cage the clearance of `clearance_offset`.
    **dict.fromkeys(f"{part}_offset" for part in PARTS),
    "crank_deviation": "element",
}


DriveLike = Drive | str | os.PathLike[str]
"""What the public functions take for a drive: the drive itself, a preset's name, or a drawing's path (`as_drive`)."""


def presets() -> list[str]:
    """Names of the drawings that come with the package.

    >>> presets()
    ['drive_1', 'drive_2', 'drive_3', 'workshop']
    """
    folder = importlib.resources.files("stiffness_model") / "presets"
    return sorted(f.name.removesuffix(".toml") for f in folder.iterdir() if f.name.endswith(".toml"))


def load_drive(source: str | os.PathLike[str], **fields: Any) -> Drive:
    """A drive from a preset's name or a TOML file's path; keywords override the drawing's fields.

    Keywords take what TOML takes ("41 mm", "IT5", "3 sigma") and, for quantities, SI numbers (0.041).
    Raises `InputError` with the file, the field, what was expected and what came; warns (`DoesNotFitWarning`)
    if bores overlap, with seats, chord, wall and what fits (`seats`).

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
    text, where = _read(source)
    return parse_toml(text, where, "a TOML drawing"), where


def _read(source: str | os.PathLike[str]) -> tuple[str, str]:
    if isinstance(source, str) and source in presets():
        return (importlib.resources.files("stiffness_model") / "presets" / f"{source}.toml").read_text("utf-8"), source
    path = FilePath(source)
    if not path.is_file():
        if path.suffix == "" and path.parent == FilePath("."):
            raise unknown_name("drive", str(source), presets())
        raise InputError(f"{path}: expected a TOML drawing, got no such file")
    try:
        return path.read_text("utf-8"), str(path)
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path}: expected a readable TOML drawing, got {error}") from None


def drive_from_dict(table: Mapping[str, Any], where: str = "drawing", **fields: Any) -> Drive:
    """A drive from the nested tables of a drawing (as TOML gives them), with overrides.

    >>> drive = load_drive("drive_2")
    >>> drive_from_dict(drive_to_dict(drive)) == drive
    True
    """
    flat = _flatten(table, where)
    own = _own_materials(table.get("material", {}), where)
    refuse_unknown("field", fields, FIELDS, where)
    flat.update(fields)
    missing = [name for name in FIELDS if name not in flat and name not in (*_DEFAULTS, *_OPTION_NAMES)]
    expect(not missing, f"the field {missing[0]!r}" if missing else "", "none", where)
    flat = {**_DEFAULTS, **flat}
    values: dict[str, Any] = {
        name: flat[name] for name in (*_HEAD, *COUNTS, "element", "crank_deviation", "transmission_ratio")
    }
    for name in _HEAD:
        expect(isinstance(values[name], str), "a text", values[name], f"{where}: {name}")
    for name in _LENGTHS:
        values[name] = parse_quantity(_with_unit(flat[name], name, name in fields, where), "length", f"{where}: {name}")
    values["max_twist"] = parse_quantity(
        _with_unit(flat["max_twist"], "max_twist", "max_twist" in fields, where), "angle", f"{where}: max_twist"
    )
    values["materials"] = {
        part: _material(flat[f"{part}_material"], own, f"{where}: {part}_material") for part in PARTS
    }
    for name in ("crank_radius", "element_radius"):
        expect_number(values[name], "a positive length", f"{where}: {name}", low=0)
    sizes = diameters(values["element_radius"], values["crank_radius"])
    tolerances: dict[str, Tolerance] = {}
    for part in PARTS:
        tolerances[part] = _tolerance(flat, part, sizes[part], fields, where, tolerances.get("element"))
    values["tolerances"] = tolerances
    switched = {
        name: _with_unit(flat[name], name, name in fields, where) if name in options.QUANTITIES else flat[name]
        for name in _OPTION_NAMES
        if name in flat
    }
    return Drive(**values, beyond=options.read_options(switched, where), where=where)


def _flatten(table: Mapping[str, Any], where: str) -> dict[str, Any]:
    sections = {name: (*_SECTIONS.get(name, ()), *_OPTIONS.get(name, ())) for name in (*_SECTIONS, *_OPTIONS)}
    refuse_unknown("section or field", table, (*_HEAD, *sections, "material"), where)
    flat = {name: table[name] for name in _HEAD if name in table}
    for section, names in sections.items():
        part = table.get(section, {})
        expect(isinstance(part, Mapping), f"a table [{section}]", part, where)
        for key, value in part.items():
            if key not in names:
                raise unknown_name("field", key, names, f"{where} [{section}]")
            if isinstance(value, float) and math.isnan(value):
                raise InputError(f"{where}: {key}: expected a value, got nan")
            flat[key] = value
    return flat


_EXAMPLES = {
    "twist": ("an angle", "'8 arcmin'"),
    "tolerance": ("a window", "'13 um'"),
    "offset": ("an offset", "'5 um'"),
    "modulus": ("a pressure", "'208 GPa'"),
    "density": ("a density", "'7810 kg/m3'"),
    "stiffness": ("a stiffness", "'250 N/um'"),
    "speed": ("a speed", "'3000 rpm'"),
    "limit": ("a pressure", "'4.2 GPa'"),
    "pressure": ("a pressure", "'90 MPa'"),
    "capacity": ("a load", "'30 kN'"),
}


def _with_unit(value: Any, name: str, from_code: bool, where: str) -> Any:
    """A bare number is SI in Python code, and an error in a file: a drawing states its units."""
    if isinstance(value, (int, float)) and value != 0 and not from_code:
        kind, example = _EXAMPLES.get(name.rpartition("_")[2], ("a length", "'41 mm'"))
        raise InputError(f"{where}: {name}: expected {kind} with its unit, such as {example}, got {value!r}")
    return value


def _tolerance(
    flat: Mapping[str, Any], part: str, size: float, fields: Mapping[str, Any], where: str, element: Tolerance | None
) -> Tolerance:
    text, mean = (
        _with_unit(flat[name], name, name in fields, where) for name in (f"{part}_tolerance", f"{part}_offset")
    )
    field = read_zone(text, size, part in HOLES, f"{where}: {part}_tolerance")
    if f"{part}_tolerance" in fields and f"{part}_offset" not in fields and field.offset is not None:
        mean = None  # A fit that overrides the drawing's field overrides its offset too.
    default = clearance_offset(field.window, element) if part == "cage" and element is not None else 0.0
    return tolerance_from_zone(field, mean, text, f"{where}: {part}", default)


def _own_materials(tables: Any, where: str) -> dict[str, Material]:
    own = {}
    expect(isinstance(tables, Mapping), "tables [material.NAME]", tables, f"{where}: material")
    for name, table in tables.items():
        at = f"{where} [material.{name}]"
        expect(isinstance(table, Mapping), "a table", table, at)
        refuse_unknown(
            "field", table, ("name", "youngs_modulus", "poisson_ratio", "density", *_ALLOWABLE, "allowable_source"), at
        )
        for key in ("youngs_modulus", "poisson_ratio"):
            expect(key in table, f"the field {key!r}", "none", at)
        modulus, density = (
            parse_quantity(_with_unit(table.get(key, "7800 kg/m3"), key, False, at), quantity, f"{at}: {key}")
            for key, quantity in (("youngs_modulus", "pressure"), ("density", "density"))
        )
        try:
            allowable = {
                key: parse_quantity(_with_unit(table[key], key, False, at), "pressure", f"{at}: {key}")
                for key in _ALLOWABLE
                if key in table
            }
            own[name] = Material(
                table.get("name", name),
                modulus,
                table["poisson_ratio"],
                density,
                **allowable,
                allowable_source=table.get("allowable_source", ""),
            )
        except InputError as error:
            raise InputError(f"{where}: {error}") from None
    return own


def _material(value: Any, own: dict[str, Material], where: str) -> Material:
    if isinstance(value, Material):
        return value
    if not isinstance(value, str):
        raise UnknownNameError(f"{where}: expected a material's name, got {value!r}")
    return find_material(value, own, where)


def drive_to_dict(drive: Drive) -> dict[str, Any]:
    """The drawing as nested tables, such that `drive_from_dict` gives it back."""
    values: dict[str, Any] = {"name": drive.name, "description": drive.description}
    labels = material_labels(drive.materials[part] for part in PARTS)
    own = {label: m for m, label in labels.items() if MATERIALS.get(label) != m}
    if own:
        values["material"] = {
            label: {
                **({} if m.name == label else {"name": m.name}),
                "youngs_modulus": format_quantity(m.youngs_modulus, "pressure"),
                "poisson_ratio": m.poisson_ratio,
                "density": format_quantity(m.density, "density"),
                **{
                    key: format_quantity(value, "pressure")
                    for key in _ALLOWABLE
                    if (value := getattr(m, key)) is not None
                },
                **({"allowable_source": m.allowable_source} if m.allowable_source else {}),
            }
            for label, m in sorted(own.items())
        }
    written = {
        **_tolerance_texts(drive),
        **{f"{part}_material": labels[drive.materials[part]] for part in PARTS},
        **{name: format_quantity(getattr(drive, name), "length") for name in _LENGTHS},
        "max_twist": format_quantity(drive.max_twist, "angle"),
        **{name: getattr(drive, name) for name in (*COUNTS, "element", "transmission_ratio", "crank_deviation")},
    }
    for section, names in _SECTIONS.items():
        values[section] = {name: written[name] for name in names if name in written}
    # Only what is switched on: a plain drawing stays as it was.
    for section in _OPTIONS:
        switched = options.write_options(drive.beyond, section)
        if switched:
            values[section] = {**values.get(section, {}), **switched}
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
    """Write the drawing as TOML, whole or not at all; `load_drive` gives back an equal drive."""
    import tomli_w

    with atomic_file(path) as temporary:
        temporary.write_text(tomli_w.dumps(drive_to_dict(drive)), encoding="utf-8")
