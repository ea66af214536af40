"""The table of a drawing's fields: what it declares holds, and one entry is all that a new field needs."""

from __future__ import annotations

import math
import pickle
import shutil
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import pytest

import stiffness_model as sm
from stiffness_model.drawing.drive import FIELDS
from stiffness_model.drawing.fields import COUNT, MATERIAL, NUMBER, OFFSET, REQUIRED, TOLERANCE, Field, fields_of
from stiffness_model.drawing.materials import Material
from stiffness_model.units import UNITS
from tests.small_study import study

PLAIN = {name: field for name, field in FIELDS.items() if field.quantity not in (MATERIAL, OFFSET, TOLERANCE)}


@pytest.mark.parametrize("name", PLAIN)
def test_example_and_default_are_values_that_are_read_checked_and_written(name: str) -> None:
    field = PLAIN[name]
    example = field.example or field.choices[-1]
    for stated in (example, *([] if field.default is REQUIRED else [field.write(field.default)])):
        value = field.read(field.parse(str(stated)), "mine.toml")
        assert field.read(field.parse(str(field.write(value))), "mine.toml") == value
    if field.has_unit:
        assert field.unit in UNITS[field.quantity]
        with pytest.raises(
            sm.InputError, match=f"^mine.toml: {name}: expected an? .* unit, such as '{example}', got 3"
        ):
            field.read(3, "mine.toml")
    with pytest.raises(sm.InputError, match=f"^mine.toml: {name}: "):
        field.read(["a list"], "mine.toml")


@pytest.mark.parametrize("field", [*FIELDS.values(), *fields_of(Material).values()], ids=lambda f: f.name)
def test_a_bad_number_is_refused_by_the_field_s_own_check(field: Field) -> None:
    if field.quantity in UNITS or field.quantity in (COUNT, NUMBER):
        for value in (math.nan, -2, True):
            with pytest.raises(sm.InputError, match=field.name):
                field.checked(value, "mine.toml")


ENTRY = """    seal_friction: Annotated[
        float, Field("torque", "bodies", "Friction torque of the seals.", "2 N.m", varies=True)
    ] = 0.0
"""
USE = """
import stiffness_model as sm
from stiffness_model.drawing.drive import FIELDS
from stiffness_model.explore.definition.parameters import read_parameter
from stiffness_model.io.drawing_format import markdown

assert sm.__file__.startswith({folder!r}), sm.__file__
table = sm.drive_to_dict(sm.load_drive("workshop"))
table["bodies"] = {{"seal_friction": "2 N.m"}}
drive = sm.drive_from_dict(table, "mine.toml")
assert drive.beyond.seal_friction == 2.0
assert sm.drive_to_dict(drive)["bodies"] == {{"seal_friction": "2 N.m"}}
assert sm.drive_from_dict(sm.drive_to_dict(drive)) == drive
assert sm.load_drive("workshop", seal_friction=FIELDS["seal_friction"].parse("3 N.m")).beyond.seal_friction == 3.0
for section, key, value in (
    ("bodies", "seal_friction", 2),
    ("bodies", "seal_friction", "-2 N.m"),
    ("bodies", "seal_frction", "2 N.m"),
    ("contacts", "seal_friction", "2 N.m"),
):
    try:
        sm.drive_from_dict({{**table, "bodies": {{}}, section: {{key: value}}}}, "mine.toml")
    except sm.InputError as error:
        print(error)
parameter = read_parameter("seal_friction", {{"from": "1 N.m", "to": "3 N.m", "step": "1 N.m"}}, "study")
print(parameter.values, parameter.unit, parameter.display_unit, parameter.text(0.5))
print(*(line for line in markdown().splitlines() if "`seal_friction` |" in line))
"""
EXPECTED = """\
mine.toml: seal_friction: expected a torque with its unit, such as '2 N.m', got 2
mine.toml: seal_friction: expected a torque from zero on, got -2.0
mine.toml [bodies]: unknown field 'seal_frction'; did you mean 'seal_friction'?
mine.toml [contacts]: expected seal_friction under [bodies], got it here
(1.0, 2.0, 3.0) N.m N.m 2 N.m
| `seal_friction` | torque | 0 N.m | `"2 N.m"` | Friction torque of the seals. |
"""


def test_a_field_is_one_entry(tmp_path: Path) -> None:
    """A copy of the package with one more annotated attribute reads, checks, writes, varies and documents it."""
    package = Path(sm.__file__).parent
    shutil.copytree(package, tmp_path / "stiffness_model", ignore=shutil.ignore_patterns("__pycache__"))
    options = tmp_path / "stiffness_model" / "drawing" / "options.py"
    text = options.read_text("utf-8")
    assert text.count("    def __post_init__") == 1
    options.write_text(text.replace("    def __post_init__", f"{ENTRY}\n    def __post_init__"), "utf-8")
    # PYTHONPATH would not do: the finder of an editable installation comes before it.
    (tmp_path / "use.py").write_text(
        "import sys\nsys.meta_path = [f for f in sys.meta_path if 'ditable' not in repr(f)]\n"
        + USE.format(folder=str(tmp_path)),
        "utf-8",
    )
    done = subprocess.run([sys.executable, str(tmp_path / "use.py")], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    assert done.stdout == EXPECTED


def test_drives_materials_and_studies_are_keys_of_a_dictionary() -> None:
    drive, same = sm.load_drive("drive_1"), sm.load_drive("drive_1")
    assert {drive: 1}[same] == 1
    assert {drive, same, sm.load_drive("drive_2")} == {drive, sm.load_drive("drive_2")}
    assert hash(pickle.loads(pickle.dumps(drive))) == hash(drive)
    changed = replace(drive, tolerances={**drive.tolerances, "gear": sm.Tolerance(50e-6)})
    assert changed != drive
    assert changed.tolerances["cage"] == drive.tolerances["cage"]
    assert len({material: name for name, material in sm.MATERIALS.items()}) == len(sm.MATERIALS)
    assert {study(): 1}[study()] == 1
    assert study(seed=4) not in {study()}


def test_a_drive_s_mappings_do_not_change() -> None:
    own = dict(sm.load_drive("drive_1").materials)
    drive = replace(sm.load_drive("drive_1"), materials=own)
    own["gear"] = sm.MATERIALS["PLA"]
    assert drive.materials["gear"].name == "100Cr6"
    with pytest.raises(TypeError):
        drive.materials["gear"] = sm.MATERIALS["PLA"]  # type: ignore[index]
    with pytest.raises(TypeError):
        study().base["geometry"]["lobes"] = 28  # type: ignore[index]
