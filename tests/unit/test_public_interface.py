"""The public functions: every argument is documented with its unit or shape, and unknown names are refused."""

from __future__ import annotations

import inspect
import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest

import reefmu
import stiffness_model as sm
from reefmu.model import DriveModel, build_model
from stiffness_model.drawing.fields import Field
from stiffness_model.errors import UnknownNameError
from stiffness_model.units import UNITS
from tests.unit.test_docs import PAGES

UNIT_NAMES = {
    *(unit for units in UNITS.values() for unit in units),
    *("rad", "rad/s", "degC", "kg.m2", "N.m.s/rad", "N.m/rad", "N.m", "N", "Pa", "s", "m", "in SI"),
}
SHAPE = re.compile(r"\((\w[\w, ]*,\s?\w*|any)\)")
DIMENSIONLESS = re.compile(r"\b(exponent|factor|share|ratio|probability|number|relative|any unit)\b")


def public_objects() -> dict[str, Any]:
    """Functions and classes by the names under which the packages and the pages of the documentation offer them."""
    found = {
        f"{package.__name__}.{name}": getattr(package, name) for package in (sm, reefmu) for name in package.__all__
    }
    text = "\n".join(page.read_text("utf-8") for page in PAGES)
    for module, names in re.findall(r"^from ((?:reefmu|stiffness_model)[\w.]*) import (.+)$", text, re.MULTILINE):
        imported = __import__(module, fromlist=["*"])
        found |= {f"{module}.{name}": getattr(imported, name) for name in names.split(", ")}
    return {name: thing for name, thing in found.items() if callable(thing)}


def documented_callables() -> Iterator[tuple[str, Callable[..., Any]]]:
    """The public functions and classes, and the public methods of these classes; exceptions have no arguments."""
    for name, thing in public_objects().items():
        if inspect.isclass(thing) and issubclass(thing, BaseException):
            continue
        yield name, thing
        if inspect.isclass(thing):
            for method, function in vars(thing).items():
                if inspect.isfunction(function) and not method.startswith("_"):
                    yield f"{name}.{method}", function


CALLABLES = dict(documented_callables())


def docstrings(function: Callable[..., Any]) -> list[str]:
    """The docstring of a function, or those of the classes that a class inherits from, then its own."""
    parts = reversed(inspect.getmro(function)[:-1]) if inspect.isclass(function) else (function,)
    return [part.__doc__ or "" for part in parts]


def undocumented(function: Callable[..., Any]) -> list[str]:
    """Arguments that the docstring does not name, and quantities and arrays whose unit or shape it does not state.

    A field of a drawing states its meaning and quantity in its declaration (`Field`); a class inherits fields with the
    text that documents them.
    """
    text = " ".join(re.sub(r"\s+", " ", part.split(">>>")[0]) for part in docstrings(function))
    missing: list[str] = []
    for parameter in inspect.signature(function).parameters.values():
        kind = str(parameter.annotation)
        if parameter.name == "self" or f"{Field.__name__}(" in kind:
            continue
        name = re.search(rf"(?<![\w.]){parameter.name}(?!\w)", text)
        if name is None:
            missing.append(parameter.name)
            continue
        near = text[max(0, name.start() - 120) : name.end() + 300]
        if re.search(r"\b(Array|ArrayLike|NDArray)\b", kind) and not SHAPE.search(near):
            missing.append(f"{parameter.name}: shape")
        is_quantity = re.search(r"\b(float|Array|ArrayLike|NDArray)\b", kind) and "Mapping" not in kind
        if is_quantity and not has_unit(near) and not DIMENSIONLESS.search(near):
            missing.append(f"{parameter.name}: unit")
    return missing


def has_unit(text: str) -> bool:
    return any(re.search(rf"(?<![\w.]){re.escape(unit)}(?![\w/])", text) for unit in UNIT_NAMES if unit)


@pytest.mark.parametrize("name", CALLABLES)
def test_every_argument_is_documented_with_its_unit_or_shape(name: str) -> None:
    assert inspect.getdoc(CALLABLES[name])
    assert undocumented(CALLABLES[name]) == []


def test_the_rule_finds_what_is_missing() -> None:
    def force(twist: float, angles: Array, count: int) -> float:  # type: ignore[name-defined]  # noqa: F821
        """Force at a twist. angles: of the drive."""
        return twist

    assert undocumented(force) == ["twist: unit", "angles: shape", "angles: unit", "count"]


def test_no_function_swallows_an_unknown_keyword(model: DriveModel) -> None:
    """Functions with free keywords suggest a name; Python refuses the keyword of any other function."""
    table = sm.drive_to_dict(sm.load_drive("drive_1"))
    calls: dict[str, Callable[[], object]] = {
        "stiffness_model.load_drive": lambda: sm.load_drive("drive_1", lobs=28),
        "stiffness_model.drive_from_dict": lambda: sm.drive_from_dict(table, lobs=28),
        "reefmu.DriveModel.with_parameters": lambda: model.with_parameters(rato=29.0),
    }
    free = {
        name
        for name, function in CALLABLES.items()
        if any(p.kind is p.VAR_KEYWORD for p in inspect.signature(function).parameters.values())
    }
    assert free == set(calls)
    for call in calls.values():
        with pytest.raises(UnknownNameError, match=r"did you mean '(lobes|ratio)'"):
            call()


@pytest.mark.parametrize(
    ("effects", "message"),
    [
        ({"hysteresys": {}}, "did you mean 'hysteresis'"),
        ({"hysteresis": {"torqe": 1.0}}, "did you mean 'hysteresis.torque'"),
    ],
)
def test_unknown_effects_and_parameters_are_refused(effects: dict[str, dict[str, float]], message: str) -> None:
    with pytest.raises(UnknownNameError, match=message):
        build_model("drive_1", effects)
