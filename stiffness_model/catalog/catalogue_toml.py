"""A catalogue drive as TOML: in, with every field checked, out, and from the rows that come with the package."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

import numpy as np

from ..drawing.fields import REQUIRED, FurtherKey
from ..errors import InputError, expect, refuse_unknown
from ..frozen_mapping import FrozenMapping
from ..kinds import CATALOGUE
from ..lookup.curve_lookup import expect_curve
from ..units import format_quantity
from .catalogue_drive import FIELDS, CatalogueDrive
from .efficiency_table import quantities, read_efficiency, write_efficiency
from .gears import CatalogGear, catalog

FURTHER_KEYS: Mapping[str, FurtherKey] = FrozenMapping(
    {
        "twist": FurtherKey(
            "list of angles",
            "Twists of the points of a curve, in place of stiffnesses.",
            'twist = ["0 arcmin", "2 arcmin"]',
        ),
        "torque": FurtherKey("list of torques", "Torques at these points.", 'torque = ["0 N.m", "60 N.m"]'),
        "upper_limits": FurtherKey(
            "list of fields", "Fields whose value is an upper limit.", 'upper_limits = ["lost_motion"]'
        ),
        "sources": FurtherKey(
            "table of texts",
            "Sources of single fields, where they are not `source`.",
            '[sources]\nk1 = "own measurement"',
        ),
        "efficiency": FurtherKey(
            "table of lists",
            "Efficiency over the crank's speed, one row for each, and the torque at the output.",
            '[efficiency]\nspeed = ["500 rpm", "2000 rpm"]\ntorque = ["50 N.m", "265 N.m"]\n'
            "value = [[0.5, 0.75], [0.4, 0.7]]",
        ),
    }
)
"""Keys of a drawing beside `FIELDS`."""
TABLES = tuple(FURTHER_KEYS)
_LIMIT = re.compile(r"\s*(?:<=?|≤|below|max\.?)\s*(.*\S)\s*")
"""An upper limit as sheets print it."""
_STIFFNESSES = ("k1", "k2", "k3", "t1", "t2", "stiffness")
_OF_ROW = ("maker", "type", "source", *_STIFFNESSES, "rated_torque", "acceleration_torque", "momentary_torque")
_BELOW = {
    "lost_motion": "lost_motion_below",
    "hysteresis_loss": "hysteresis_below",
    "transmission_accuracy": "transmission_accuracy_below",
}
_RATIO_REMEDY = "; state it with its sign, as a field of the file, with --set ratio=... or as a keyword of load_drive"


def read_catalogue(table: Mapping[str, Any], where: str = "drawing", **fields: Any) -> CatalogueDrive:
    """A catalogue drive from its table; keywords override its fields.

    K1, T1, ... may be capitals, as sheets write them. Raises `InputError` with the field, what was expected and what
    came; `UnknownNameError` for a field that does not exist.
    """
    stated: dict[str, Any] = {}
    for key, value in table.items():
        name = key.lower() if key.lower() in FIELDS else key
        expect(name not in stated, f"{name} once", f"it and {key}", where)
        stated[name] = value
    stated.pop("kind", None)
    refuse_unknown("field", stated, (*FIELDS, *TABLES), where)
    refuse_unknown("field", fields, FIELDS, where)
    for name, value in {**stated, **fields}.items():
        _refuse_limit(name, value, where)
    points = _points(stated, where)
    values = {
        name: FIELDS[name].read({**stated, **fields}[name], where, from_code=name in fields)
        for name in FIELDS
        if name in stated or name in fields
    }
    for name, declared in FIELDS.items():
        if declared.default is REQUIRED and name not in values:
            only = f" ({values['ratio_range']})" if name == "ratio" and values.get("ratio_range") else ""
            remedy = _RATIO_REMEDY if name == "ratio" else ""
            raise InputError(f"{where}: expected the field {name!r}{only}, got none{remedy}")
    limits, sources = stated.get("upper_limits", []), stated.get("sources", {})
    expect(isinstance(limits, list), "a list of field names", limits, f"{where}: upper_limits")
    expect(isinstance(sources, Mapping), "a table [sources]", sources, f"{where}: sources")
    refuse_unknown("field", limits, FIELDS, f"{where}: upper_limits")
    refuse_unknown("field", sources, (*FIELDS, *TABLES), f"{where} [sources]")
    for name, text in sources.items():
        expect(isinstance(text, str), "a text", text, f"{where} [sources] {name}")
    efficiency = stated.get("efficiency")
    return CatalogueDrive(
        **values,
        twist=points[0],
        torque=points[1],
        upper_limits=tuple(limits),
        sources=sources,
        efficiency=None if efficiency is None else read_efficiency(efficiency, f"{where} [efficiency]"),
        where=where,
    )


def _refuse_limit(name: str, value: object, where: str) -> None:
    """Raise `InputError` for an upper limit as sheets print it, such as "<1 arcmin", with how a drawing states it."""
    if name in FIELDS and FIELDS[name].has_unit and isinstance(value, str) and (limit := _LIMIT.fullmatch(value)):
        raise InputError(
            f"{where}: {name}: expected a number with its unit, got {value!r}; an upper limit is stated as "
            f'{name} = "{limit[1]}" and upper_limits = ["{name}"]'
        )


def _points(stated: Mapping[str, Any], where: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """The table of twist, rad, and torque, N.m; empty without one."""
    if "twist" not in stated and "torque" not in stated:
        return (), ()
    for name in ("twist", "torque"):
        expect(name in stated, "twist and torque together", f"no {name}", where)
    twist = quantities(stated["twist"], "angle", f"{where}: twist")
    torque = quantities(stated["torque"], "torque", f"{where}: torque")
    expect_curve(np.array(twist), np.array(torque), where, least=2)
    zero = float(np.interp(0.0, twist, torque)) if twist[0] < 0 else 0.0 if twist[0] > 0 else torque[0]
    expect(abs(zero) <= 1e-9 * max(map(abs, torque)), "a curve without torque at zero twist", f"{zero:g} N.m", where)
    return twist, torque


def write_catalogue(drive: CatalogueDrive) -> dict[str, Any]:
    """The table of a catalogue drive, which `read_catalogue` reads back."""
    values: dict[str, Any] = {"kind": CATALOGUE}
    for name, declared in FIELDS.items():
        value = getattr(drive, name)
        if value not in (None, ""):
            values[name] = declared.write(value)
    if drive.twist:
        values["twist"] = [format_quantity(value, "angle") for value in drive.twist]
        values["torque"] = [format_quantity(value, "torque") for value in drive.torque]
    if drive.upper_limits:
        values["upper_limits"] = list(drive.upper_limits)
    if drive.sources:
        values["sources"] = dict(drive.sources)
    if drive.efficiency is not None:
        values["efficiency"] = write_efficiency(drive.efficiency)
    return values


def packaged_gear(name: str) -> dict[str, Any] | None:
    """The table of a row of the package by its `CatalogGear.name`; None if there is none.

    A row that holds for a range of ratios also takes TYPE-RATIO with a ratio of that range.

    >>> packaged_gear("CHA-40A-50")["k1"], packaged_gear("CHA-40A-120")["ratio"], packaged_gear("drive_1")
    ('100 kN.m/rad', 120, None)
    """
    gears = {gear.name: gear for gear in catalog()}
    if name in gears:
        return table_of_row(gears[name])
    stem, _, ratio = name.rpartition("-")
    row = gears.get(stem)
    if row is None or not row.ratio.startswith("above ") or not ratio.isdecimal():
        return None
    return {**table_of_row(row), "name": name, "ratio": int(ratio)}


def packaged_gear_names() -> list[str]:
    """The names of the rows that come with the package and state a curve, without which a row is no drive."""
    return [gear.name for gear in catalog() if gear.has_curve]


def table_of_row(gear: CatalogGear) -> dict[str, Any]:
    """The table of a drawing that a row of a catalogue makes; without a ratio where the row does not state one."""
    table: dict[str, Any] = {"kind": CATALOGUE, "name": gear.name, "gear_type": gear.kind}
    for name in _OF_ROW:
        if getattr(gear, name) is not None:
            table[name] = FIELDS[name].write(getattr(gear, name))
    for name, attribute in _BELOW.items():
        if getattr(gear, attribute) is not None:
            table[name] = FIELDS[name].write(getattr(gear, attribute))
            table.setdefault("upper_limits", []).append(name)
    if gear.page:
        table["source"] += f", page {gear.page}"
    table["note"] = "; ".join(
        [*(["quoted at second hand"] if gear.second_hand else []), *([gear.note] if gear.note else [])]
    )
    if gear.name != gear.type:
        table["ratio"] = int(gear.ratio) if float(gear.ratio).is_integer() else float(gear.ratio)
    elif gear.ratio:
        table["ratio_range"] = gear.ratio
    return table
