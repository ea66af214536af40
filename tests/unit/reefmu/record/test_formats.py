"""Tables as programs write them: read back equal, or refused in one line that states the remedy."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

import stiffness_model as sm
from reefmu.record import read_file, read_record

NAMES = ("time", "twist", "output_torque", "temperature")
UNITS = {
    "time": ("s", "ms", "sec", "µs", "min"),
    "twist": ("arcmin", "deg", "°", "rev", "mrad", "rad", "'"),
    "output_torque": ("N.m", "Nm", "N*m", "N·m", "N m", "kNm", "mN.m"),
    "temperature": ("degC", "°C", "C", "K"),
}
FACTORS = {
    "s": 1.0,
    "sec": 1.0,
    "ms": 1e-3,
    "µs": 1e-6,
    "min": 60.0,
    "arcmin": sm.ARCMIN,
    "'": sm.ARCMIN,
    "deg": np.pi / 180,
    "°": np.pi / 180,
    "rev": 2 * np.pi,
    "mrad": 1e-3,
    "rad": 1.0,
    "kNm": 1e3,
    "mN.m": 1e-3,
}
OFFSETS = {"K": -273.15}

values = st.floats(-1e6, 1e6, allow_nan=False).map(lambda x: round(x, 6))


@st.composite
def dialects(draw: st.DrawFn) -> dict[str, object]:
    """A way to write a table."""
    separator = draw(st.sampled_from(["\t", ";", "|", ","]))
    return {
        "separator": separator,
        "decimal": "." if separator == "," else draw(st.sampled_from([".", ","])),
        "encoding": draw(st.sampled_from(["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "latin-1"])),
        "end": draw(st.sampled_from(["\n", "\r\n", "\r"])),
        "preamble": draw(
            st.sampled_from(
                [[], ["# rig 7; loops, 20 degC"], ["Operator", "", "% made on a bench"], ["Rig 7", "Day 3"]]
            )
        ),
        "padded": draw(st.booleans()),
        "units_row": draw(st.booleans()),
        "trailing": draw(st.booleans()),
        "quoted": draw(st.booleans()),
        "zip": draw(st.booleans()),
        "units": {name: draw(st.sampled_from(UNITS[name])) for name in NAMES},
    }


def written(data: dict[str, list[float]], dialect: dict[str, object]) -> bytes:
    units = dialect["units"]
    assert isinstance(units, dict)
    heads = [name if dialect["units_row"] else f"{name} [{units[name]}]" for name in data]
    rows = [heads]
    if dialect["units_row"]:
        rows.append([units[name] for name in data])
    for k in range(len(data["time"])):
        rows.append([repr(column[k]).replace(".", str(dialect["decimal"])) for column in data.values()])
    if dialect["quoted"]:
        rows = [['"' + field + '"' if '"' not in field else field for field in row] for row in rows]
    end = str(dialect["separator"]) if dialect["trailing"] else ""
    # A spreadsheet fills every line to the width of the table.
    filling = str(dialect["separator"]) * (len(NAMES) - 1) + end if dialect["padded"] else ""
    preamble = [line + filling for line in dialect["preamble"]]  # type: ignore[attr-defined]
    lines = [*preamble, *(str(dialect["separator"]).join(row) + end for row in rows)]
    text = str(dialect["end"]).join(lines) + str(dialect["end"])
    raw = text.encode(str(dialect["encoding"]))
    return gzip.compress(raw) if dialect["zip"] else raw


@settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    dialect=dialects(),
    rows=st.lists(st.tuples(values, values, st.floats(0, 300).map(lambda x: round(x, 3))), min_size=2, max_size=8),
)
def test_a_table_is_read_as_it_was_written(
    tmp_path: Path, dialect: dict[str, object], rows: list[tuple[float, float, float]]
) -> None:
    """In any separator, decimal mark, encoding, line end and unit; a round trip is exact up to the units' rounding."""
    data = {
        "time": [0.25 * k + 0.5 for k in range(len(rows))],
        "twist": [row[0] for row in rows],
        "output_torque": [row[1] for row in rows],
        "temperature": [row[2] + 0.125 for row in rows],
    }
    path = tmp_path / "record.csv"
    path.write_bytes(written(data, dialect))
    found = read_file(path)
    units = dialect["units"]
    assert isinstance(units, dict)
    for name in NAMES:
        expected = np.array(data[name]) * FACTORS.get(units[name], 1.0) + OFFSETS.get(units[name], 0.0)
        got = found.record.twist(1.0) if name == "twist" else getattr(found.record, name)
        assert got == pytest.approx(expected, rel=1e-12, abs=1e-9), name
    assert found.layout.separator == dialect["separator"]
    assert found.layout.has_units_row == dialect["units_row"]


def test_spaces_separate_and_a_comment_may_hold_the_header(tmp_path: Path) -> None:
    """As numpy.savetxt writes it."""
    path = tmp_path / "record.txt"
    columns = np.stack([np.arange(5.0), np.arange(5.0) ** 2, -np.arange(5.0)], axis=1)
    np.savetxt(path, columns, header="time [s] twist [mrad] output_torque [N m]")
    record = read_record(path)
    assert record.time == pytest.approx(columns[:, 0])
    assert record.twist(1.0) == pytest.approx(1e-3 * columns[:, 1])
    np.savetxt(path, columns, header="time [s],twist [mrad],output_torque [Nm]", delimiter=",", fmt="%.3f")
    assert read_record(path).output_torque == pytest.approx(columns[:, 2])
    text = path.read_text().replace("#", "").replace(",", " ").replace(".", ",")
    path.write_text(text)
    assert read_record(path).output_torque == pytest.approx(columns[:, 2])


@pytest.mark.parametrize("title", ["Time [s]", "time (s)", "TIME / s", "time in s", "time[s]"])
def test_titles_in_other_forms(tmp_path: Path, title: str) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"{title},Twist [rad],Output Torque [Nm]\n0,0,0\n1,1,1\n")
    assert read_record(path).time == pytest.approx([0, 1])


@pytest.mark.parametrize("none", ["", "-", "[-]", "1", "(1)"])
def test_a_row_of_units_says_that_a_column_has_none(tmp_path: Path, none: str) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"time,run,twist,output_torque\nSeconds,{none},DEG,NM\n0,1,0,0\n1,1,1,1\n")
    found = read_file(path)
    assert found.record.twist(1.0) == pytest.approx([0, np.pi / 180])
    assert found.record.run.tolist() == [1, 1]


def test_a_map_decides_between_two_units(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("time [s],twist [deg],output_torque [Nm]\ns,rad,Nm\n0,0,0\n1,1,1\n")
    columns = {"time [s]": "time", "twist [deg]": "twist [rad]", "output_torque [Nm]": "output_torque"}
    assert read_record(path, columns).twist(1.0) == pytest.approx([0, 1])


def test_excel_states_its_separator(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("sep=;\ntime [s];twist [rad];output_torque [Nm]\n0;0;0\n1,5;1;1\n")
    assert read_record(path).time == pytest.approx([0, 1.5])


@pytest.mark.parametrize(
    ("field", "value"),
    [("1.234,5", 1234.5), ("1,5", 1.5), ("-0,123", -0.123), ("12,3456", 12.3456), ("1,5e2", 150.0), ("−2,5", -2.5)],
)
def test_decimal_commas_with_and_without_thousands(tmp_path: Path, field: str, value: float) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"time [s];twist [rad];output_torque [Nm]\n0;0;1,234\n1;0;{field}\n", "utf-8")
    assert read_record(path).output_torque == pytest.approx([1.234, value])


HEAD = "time [s];twist [rad];output_torque [N.m]\n"
COMMAS = "time [s],twist [rad],output_torque [N.m]\n"


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (HEAD + "0;0;1,234\n1;0;2,345\n", "which may be 1.234 or 1234; state which with decimal = "),
        (HEAD + "0;0.001;1,5\n1;0.01;2,5\n", "expected numbers with one decimal mark, got '1,5' and '0.001'"),
        (COMMAS + "0,5,0,01,1,5\n0,6,0,02,2,5\n", "got 6 in line 2: a comma that separates columns and marks decimals"),
        (
            "time [s],twist [rad]\n0,5,0,01\n0,6,0,02\n",
            "export with semicolons between columns, or with decimal points",
        ),
        (COMMAS + "12:00:01,0,0\n12:00:02,1,1\n", "'12:00:01' in line 2; write the time in seconds from a start"),
        (HEAD + "12:00:01,5;0,1;1,5\n12:00:02,5;0,2;2,5\n", "'12:00:01,5' in line 2; write the time in seconds"),
        (COMMAS + "0,,0\n1,1,1\n", "got an empty field in line 2; fill it or remove the row"),
        ("0,0,0\n1,1,1\n", "expected a header row of `name [unit]` above the numbers, got 0, 0, 0 in line 1"),
        ("time,twist [rad],output_torque [N.m]\n0,0,0\n1,1,1\n", "or in a row below it, got 'time'; or state it with"),
        (COMMAS + "n/a,n/a,n/a\n0,0,0\n1,1,1\n", "state the unit with --column 'time [s]=time [s]'"),
        (COMMAS + "s,rad\n0,0,0\n1,1,1\n", "got 2 in line 2; complete it or remove the row"),
        (COMMAS + "s,rad,N.m\nREAL,REAL,REAL\n0,0,0\n", "got 'REAL' in line 3; correct it or remove the row"),
        (COMMAS.replace("N.m", "mA") + "0,0,0\n1,1,1\n", "which is a current: map it to motor_current"),
        (
            "time,Pos,Iq\ns,deg,A\n0,0,0\n1,1,1\n",
            "did you mean 'twist'? map the columns to use with --column 'Pos=twist",
        ),
        ("time,Kanal_3,Iq\ns,mA,A\n0,0,0\n1,1,1\n", "--column 'Kanal_3=motor_current [mA]'"),
        ("time [s],twist_deg,output_torque [Nm]\n0,0,0\n1,1,1\n", "--column 'twist_deg=twist [deg]'"),
        (COMMAS.replace("N.m", "Arms") + "0,0,0\n1,1,1\n", "write [A], and state the torque_constant of effective"),
        (COMMAS.replace("rad", "9**9**9**9") + "0,0,0\n1,1,1\n", "such as [rad], got [9**9**9**9]"),
        ("x" * 300 + ",twist [rad]\n0,0\n1,1\n", "expected titles of at most 200 characters"),
        (COMMAS.replace("rad", "counts") + "0,0,0\n1,1,1\n", "write its resolution, such as [rev/4096]"),
        (COMMAS.replace("rad", "Grad") + "0,0,0\n1,1,1\n", "write [deg] or [gon]"),
        (COMMAS.replace("rad", "%") + "0,0,0\n1,1,1\n", "expected a unit of twist such as [rad], got [%]"),
        (COMMAS.replace("N.m", "nm") + "0,0,0\n1,1,1\n", "got [nm], which is a nanometre; write [N.m]"),
    ],
)
def test_what_is_ambiguous_is_said_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    path = tmp_path / "record.csv"
    path.write_text(text, "utf-8")
    with pytest.raises(sm.InputError) as error:
        read_record(path)
    assert message in str(error.value)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("raw", "message"),
    [
        (b"PK\x03\x04rest", "an Excel workbook or a zip archive; save the sheet as CSV"),
        (b"\x89HDF\r\n\x1a\n", "an HDF5 file; export the signals as CSV"),
        (b"time\x01,2\n", "binary data"),
        (b"\xff\xfe1", "expected a readable CSV file"),
    ],
)
def test_files_without_text_state_the_remedy(tmp_path: Path, raw: bytes, message: str) -> None:
    path = tmp_path / "record.csv"
    path.write_bytes(raw)
    with pytest.raises(sm.InputError, match="expected a readable CSV file") as error:
        read_record(path)
    assert message in str(error.value)


def test_a_stated_decimal_mark_decides(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text(HEAD + "0;0;1,234\n1;0;2,345\n")
    assert read_record(path, {"decimal": ","}).output_torque == pytest.approx([1.234, 2.345])
    assert read_record(path, {"decimal": "."}).output_torque == pytest.approx([1234, 2345])
    with pytest.raises(sm.InputError, match=r"decimal = '\.' or ','"):
        read_record(path, {"decimal": "comma"})


HEADS = ("time [s]", "twist [rad]", "output_torque [N.m]", "run")
SNIPPETS = (*HEADS, ",", ";", "\t", "\n", '"', "#", "1", "-2,5", "1e9", "nan", "[")


@settings(max_examples=300, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(content=st.one_of(st.binary(max_size=300), st.lists(st.sampled_from(SNIPPETS), max_size=60).map("".join)))
def test_any_file_is_read_or_refused_in_one_line(tmp_path: Path, content: bytes | str) -> None:
    path = tmp_path / "record.csv"
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    said = ""
    try:
        read_record(path)
    except sm.InputError as error:
        said = str(error)
    assert len(said.splitlines()) <= 1
    assert len(said) < 1500
