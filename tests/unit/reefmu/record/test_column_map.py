"""Column maps: units from map, header or units row; unknown names are answered with the map that would help."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.record import make_column_map, read_column_map, read_file, read_record

FOREIGN = "TIME,POSITION,TORQUE [kNm],test_nr,STATE\n0,0,0,3,ok\n1,0.5,5,3,ok\n2,1,9,4,ok\n"
COLUMNS = {"TIME": "time [s]", "POSITION": "twist [rev]", "TORQUE": "output_torque", "test_nr": "run"}


@pytest.fixture
def foreign(tmp_path: Path) -> Path:
    path = tmp_path / "foreign.csv"
    path.write_text(FOREIGN)
    return path


def test_units_come_from_the_map_or_the_header(foreign: Path) -> None:
    found = read_file(foreign, COLUMNS)
    assert found.record.output_torque == pytest.approx([0, 5000, 9000])
    assert found.record.twist(1.0) == pytest.approx([0, np.pi, 2 * np.pi])
    assert list(found.record.run) == [3, 3, 4]
    assert found.ignored == ("STATE",)
    assert {c.title: c.stated_in for c in found.columns if c.unit} == {
        "TIME": "column map",
        "POSITION": "column map",
        "TORQUE [kNm]": "header",
    }
    assert {c.name: c.scale for c in found.columns}["output_torque"] == pytest.approx(1000)


def test_a_minus_reverses_the_sign(foreign: Path) -> None:
    record = read_record(foreign, {**COLUMNS, "TORQUE": "-output_torque"})
    assert record.output_torque == pytest.approx([0, -5000, -9000])


def test_a_file_and_entries_make_one_map(tmp_path: Path, foreign: Path) -> None:
    path = tmp_path / "map.toml"
    path.write_text('ratio = -29\n[columns]\nTIME = "time [s]"\nPOSITION = "twist [rev]"\nTORQUE = "motor_torque"\n')
    record = read_record(foreign, read_column_map(path, {"POSITION": "twist [deg]"}))
    assert record.twist(1.0) == pytest.approx(np.deg2rad([0, 0.5, 1]))
    assert record.output_torque == pytest.approx([0, -29 * 5000, -29 * 9000])


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        (
            None,
            "unknown column 'POSITION'; did you mean 'twist'? map the columns to use with --column 'POSITION=twist ",
        ),
        (None, "or in a TOML file with --columns"),
        ({**COLUMNS, "TIM": "temperature [K]"}, "names 'TIM', which the file does not have; did you mean 'TIME'?"),
        ({**COLUMNS, "TIME": "tme [s]"}, "columns: TIME: unknown column 'tme'; did you mean 'time'?"),
        ({**COLUMNS, "TIME": 3}, "columns: TIME: expected a text such as TIME ="),
        ({**COLUMNS, "POSITION": "twist"}, "expected a unit in the header, such as 'twist [rad]'"),
        ({**COLUMNS, "ratio": "much"}, "columns: ratio: expected a number, such as -29, got 'much'"),
        ({**COLUMNS, "torque_constant": "95"}, "with its unit, such as '1 N.m/A', got '95'"),
        ({**COLUMNS, "columns": "run"}, "expected a table [columns]"),
        ({**COLUMNS, "separator": "x"}, "expected separator ="),
    ],
)
def test_wrong_maps_are_refused_in_one_line(foreign: Path, columns: dict[str, str] | None, message: str) -> None:
    with pytest.raises(sm.InputError) as error:
        read_record(foreign, columns)
    assert message in str(error.value)
    assert "\n" not in str(error.value)


def test_the_maps_of_the_documentation_are_valid() -> None:
    page = (Path(__file__).parents[4] / "docs/reference/record.md").read_text("utf-8")
    blocks = re.findall(r"```toml\n(.*?)```", page, re.DOTALL)
    maps = [make_column_map(tomllib.loads(block)) for block in blocks]
    assert len(maps) == 3
    assert maps[1].constants.torque_constant == pytest.approx(0.095)
    assert maps[1].constants.motor_inertia == pytest.approx(4e-5)
    assert maps[2].constants.pendulum is not None
    assert maps[2].constants.pendulum.length == pytest.approx(0.4)
