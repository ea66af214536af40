"""`reefmu explore`: what it prints and writes, killed and resumed, on processes and on a dask cluster."""

from __future__ import annotations

import builtins
import importlib.util
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

import stiffness_model as sm
from reefmu.cli import main
from stiffness_model.explore.optimisation.run import CHUNK_FOLDER, run_study
from stiffness_model.explore.report.results import assess_designs, columns
from tests.small_study import study, tables
from tests.subprocesses import TIMEOUT, messages

pytestmark = pytest.mark.slow

LONGER: dict[str, Any] = {"designs": 256, "drives": 40, "generations": 1}
"""Long enough to be disturbed: 17 chunks."""
HELD = """
import pathlib, sys, time
from reefmu.cli import main
from stiffness_model.explore.optimisation import run

kept, go, write = [], pathlib.Path(sys.argv[1]), run._write

def held(file, part):
    kept.append(file)  # before the file is there: an interruption from then on meets no second wait
    write(file, part)
    while len(kept) == int(sys.argv[2]) and not go.exists():
        time.sleep(0.01)

run._write = held
sys.exit(main(["explore", *sys.argv[3:]]))
"""
"""Runs a study, and waits after as many chunks as it is told until the file `go` is there: it is disturbed in its
middle, however fast it and the test are."""


def write_study(folder: Path, **numbers: Any) -> Path:
    folder.mkdir(exist_ok=True)
    path = folder / "study.toml"
    path.write_text(tomli_w.dumps(tables(**numbers)), "utf-8")
    return path


def designs(folder: Path) -> dict[str, Any]:
    parquet = pytest.importorskip("pyarrow.parquet")
    table = parquet.read_table(folder / "designs.parquet")
    return {name: table[name].to_numpy() for name in table.column_names}


def same_designs(a: Path, b: Path) -> None:
    first, second = designs(a), designs(b)
    assert list(first) == list(second)
    for name, values in first.items():
        np.testing.assert_array_equal(values, second[name], err_msg=name)


def start(*args: str, out: Path, chunks: int) -> subprocess.Popen[str]:
    """The command, which waits after `chunks` of them for the file `go` beside its folder."""
    return subprocess.Popen(
        [sys.executable, "-c", HELD, str(out.parent / "go"), str(chunks), *args, "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_for(met: Any, what: str) -> None:
    end = time.monotonic() + TIMEOUT
    while not met():
        assert time.monotonic() < end, what
        time.sleep(0.01)


def chunks(folder: Path) -> list[str]:
    return sorted(file.name for file in (folder / CHUNK_FOLDER).glob("[!.]*")) if folder.exists() else []


@pytest.fixture(scope="module")
def done(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, str]:
    """The small study, run whole by one worker, and what it printed."""
    folder = tmp_path_factory.mktemp("explore")
    made = subprocess.run(
        [
            sys.executable,
            "-m",
            "reefmu",
            "explore",
            str(write_study(folder)),
            "--workers",
            "1",
            "--out",
            str(folder / "out"),
        ],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert made.returncode == 0, made.stderr
    assert messages(made.stderr) == []
    return folder / "out", made.stdout


@pytest.fixture(scope="module")
def longer(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    """The columns of the longer study, from one process that nobody disturbs."""
    of = study(**LONGER)
    with ProcessPoolExecutor(1) as executor:
        return columns(assess_designs(of, *run_study(of, tmp_path_factory.mktemp("longer"), executor)))


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
    # The full simulation of the drawing gives what the study found, but for the few balls larger than their bore
    # and for the spacing of the twists.
    curve = sm.simulate(drive, np.linspace(0, drive.max_twist, 121), 4, 3).curve()
    twist = float(curve.twist_at(120.0))
    assert twist == pytest.approx(read["twist [rad]"][k], rel=2e-3)
    assert float(curve.stiffness_at(twist)) == pytest.approx(read["stiffness [N.m/rad]"][k], rel=0.02)
    assert curve.lost_motion(120.0) == pytest.approx(read["lost_motion [rad]"][k], rel=0.05)
    assert 1.0 < drive.max_twist / twist < 1.2
    assert main(["curve", str(folder / "chosen.toml"), "--drives", "16", "--out", str(tmp_path)]) == 0
    assert (tmp_path / "curve.csv").exists()


def test_more_workers_give_the_same(done: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder, printed = done
    args = ["explore", str(write_study(tmp_path)), "--workers", "3", "--out", str(tmp_path / "out")]
    assert main(args) == 0
    same_designs(tmp_path / "out", folder)
    assert capsys.readouterr().out.replace(str(tmp_path / "out"), "") == printed.replace(str(folder), "")


def test_a_choice_may_change_without_new_work_and_none_is_status_1(
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


def test_killed_in_the_middle_it_leaves_whole_chunks_and_no_workers_and_goes_on(
    tmp_path: Path, longer: dict[str, Any]
) -> None:
    path, out = write_study(tmp_path, **LONGER), tmp_path / "out"
    running = start(str(path), "--workers", "2", out=out, chunks=3)
    wait_for(lambda: len(chunks(out)) == 3, "the first chunks")
    children = _children(running.pid)
    running.kill()
    running.communicate()
    kept = chunks(out)
    assert len(kept) == 3
    if children is not None:
        assert len(children) >= 2
        wait_for(lambda: not any(Path(f"/proc/{child}").exists() for child in children), "the workers to leave")
    # Nothing half-written under a chunk's name.
    for name in kept:
        with np.load(out / CHUNK_FOLDER / name) as held:
            assert held["metrics"].shape[0] == 16
    times = {name: (out / CHUNK_FOLDER / name).stat().st_mtime_ns for name in kept}
    assert main(["explore", str(path), "--workers", "2", "--out", str(out)]) == 0
    assert {name: (out / CHUNK_FOLDER / name).stat().st_mtime_ns for name in kept} == times
    for name, values in longer.items():
        np.testing.assert_array_equal(designs(out)[name], values, err_msg=name)


def _children(pid: int) -> list[int] | None:
    """The processes that a process started, on Linux."""
    try:
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text("ascii").split()]
    except OSError:
        return None


@pytest.mark.skipif(os.name != "posix", reason="foreign host: signals of POSIX")
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_a_signal_is_status_128_and_its_number_and_one_line(tmp_path: Path, number: signal.Signals) -> None:
    path, out = write_study(tmp_path, **LONGER), tmp_path / "out"
    running = start(str(path), "--workers", "2", out=out, chunks=1)
    wait_for(lambda: len(chunks(out)) == 1, "the first chunk")
    # As a terminal does: to every process of the group.
    os.killpg(running.pid, number)
    _, told = running.communicate(timeout=TIMEOUT)
    assert running.returncode == 128 + number
    assert messages(told) == [
        f"reefmu: interrupted; finished designs are kept in {out}, and the same command continues from there"
    ]


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


@pytest.mark.parametrize("address", ["processes", "tcp://", " "])
def test_a_scheduler_that_is_none_leaves_nothing_to_complain_at_exit(address: str, tmp_path: Path) -> None:
    if importlib.util.find_spec("distributed") is None:
        pytest.skip("dask.distributed is not installed")
    made = subprocess.run(
        [
            sys.executable,
            "-m",
            "reefmu",
            "explore",
            str(write_study(tmp_path)),
            "--scheduler",
            address,
            "--out",
            str(tmp_path / "out"),
        ],
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        check=False,
    )
    assert made.returncode == 2
    assert len(made.stderr.splitlines()) == 1
    assert made.stderr.startswith("reefmu: --scheduler: expected the address of a running dask scheduler")


def test_a_folder_of_another_study_is_refused(
    done: tuple[Path, str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder, _ = done
    assert main(["explore", str(write_study(tmp_path, seed=4)), "--workers", "1", "--out", str(folder)]) == 2
    assert "holds a different study" in capsys.readouterr().err
    assert (folder / "chosen.toml").exists()


def test_a_lost_worker_process_is_one_line_and_status_1(tmp_path: Path) -> None:
    path, out = write_study(tmp_path, **LONGER), tmp_path / "out"
    running = start(str(path), "--workers", "2", out=out, chunks=2)
    wait_for(lambda: len(chunks(out)) == 2, "the first chunks")
    children = _children(running.pid)
    if not children:
        running.kill()
        running.communicate()
        pytest.skip("foreign host: no /proc to find a worker in")
    os.kill(children[0], signal.SIGKILL)
    (tmp_path / "go").touch()
    _, told = running.communicate(timeout=TIMEOUT)
    assert running.returncode == 1
    lines = messages(told)
    assert len(lines) == 1
    assert "the workers were lost" in lines[0]
    assert "the same command continues from there" in lines[0]
    assert len(chunks(out)) >= 2


def test_without_dask_a_scheduler_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    real = builtins.__import__

    def refuse(name: str, *args: Any, **kwargs: Any) -> Any:
        if name == "distributed":
            raise ImportError(name)
        return real(name, *args, **kwargs)

    monkeypatch.setattr(builtins, "__import__", refuse)
    assert (
        main(
            ["explore", str(write_study(tmp_path)), "--scheduler", "tcp://127.0.0.1:1", "--out", str(tmp_path / "out")]
        )
        == 2
    )
    assert "pip install 'reefmu[cluster]'" in capsys.readouterr().err


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A dask scheduler and two workers, each a process of its own, without a nanny to bring a dead one back."""
    if importlib.util.find_spec("distributed") is None:
        pytest.skip("dask.distributed is not installed")
    file = tmp_path / "scheduler.json"
    dask = [sys.executable, "-m", "dask"]
    quiet: dict[str, Any] = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    processes = [
        subprocess.Popen(
            [*dask, "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--scheduler-file", str(file)],
            **quiet,
        )
    ]
    try:
        wait_for(file.exists, "the scheduler")
        wait_for(lambda: file.stat().st_size > 0, "the scheduler's file")
        address = json.loads(file.read_text("utf-8"))["address"]
        processes += [
            subprocess.Popen(
                [
                    *dask,
                    "worker",
                    address,
                    "--no-nanny",
                    "--nthreads",
                    "1",
                    "--no-dashboard",
                    "--local-directory",
                    str(tmp_path / f"worker-{k}"),
                ],
                **quiet,
            )
            for k in range(2)
        ]
        yield address, processes
    finally:
        for process in reversed(processes):
            process.kill()
            process.wait()


def test_a_dask_cluster_gives_the_same_though_a_worker_dies(
    cluster: tuple[str, list[subprocess.Popen[bytes]]], tmp_path: Path, longer: dict[str, Any]
) -> None:
    address, (_, first, second) = cluster
    path, out = write_study(tmp_path, **LONGER), tmp_path / "out"
    running = start(str(path), "--scheduler", address, out=out, chunks=4)
    wait_for(lambda: len(chunks(out)) == 4 or running.poll() is not None, "the first chunks")
    first.kill()
    first.wait()
    (tmp_path / "go").touch()
    _, told = running.communicate(timeout=TIMEOUT)
    assert running.returncode == 0, told
    assert second.poll() is None
    for name, values in longer.items():
        np.testing.assert_array_equal(designs(out)[name], values, err_msg=name)
