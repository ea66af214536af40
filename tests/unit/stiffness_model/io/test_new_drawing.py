"""A new drawing has every field of its kind, and is the kind's example under another name."""

from __future__ import annotations

import re
import tomllib

import pytest

import stiffness_model as sm
from stiffness_model.drawing.fields import TEXT, fields_of
from stiffness_model.io.new_drawing import new_drawing
from stiffness_model.kinds import KINDS, Kind
from stiffness_model.units import UNITS

ALL = list(KINDS.values())
LINE = re.compile(r"^(#?)(\w+) = (.*)$", re.MULTILINE)


@pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.name)
def test_it_is_the_example_under_its_own_name(kind: Kind) -> None:
    """But for its texts, which state what the example is and whence its numbers are."""
    table = tomllib.loads(new_drawing(kind, 'my "drive"'))
    example = sm.load_drive(kind.example, name='my "drive"')
    texts = {name: getattr(example, name) for name, field in kind.fields.items() if field.quantity == TEXT}
    assert sm.drive_from_dict(table, **texts) == example
    own = {name: value for name, value in texts.items() if value and name != "name"}
    assert own
    for name in own:
        assert table.get(name, "REPLACE: ").startswith("REPLACE: ")


def test_the_source_of_a_data_sheet_is_to_be_replaced() -> None:
    text = new_drawing(KINDS["catalogue"], "mine")
    assert 'source = "REPLACE: Document and page from which the numbers are."' in text
    assert '#maker = "' in text
    assert "default 0 arcmin" not in text


@pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.name)
def test_every_field_is_stated_or_commented_out_once_with_its_meaning(kind: Kind) -> None:
    text = new_drawing(kind, "mine")
    drawing = re.split(r"\n#?\[(?:material\.|sources)", text)[0]
    words = " ".join(text.replace("\n# ", " ").split())
    lines = [name for _, name, _ in LINE.findall(drawing) if name in kind.fields]
    assert sorted(lines) == sorted(kind.fields)
    for field in kind.fields.values():
        assert f"{field.doc} (" in words
        if field.quantity in UNITS:
            assert f"#   {field.quantity}: " in text
    if "[material." in text:
        assert [name for _, name, _ in LINE.findall(text.split("[material.")[1])] == list(fields_of(sm.Material))


@pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.name)
def test_each_field_that_is_commented_out_can_be_stated(kind: Kind) -> None:
    """But `stiffness`, which replaces k1; an offset needs a tolerance beside it that states none."""
    text = new_drawing(kind, "mine")
    drawing = re.split(r"\n#?\[(?:material\.|sources)", text)[0]
    hidden = [name for sign, name, _ in LINE.findall(drawing) if sign and name in kind.fields and name != "stiffness"]
    assert hidden
    for name in hidden:
        beside = {name.replace("_offset", "_tolerance"): "13 um"} if name.endswith("_offset") else {}
        beside |= {"ratio": 51} if name == "ratio_range" else {}
        table = tomllib.loads(text.replace(f"\n#{name} = ", f"\n{name} = ", 1))
        assert sm.drive_from_dict(table, "mine.toml", **beside).name == "mine", name


def test_the_tables_of_a_data_sheet_can_be_uncommented() -> None:
    text = new_drawing(KINDS["catalogue"], "mine")
    head, tables = text.split("#[sources]")
    drive = sm.drive_from_dict(tomllib.loads(head + "[sources]" + re.sub(r"(?m)^#(?=[\w\[])", "", tables)))
    assert drive.source_of("k1") == "own measurement"
    assert drive.efficiency.value[0] == (0.5, 0.75)


@pytest.mark.parametrize("kind", ALL, ids=lambda kind: kind.name)
def test_lines_are_no_longer_than_code(kind: Kind) -> None:
    """But for values, which TOML cannot break."""
    lines = new_drawing(kind, "mine").splitlines()
    assert [line for line in lines if len(line) > 120 and line.startswith("# ")] == []
