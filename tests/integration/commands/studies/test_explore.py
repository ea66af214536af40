"""`reefmu explore`: what it prints and writes, and wrong calls."""

from __future__ import annotations

import importlib.util
import json
import shutil
from pathlib import Path

import numpy as np
import pytest
import tomli_w

import stiffness_model as sm
from reefmu.cli import main
from stiffness_model.explore.optimisation.run import CHUNK_FOLDER
from tests.integration.commands.studies.explore_runs import (
    chunks,
    designs,
    same_designs,
    write_study,
)
from tests.small_study import study, tables

pytestmark = pytest.mark.slow


def test_prints_the_front_and_the_choice_and_writes_its_files(done: tuple[Path, str]) -> None:
    folder, printed = done
    assert sorted(path.name for path in folder.iterdir()) == [
        "chosen.toml",
        "chunks",
        "designs.parquet",
        "effects.png",
        "pareto.png",
        "study.json",
        "trade_off.png",
    ]
    for words in (
        "small: 80 designs, 4 virtual drives at 12 twists each, seed 3",
        "left out: the drawing alone breaks",
        "Pareto front",
        "share of the sample's variance",
        "chosen, the knee of the front",
        "written to",
    ):
        assert words in printed
    read = designs(folder)
    assert f"{read['feasible'].sum():6d}  keep within all limits, {read['front'].sum()} of them on the front" in printed
    assert json.loads((folder / "study.json").read_text("utf-8"))["identity"] == study().identity


def test_the_chosen_drawing_is_the_chosen_design_and_other_commands_take_it(
    done: tuple[Path, str], tmp_path: Path
) -> None:
    folder, _ = done
    read = designs(folder)
    k = int(np.flatnonzero(read["chosen"])[0])
    drive = sm.load_drive(folder / "chosen.toml")
    assert drive.lobes == read["lobes [1]"][k]
    assert drive.tolerances["gear"].text == read["gear_tolerance"][k]
    assert drive.tolerances["gear"].offset == pytest.approx(read["gear_offset [m]"][k], rel=1e-12, abs=1e-18)
    assert drive.elements == read["elements [1]"][k]
    # The simulation of the drawing differs from the study by the few balls larger than their bores and by the
    # spacing of the twists.
    curve = sm.simulate(drive, np.linspace(0, drive.max_twist, 121), 4, 3).curve()
    twist = float(curve.twist_at(120.0))
    assert twist == pytest.approx(read["twist [rad]"][k], rel=2e-3)
    assert float(curve.stiffness_at(twist)) == pytest.approx(read["stiffness [N.m/rad]"][k], rel=0.02)
    assert curve.lost_motion(120.0) == pytest.approx(read["lost_motion [rad]"][k], rel=0.05)
    assert 1.0 < drive.max_twist / twist < 1.2
    assert main(["curve", str(folder / "chosen.toml"), "--drives", "16", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "curve.csv").exists()


def test_no_feasible_design_is_status_1_and_its_designs_are_written(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = tables(generations=0, designs=8)
    table["constraints"] = {"pressure": {"max": "0.1 GPa"}}
    path = tmp_path / "study.toml"
    path.write_text(tomli_w.dumps(table), "utf-8")
    assert main(["explore", str(path), "--workers", "1", "--out", str(tmp_path / "out")]) == 1
    assert "     0  keep within all limits" in capsys.readouterr().out
    assert not designs(tmp_path / "out")["feasible"].any()
    assert not (tmp_path / "out" / "chosen.toml").exists()


@pytest.mark.parametrize(
    ("args", "message"),
    [
        (["nothing"], "unknown study 'nothing'; expected one of geometry, tolerance_field"),
        (["STUDY", "--workers", "0"], "explore: argument --workers: expected a whole number from 1 to 4096, got '0'"),
        (["STUDY", "--workers", "1", "--scheduler", "tcp://h:1"], "not allowed with argument"),
        (["STUDY", "--scheduler", "nonsense://x"], "--scheduler: expected the address of a running dask scheduler"),
        (["STUDY", "--out", ""], "explore: argument --out: expected a name, got ''"),
        (["STUDY", "--out", "FILE"], "FILE: expected a folder that can be written"),
    ],
)
def test_a_wrong_call_is_one_line_and_status_2(
    args: list[str], message: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    if "--scheduler" in args and importlib.util.find_spec("distributed") is None:
        pytest.skip("dask.distributed is not installed")
    monkeypatch.chdir(tmp_path)
    write_study(tmp_path)
    Path("FILE").write_text("", "utf-8")
    args = ["study.toml" if word == "STUDY" else word for word in args]
    if "--out" not in args:
        args += ["--out", "out"]
    try:
        status = main(["explore", *args])
    except SystemExit as left:
        status = int(str(left.code))
    assert status == 2
    lines = capsys.readouterr().err.splitlines()
    assert len(lines) == 1
    assert message in lines[0]


def test_a_folder_of_another_study_is_refused(
    done: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, _ = done
    assert main(["explore", str(write_study(tmp_path, seed=4)), "--workers", "1", "--out", str(folder)]) == 2
    assert "holds a different study" in capsys.readouterr().err
    assert (folder / "chosen.toml").exists()


def test_more_workers_give_the_same_designs(
    done: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, printed = done
    args = ["explore", str(write_study(tmp_path)), "--workers", "3", "--out", str(tmp_path / "out")]
    assert main(args) == 0
    same_designs(tmp_path / "out", folder)
    assert capsys.readouterr().out.replace(str(tmp_path / "out"), "") == printed.replace(str(folder), "")


def test_another_choice_needs_no_new_evaluations_and_no_choice_is_status_1(
    done: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    table = tables()
    path, out = tmp_path / "study.toml", tmp_path / "out"
    shutil.copytree(done[0], out)
    times = {name: (out / CHUNK_FOLDER / name).stat().st_mtime_ns for name in chunks(out)}
    table["choose"] = {"rule": "best", "objective": "stiffness", "limits": {"lost_motion": {"max": "1 arcmin"}}}
    path.write_text(tomli_w.dumps(table), "utf-8")
    assert main(["explore", str(path), "--out", str(out)]) == 0
    assert "the best in stiffness within lost motion <= 1 arcmin" in capsys.readouterr().out
    assert {name: (out / CHUNK_FOLDER / name).stat().st_mtime_ns for name in chunks(out)} == times
    table["choose"]["limits"] = {"lost_motion": {"max": "0.0001 arcmin"}}
    path.write_text(tomli_w.dumps(table), "utf-8")
    assert main(["explore", str(path), "--out", str(out)]) == 1
    assert "no drawing is chosen" in capsys.readouterr().out
