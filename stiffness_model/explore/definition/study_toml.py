"""A design study from its TOML file, with every field checked.

`studies()` come with the package; `stiffness_model/studies/tolerance_field.toml` shows every field.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from ...errors import expect, refuse_unknown
from ...io.drawing_toml import read_table
from ...io.toml_files import packaged_names, read_named
from ...units import parse_quantity
from . import parameters
from .design import BESIDE, PACKING, Packing, base_drive, design_drive
from .metrics import METRICS
from .parameters import Value, read_parameter, read_size
from .study import BEST, KNEE, SENSES, Choice, Limit, Study, StudySettings

_HEAD = ("name", "description", "base")
_SECTIONS = ("fixed", "parameters", "constraints", "objectives", "numbers", "choose")
_NUMBERS: dict[str, tuple[int, int, int]] = {
    # minimum, maximum, default
    "designs": (1, 10_000_000, 1024),
    "drives": (1, 100_000, 100),
    "twists": (8, 1000, 31),
    "generations": (0, 100_000, 20),
    "population": (4, 100_000, 64),
    "seed": (0, 2**63, 0),
}


def studies() -> list[str]:
    """Names of the studies that come with the package.

    >>> studies()
    ['geometry', 'tolerance_field']
    """
    return packaged_names("studies")


def load_study(source: str | Path) -> Study:
    """A study from its name or its TOML file. The base drawing's path counts from the study's folder.

    Raises `InputError` with the file, the field, what was expected and what came.

    >>> load_study("tolerance_field").objectives["lost_motion"]
    'min'
    """
    return study_from_dict(*read_named(source, "studies", "study", "TOML study"))


def study_from_dict(table: Mapping[str, Any], where: str = "study", folder: Path = Path()) -> Study:
    """A study from its nested tables, as TOML gives them. Raises `InputError`."""
    refuse_unknown("section or field", table, (*_HEAD, *_SECTIONS), where)
    for name in _HEAD:
        expect(isinstance(table.get(name, ""), str), "a text", table.get(name), f"{where}: {name}")
    for section in _SECTIONS:
        expect(isinstance(table.get(section, {}), Mapping), f"a table [{section}]", table.get(section), where)
    expect("base" in table, "the field 'base', a preset or a drawing", "none", where)
    source = table["base"]
    base, at = read_table(str(folder / source) if source.endswith(".toml") else source)
    # Checked here, so that a message names the drawing and not the first design.
    base_drive(base, at)
    varied = tuple(
        read_parameter(name, value, f"{where} [parameters]") for name, value in table.get("parameters", {}).items()
    )
    expect(len(varied) > 0, "at least one parameter in [parameters]", "none", where)
    fixed = _fixed(table.get("fixed", {}), [p.name for p in varied], f"{where} [fixed]")
    packing, limits = _constraints(table.get("constraints", {}), f"{where} [constraints]")
    objectives = _objectives(table.get("objectives", {}), f"{where} [objectives]")
    study = Study(
        name=table.get("name", Path(where).stem),
        description=table.get("description", ""),
        base=base,
        parameters=varied,
        objectives=objectives,
        numbers=_numbers(table.get("numbers", {}), f"{where} [numbers]"),
        fixed=fixed,
        packing=packing,
        limits=limits,
        choice=_choice(table.get("choose", {}), objectives, f"{where} [choose]"),
    )
    _check_values(study, where)
    return study


def _fixed(table: Mapping[str, Any], varied: list[str], where: str) -> dict[str, Value]:
    refuse_unknown("field", table, parameters.FIELDS, where)
    fixed: dict[str, Value] = {}
    for name, value in table.items():
        expect(name not in varied, "a field that is not varied in [parameters]", name, where)
        fixed[name] = read_parameter(name, {"choices": [value]}, where).at(0.0)
    return fixed


def _constraints(table: Mapping[str, Any], where: str) -> tuple[Packing, tuple[Limit, ...]]:
    refuse_unknown("constraint", table, ("packs", "web", *METRICS), where)
    packs = table.get("packs", False)
    expect(
        packs is True or packs is False or packs in PACKING,
        f"true, false or {' or '.join(map(repr, PACKING))}",
        packs,
        f"{where} packs",
    )
    rule = BESIDE if packs is True else packs or ""
    web = read_size(table.get("web", 0), f"{where} web")
    expect(
        web >= 0 and (web == 0 or rule != ""),
        'a wall that is not negative, and packs = true or "seats" with it',
        table.get("web"),
        f"{where} web",
    )
    limits = tuple(_limit(name, value, where) for name, value in table.items() if name in METRICS)
    return Packing(rule, web), limits


def _limit(name: str, table: Any, where: str) -> Limit:
    at = f"{where} {name}"
    expect(isinstance(table, Mapping) and len(table) > 0, "a table such as { max = ... }", table, at)
    refuse_unknown("key", table, ("min", "max"), at)
    metric = METRICS[name]
    ends: dict[str, float] = {}
    for key, value in table.items():
        expect(
            not (metric.quantity and isinstance(value, (int, float)) and value != 0),
            f"a text with a unit, such as '1 {metric.display_unit}'",
            value,
            f"{at}: {key}",
        )
        number = parse_quantity(value, metric.quantity, f"{at}: {key}") if metric.quantity else value
        expect(
            isinstance(number, (int, float)) and not isinstance(number, bool) and math.isfinite(number),
            "a finite number",
            value,
            f"{at}: {key}",
        )
        ends[key] = float(number)
    low, high = ends.get("min", -math.inf), ends.get("max", math.inf)
    expect(low <= high, "min below max", table, at)
    return Limit(name, low, high)


def _objectives(table: Mapping[str, Any], where: str) -> dict[str, str]:
    refuse_unknown("objective", table, METRICS, where)
    expect(len(table) >= 2, "at least two objectives, between which there is a trade-off", list(table), where)
    for name, sense in table.items():
        expect(sense in SENSES, "'max' or 'min'", sense, f"{where} {name}")
    return dict(table)


def _numbers(table: Mapping[str, Any], where: str) -> StudySettings:
    refuse_unknown("number", table, ("torque", *_NUMBERS), where)
    expect("torque" in table, "the field 'torque', such as '200 N.m'", "none", where)
    expect(
        isinstance(table["torque"], str),
        "a torque with its unit, such as '200 N.m'",
        table["torque"],
        f"{where} torque",
    )
    torque = parse_quantity(table["torque"], "torque", f"{where} torque")
    expect(0 < torque < math.inf, "a positive torque", table["torque"], f"{where} torque")
    values: dict[str, int] = {}
    for name, (low, high, default) in _NUMBERS.items():
        value = table.get(name, default)
        expect(
            isinstance(value, int) and not isinstance(value, bool) and low <= value <= high,
            f"a whole number from {low} to {high}",
            value,
            f"{where} {name}",
        )
        values[name] = value
    expect(
        values["population"] <= values["designs"] or values["generations"] == 0,
        f"a population of at most the {values['designs']} designs it starts from",
        values["population"],
        f"{where} population",
    )
    return StudySettings(torque=torque, **values)


def _choice(table: Mapping[str, Any], objectives: Mapping[str, str], where: str) -> Choice:
    refuse_unknown("key", table, ("rule", "objective", "limits"), where)
    rule = table.get("rule", KNEE)
    expect(rule in (KNEE, BEST), f"the rule {KNEE!r} or {BEST!r}", rule, f"{where} rule")
    limits = table.get("limits", {})
    expect(isinstance(limits, Mapping), "a table [choose.limits]", limits, where)
    refuse_unknown("metric", limits, METRICS, f"{where} limits")
    objective = table.get("objective", "")
    expect(
        (objective in objectives) if rule == BEST else objective == "",
        f"one of the objectives {', '.join(objectives)}" if rule == BEST else "no objective with the rule 'knee'",
        objective,
        f"{where} objective",
    )
    return Choice(rule, objective, tuple(_limit(name, value, f"{where} limits") for name, value in limits.items()))


def _check_values(study: Study, where: str) -> None:
    """Put every text of the study into the base drawing once, so that a wrong one is found before any evaluation."""
    trials: list[tuple[str, Value, str]] = [(name, value, "fixed") for name, value in study.fixed.items()]
    trials += [(p.name, value, "parameters") for p in study.parameters for value in p.values]
    for name, value, section in trials:
        if parameters.FIELDS[name].is_named or (isinstance(value, str) and value != parameters.FILL):
            design_drive(study.base, {name: value}, study.packing, f"{where} [{section}]", check=False)
