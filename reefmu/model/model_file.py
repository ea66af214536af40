"""model.toml: a drive model as a file to read, edit and export.

schema = 1
[drawing]            the drawing, as in its own TOML file
[lookup]             number of virtual drives and seed of the tables
[curve]              instead of both, for a gear without a drawing: its twist-torque curve and its ratio, which is
                     missing where a diagnosis did not find it, because the crank was locked
[model]              band, or the seed of an individual drive instead of the mean of all
[effects.NAME]       parameters with units, such as clearance = "5 um"
[record]             of a diagnosed record: twist_zero, the twist that its encoders show at zero twist of the model
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from concurrent.futures import Executor
from dataclasses import replace
from pathlib import Path
from typing import Any

import tomli_w

from stiffness_model.drawing.sampling import check_seed
from stiffness_model.errors import InputError, expect, expect_number, refuse_unknown, unknown_name
from stiffness_model.io.atomic_files import atomic_file
from stiffness_model.io.drawing_toml import drive_from_dict, drive_to_dict
from stiffness_model.io.toml_files import parse_toml
from stiffness_model.lookup.build_lookup import N_DRIVES, Lookup
from stiffness_model.lookup.curve_lookup import CurveLookup, curve_lookup_from_dict
from stiffness_model.units import parse_quantity, quantity_of

from ..effects import Parameter, find_effect
from .contacts.curve_contacts import source_curve
from .drive_model import DriveModel, build_curve_model, build_model, describe_effects

SCHEMA = 1
_SECTIONS = ("schema", "drawing", "lookup", "curve", "model", "effects", "record")


def save_model(model: DriveModel, path: str | os.PathLike[str]) -> None:
    """Write `model` to `path` (model.toml) atomically; `load_model` reads the same model from it, to the bit."""
    with atomic_file(path) as temporary:
        temporary.write_text(model_text(model), encoding="utf-8")


def model_text(model: DriveModel) -> str:
    """The text of model.toml."""
    units = {p.name: p.unit for p in model.parameters}
    values = {p.name: p.value for p in model.parameters}
    curve = source_curve(model.lookup)
    origin = (
        {"curve": dict(curve)}
        if curve is not None
        else {
            "drawing": drive_to_dict(model.drive),
            "lookup": {"drives": model.lookup.n_drives, "seed": model.lookup.seed},
        }
    )
    table = {
        "schema": SCHEMA,
        **origin,
        "model": {"band": values["band"]} if model.individual is None else {"individual": model.individual.seed},
        "effects": {
            effect: {name: f"{value!r} {units[f'{effect}.{name}']}" for name, value in parameters.items()}
            for effect, parameters in describe_effects(model).items()
        },
        **({"record": {"twist_zero": f"{model.twist_zero!r} rad"}} if model.twist_zero else {}),
    }
    return tomli_w.dumps(table)


def load_model(
    path: str | os.PathLike[str],
    lookup: Lookup | str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    ratio: float | None = None,
) -> DriveModel:
    """The model of the file model.toml at `path`.

    lookup: a `Lookup` or the path of one; else the tables come from the cache or are built, by `executor` if given.
    ratio: of a curve, signed, crank to output, in place of the file's.
    Raises `InputError` for a file that is not a model, `UnknownNameError` for unknown sections, fields and effects.
    """
    where = str(path)
    try:
        text = Path(path).read_text("utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{where}: expected a model in TOML, got {error}") from None
    table = parse_toml(text, where, "a model in TOML")
    refuse_unknown("section", table, _SECTIONS, where)
    expect(table.get("schema") == SCHEMA, f"schema = {SCHEMA}", table.get("schema"), where)
    ready = lookup if lookup is None or isinstance(lookup, Lookup) else Lookup.load(lookup)
    model = _section(table, "model", where)
    refuse_unknown("field", model, ("band", "individual"), f"{where} [model]")
    if "individual" in model:
        expect("band" not in model, "no band beside an individual", model.get("band"), f"{where} [model]")
        check_seed(model["individual"], f"{where} [model] individual")
    effects = {name: _effect_values(name, values, where) for name, values in _section(table, "effects", where).items()}
    if "curve" in table:
        expect(
            "drawing" not in table and "lookup" not in table,
            "a [curve], or a [drawing] with its [lookup]",
            "both",
            where,
        )
        expect("individual" not in model, "no individual of a curve", model.get("individual"), f"{where} [model]")
        stated = {**_section(table, "curve", where), **({} if ratio is None else {"ratio": ratio})}
        curve = curve_lookup_from_dict(stated, f"{where} [curve]")
        built = build_curve_model(ready if isinstance(ready, CurveLookup) else curve, effects)
    else:
        expect(ratio is None, "a ratio for a [curve] only, since a [drawing] states its own", ratio, where)
        drive = drive_from_dict(_section(table, "drawing", where), where)
        settings = _section(table, "lookup", where)
        refuse_unknown("field", settings, ("drives", "seed"), f"{where} [lookup]")
        built = build_model(
            drive,
            effects,
            lookup=ready,
            n_drives=settings.get("drives", N_DRIVES),
            seed=settings.get("seed", 0),
            executor=executor,
            individual=model.get("individual"),
            inherent=False,
        )
    return replace(built.with_parameters(band=model.get("band", 0.0)), twist_zero=_twist_zero(table, where))


def is_model_file(path: str | os.PathLike[str]) -> bool:
    """Whether a TOML file is a model, with a section [drawing] or [curve], and not itself a drawing."""
    try:
        return not {"drawing", "curve"}.isdisjoint(parse_toml(Path(path).read_text("utf-8"), str(path)))
    except (OSError, UnicodeDecodeError, InputError):
        return False


def _twist_zero(table: Mapping[str, Any], where: str) -> float:
    """rad, of the section [record]; 0 without one."""
    section = _section(table, "record", where)
    refuse_unknown("field", section, ("twist_zero",), f"{where} [record]")
    if "twist_zero" not in section:
        return 0.0
    at, value = f"{where} [record] twist_zero", section["twist_zero"]
    expect(isinstance(value, str), "a text with its unit, such as '1 mrad'", value, at)
    return parse_quantity(value, "angle", at)


def _section(table: Mapping[str, Any], name: str, where: str) -> Mapping[str, Any]:
    section = table.get(name, {})
    expect(isinstance(section, Mapping), f"a table [{name}]", section, where)
    return section


def _effect_values(name: str, values: Any, where: str) -> dict[str, float]:
    effect = find_effect(name, where)
    at = f"{where} [effects.{name}]"
    expect(isinstance(values, Mapping), "a table of parameters", values, at)
    known = {p.name: p for p in effect.parameters}
    refuse_unknown("parameter", values, known, at)
    return {key: parse_parameter(value, known[key], f"{at}: {key}") for key, value in values.items()}


def parse_parameter(value: Any, parameter: Parameter, where: str) -> float:
    """The SI value of an effect's parameter from a text with its unit, such as "5 um" or "3e-6 rad/(N.m)".

    Quantities of drawings and rigs may have all their units; a dimensionless parameter may be a number. where: the
    place in the file, for errors. Raises `InputError` or `UnknownNameError` for other values and units.
    """
    quantity = quantity_of(parameter.unit)
    if parameter.unit == "1" and isinstance(value, (int, float)):
        return expect_number(value, "a finite number", where)
    if quantity is not None:
        expect(isinstance(value, str), f"a text with its unit, such as '1 {parameter.unit}'", value, where)
        return parse_quantity(value, quantity, where)
    match = re.fullmatch(r"\s*([+-]?[\d.]++(?:[eE][+-]?\d++)?+)\s*(.*\S)\s*", value) if isinstance(value, str) else None
    expect(match is not None, f"a text with its unit, such as '1 {parameter.unit}'", value, where)
    assert match is not None
    if match[2] != parameter.unit:
        raise unknown_name("unit", match[2], [parameter.unit], where)
    return float(match[1])
