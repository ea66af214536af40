"""The rooms stay small and their names unique, so that a file's place says what it does."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PACKAGES = ("stiffness_model", "reefmu")
MAX_FILES, MAX_LINES = 10, 250
SOURCES = (".py", ".c", ".h")
REPEATED_MODULES = {
    "effects": "the command is named after its word on the command line",
    "export": "the command is named after its word on the command line",
    "model": "the drive model, and the functions and variables of its FMU",
    "model_file": "reefmu.model_file is a published name of reefmu.model.model_file",
    "record": "the module of the room's main class",
}


def rooms() -> list[Path]:
    """All folders with sources."""
    return sorted(
        {path.parent for package in PACKAGES for path in (ROOT / package).rglob("*") if path.suffix in SOURCES}
    )


@pytest.mark.parametrize("room", rooms(), ids=lambda path: path.relative_to(ROOT).as_posix())
def test_a_room_has_few_files_of_moderate_length(room: Path) -> None:
    """`__init__`, which describes the room, does not count."""
    files = [path for path in room.iterdir() if path.suffix in SOURCES]
    assert len([path for path in files if path.name != "__init__.py"]) <= MAX_FILES
    lengths = {path.name: len(path.read_text("utf-8").splitlines()) for path in files}
    assert {name: lines for name, lines in lengths.items() if lines > MAX_LINES} == {}


@pytest.mark.parametrize("package", PACKAGES)
def test_module_names_are_unique_in_a_package(package: str) -> None:
    found: defaultdict[str, list[str]] = defaultdict(list)
    for path in (ROOT / package).rglob("*.py"):
        module = path.parent if path.name == "__init__.py" else path
        found[module.stem].append(module.relative_to(ROOT).as_posix())
    repeated = {name: places for name, places in found.items() if len(places) > 1 and name not in REPEATED_MODULES}
    assert repeated == {}


@pytest.mark.parametrize("package", PACKAGES)
def test_class_names_are_unique_in_a_package(package: str) -> None:
    found: defaultdict[str, list[str]] = defaultdict(list)
    for path in (ROOT / package).rglob("*.py"):
        for node in ast.parse(path.read_text("utf-8")).body:
            if isinstance(node, ast.ClassDef):
                found[node.name].append(path.relative_to(ROOT).as_posix())
    assert {name: places for name, places in found.items() if len(places) > 1} == {}


def test_array_types_are_named_once() -> None:
    """`stiffness_model.numerics.arrays` names the types of arrays; no other module makes an alias."""
    aliases = [
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in sorted((ROOT / package).rglob("*.py"))
        if re.search(r"(?m)^\w+(: \w+)? = NDArray\[", path.read_text("utf-8"))
    ]
    assert aliases == ["stiffness_model/numerics/arrays.py"]


def test_every_package_says_what_its_rooms_do() -> None:
    for package in PACKAGES:
        for path in (ROOT / package).rglob("__init__.py"):
            assert ast.get_docstring(ast.parse(path.read_text("utf-8"))), path
