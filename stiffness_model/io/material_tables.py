"""The materials of a drawing: its tables [material.NAME], and the names that its parts refer to."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from ..drawing.fields import REQUIRED, fields_of
from ..drawing.material_library import MATERIALS, find_material
from ..drawing.materials import Material
from ..errors import InputError, UnknownNameError, expect, refuse_unknown

FIELDS = fields_of(Material)
"""Every key of a table [material.NAME]."""


def read_materials(tables: object, where: str) -> dict[str, Material]:
    """The drawing's own materials by the names of their tables [material.NAME]. Raises `InputError`.

    >>> read_materials({"POM": {"youngs_modulus": "2.8 GPa", "poisson_ratio": 0.35}}, "mine.toml")["POM"].density
    7800.0
    """
    expect(isinstance(tables, Mapping), "tables [material.NAME]", tables, f"{where}: material")
    assert isinstance(tables, Mapping)
    return {name: _read_material(name, table, where) for name, table in tables.items()}


def _read_material(name: str, table: Any, where: str) -> Material:
    at = f"{where} [material.{name}]"
    expect(isinstance(table, Mapping), "a table", table, at)
    refuse_unknown("field", table, FIELDS, at)
    values: dict[str, Any] = {"name": name, "density": FIELDS["density"].default}
    for key, field in FIELDS.items():
        if key in table:
            values[key] = field.read(table[key], at)
        else:
            expect(key in values or field.default is not REQUIRED, f"the field {key!r}", "none", at)
    try:
        return Material(**values)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None


def material_named(value: object, own: Mapping[str, Material], where: str) -> Material:
    """The material itself, or the one of that name. Raises `InputError`. own: the drawing's own materials."""
    if isinstance(value, Material):
        return value
    if not isinstance(value, str):
        raise UnknownNameError(f"{where}: expected a material's name, got {value!r}")
    return find_material(value, own, where)


def write_materials(labels: Mapping[Material, str]) -> dict[str, dict[str, Any]]:
    """The tables [material.NAME] of the materials that do not come with the package, by their labels."""
    own = {label: material for material, label in labels.items() if MATERIALS.get(label) != material}
    return {label: dict(_written(label, material)) for label, material in sorted(own.items())}


def _written(label: str, material: Material) -> Iterable[tuple[str, Any]]:
    for key, field in FIELDS.items():
        value = getattr(material, key)
        if not (value == label if key == "name" else value in (None, "")):
            yield key, field.write(value)
