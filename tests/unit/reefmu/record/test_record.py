"""Records: units, compression, column maps, runs; invalid ones are refused in one line."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest

import stiffness_model as sm
from reefmu.model.drive_model import DriveModel
from reefmu.record import ANGLE_LIMIT, RANGES, make_record, read_record
from reefmu.simulate import record_inputs, simulate_record

GOOD = """time [ms],run,crank_angle [deg],output_angle [mrad],output_torque [kN.m],temperature [degF]
0,0,0,0,0,68
10,0,90,1,0.001,68
20,0,180,2,0.002,77
0,1,0,3,0.003,86
5,1,1,4,0.004,86
"""


def write(folder: Path, text: str, name: str = "record.csv") -> Path:
    path = folder / name
    data = text.encode()
    path.write_bytes(gzip.compress(data) if name.endswith(".gz") else data)
    return path


@pytest.mark.parametrize("name", ["record.csv", "record.csv.gz"])
def test_units_are_converted(tmp_path: Path, name: str) -> None:
    record = read_record(write(tmp_path, GOOD, name))
    assert record.time == pytest.approx([0, 0.01, 0.02, 0, 0.005])
    assert record.crank_angle[:3] == pytest.approx([0, np.pi / 2, np.pi])
    assert record.output_angle == pytest.approx([0, 1e-3, 2e-3, 3e-3, 4e-3])
    assert record.output_torque == pytest.approx([0, 1, 2, 3, 4])
    assert record.temperature == pytest.approx([20, 20, 25, 30, 30])
    assert list(record.starts) == [0, 3]
    assert record.missing == ()


def test_a_twist_column_replaces_the_angles(tmp_path: Path) -> None:
    text = "time [s],twist [arcmin],output_torque [N.m]\n0,0,0\n1,2,5\n2,4,9\n"
    record = read_record(write(tmp_path, text))
    assert record.twist(-29.0) / sm.ARCMIN == pytest.approx([0, 2, 4])
    assert record.missing == ("run", "crank_angle", "temperature")
    assert (record.temperature == 20).all()


def test_column_map_renames_and_drops(tmp_path: Path) -> None:
    text = "TIME,POSITION,TORQUE,Q\n0,0,0,9\n1,0.5,5,9\n2,1,9,9\n"
    columns = {"TIME": "time [s]", "POSITION": "twist [rev]", "TORQUE": "output_torque [N.m]"}
    record = read_record(write(tmp_path, text), columns)
    assert record.twist(10.0) == pytest.approx([0, np.pi, 2 * np.pi])


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("time [s],twist [arcmin]\n0,0\n1,1\n", "expected a column 'output_torque'"),
        ("time [s],output_torque [N.m]\n0,0\n1,1\n", "expected a column 'twist' or 'output_angle'"),
        ("time [s],twist [N],output_torque [N.m]\n0,0,0\n1,1,1\n", "expected a unit of twist such as [rad], got [N]"),
        ("time,twist [rad],output_torque [N.m]\n0,0,0\n1,1,1\n", "expected a unit in the header"),
        ("time [s],twits [rad],output_torque [N.m]\n0,0,0\n1,1,1\n", "did you mean 'twist'"),
        ("time [s],twist [rad],output_torque [N.m]\n0,0,0\n1,nan,1\n", "expected finite numbers in column 'twist'"),
        ("time [s],twist [rad],output_torque [N.m]\n0,0,0\n1,x,1\n", "expected numbers in column"),
        ("time [s],twist [rad],output_torque [N.m]\n1,0,0\n0,1,1\n", "time that does not run backwards"),
        ("time [s],twist [rad],output_torque [N.m]\n0,0,0\n1,1\n", "expected 3 values in every row, got 2 in line 3"),
        ("time [s]\n0\n1\n", "expected a column"),
        ("", "expected a header and at least two rows"),
        ("time [s],run,twist [rad],output_torque [N.m]\n0,0.5,0,0\n1,1,1,1\n", "whole numbers in column 'run'"),
    ],
)
def test_bad_records_are_refused_in_one_line(tmp_path: Path, text: str, message: str) -> None:
    path = write(tmp_path, text)
    with pytest.raises(sm.InputError) as error:
        read_record(path)
    assert message in str(error.value)
    assert str(path) in str(error.value)
    assert "\n" not in str(error.value)


ROWS = [(0.01 * k, 3.0 * np.sin(0.1 * k), 40.0 * np.sin(0.1 * k)) for k in range(200)]


@pytest.mark.parametrize(
    ("column", "unit", "value"),
    [
        (0, "s", 1e100),
        (1, "arcmin", 1e200),
        (1, "rad", -1e15),
        (2, "N.m", 1e200),
        (2, "N.m", -1e154),
        (2, "kN.m", 1e7),
    ],
)
def test_impossible_values_are_refused_at_reading(tmp_path: Path, column: int, unit: str, value: float) -> None:
    """The squares of such numbers overflow, and linear algebra fails."""
    names, units = ["time", "twist", "output_torque"], ["s", "arcmin", "N.m"]
    units[column] = unit
    rows = [list(row) for row in ROWS]
    rows[-1][column] = value
    text = ",".join(f"{n} [{u}]" for n, u in zip(names, units, strict=True)) + "\n"
    path = write(tmp_path, text + "\n".join(",".join(f"{x:.17g}" for x in row) for row in rows))
    with pytest.raises(sm.InputError) as error:
        read_record(path)
    said = str(error.value)
    assert said.startswith(f"{path}: expected column '{names[column]}' within ")
    assert said.endswith("in data row 200; check its unit")


def test_one_microradian_is_resolved_at_the_greatest_angle() -> None:
    """Beyond it a twist is quantised by double precision to an extent that a diagnosis would detect."""
    assert np.spacing(ANGLE_LIMIT) <= 1e-6 < np.spacing(4 * ANGLE_LIMIT)
    for low, high in RANGES.values():
        assert np.isfinite(1e9 * max(low**2, high**2) ** 2)


@pytest.mark.parametrize("unit", ["9**9**9**9", "s**9**9", "N.m**1e9", "inf s", "\\", "1/0", "((((", "s^99"])
def test_an_invalid_unit_is_refused_at_once(tmp_path: Path, unit: str) -> None:
    path = write(tmp_path, f"time [{unit}],twist [rad],output_torque [N.m]\n0,0,0\n1,1,1\n")
    with pytest.raises(sm.InputError, match="expected a unit of time such as"):
        read_record(path)
    good = write(tmp_path, "time [s],twist [rad],output_torque [kg*m**2/s^2]\n0,0,0\n1,1,1\n")
    assert read_record(good).output_torque == pytest.approx([0, 1])


def test_not_a_text_file(tmp_path: Path) -> None:
    path = tmp_path / "record.csv.gz"
    path.write_bytes(b"\x1f\x8b broken")
    with pytest.raises(sm.InputError, match="readable CSV"):
        read_record(path)
    with pytest.raises(sm.InputError, match="readable CSV"):
        read_record(tmp_path / "none.csv")


def test_speeds_stay_within_runs() -> None:
    time = np.concatenate([np.linspace(0, 1, 11), np.linspace(0, 1, 11)])
    crank = np.concatenate([3 * time[:11], 100 - 5 * time[11:]])
    record = make_record(
        {
            "time": time,
            "run": np.repeat([1, 2], 11),
            "crank_angle": crank,
            "output_angle": np.zeros(22),
            "output_torque": np.zeros(22),
        }
    )
    assert record_inputs(record)[:, 1] == pytest.approx(np.repeat([3.0, -5.0], 11))


def test_a_record_of_the_model_has_no_residual(model: DriveModel) -> None:
    time = np.linspace(0, 1, 50)
    twist = 0.001 * np.sin(6 * time)
    torque = model.lookup.torque(twist)
    record = make_record(
        {
            "time": np.tile(time, 2),
            "run": np.repeat([0, 1], 50),
            "twist": np.tile(twist, 2),
            "output_torque": np.tile(torque, 2),
        }
    )
    response = simulate_record(model, record)
    assert response["output.tau"] == pytest.approx(record.output_torque, abs=1e-9)
