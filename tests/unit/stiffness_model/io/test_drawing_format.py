"""The documentation of drawings is that of the declared fields."""

from __future__ import annotations

from pathlib import Path

from stiffness_model.drawing.drive import FIELDS
from stiffness_model.io.drawing_format import markdown, table
from stiffness_model.kinds import KINDS, ROLLING_ELEMENT_ECCENTRIC

PAGE = Path(__file__).parents[4] / "docs/reference/drawing_format.md"


def test_the_page_is_not_stale() -> None:
    remedy = "python -m stiffness_model.io.drawing_format > docs/reference/drawing_format.md"
    assert PAGE.read_text("utf-8") == markdown(), remedy


def test_every_key_of_a_data_sheet_has_a_line() -> None:
    page = markdown().split('## Kind "catalogue"')[1]
    keys = [line.split("`")[1].strip("[]") for line in page.splitlines() if line.startswith("| `")]
    assert set(keys) >= {*KINDS["catalogue"].fields, "twist", "torque", "upper_limits", "sources", "efficiency"}
    assert "| `max_twist` | angle |  | " in page


def test_the_introduction_names_every_other_kind_of_drive() -> None:
    introduction = PAGE.read_text("utf-8").split("\n## ")[0]
    assert len(KINDS) > 2
    for name in KINDS:
        assert (f'kind = "{name}"' in " ".join(introduction.split())) == (name != ROLLING_ELEMENT_ECCENTRIC)
    assert "python -m" not in introduction, "how the page is made is said in CONTRIBUTING.md"


def test_every_field_has_a_line_with_its_meaning() -> None:
    rows = {row.name: row for row in table(FIELDS)}
    assert set(rows) == set(FIELDS)
    for row in rows.values():
        assert row.meaning.endswith((".", "`)."))
        assert "{" not in row.meaning
        assert row.example
    assert rows["housing_stiffness"].default == "rigid"
    assert rows["housing_stiffness"].unit == "N.m/arcmin"
    assert rows["cage_contact"].value == "'hertz' or 'lamina'"
