"""Runs of `reefmu explore` in processes of their own, which tests can hold and interrupt."""

from __future__ import annotations

import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import tomli_w

from stiffness_model.explore.optimisation.run import CHUNK_FOLDER
from tests.small_study import tables
from tests.subprocesses import TIMEOUT

LONGER: dict[str, Any] = {"designs": 256, "drives": 40, "generations": 1}
"""A study of 17 chunks, long enough to be interrupted."""
HELD = """
import pathlib, sys, time
from reefmu.cli import main
from stiffness_model.explore.optimisation import run

kept, go, write = [], pathlib.Path(sys.argv[1]), run._write

def held(file, part):
    kept.append(file)  # before the file exists, so that an interruption meets no second wait
    write(file, part)
    while len(kept) == int(sys.argv[2]) and not go.exists():
        time.sleep(0.01)

run._write = held
sys.exit(main(["explore", *sys.argv[3:]]))
"""
"""Runs a study that waits after a given number of chunks for the file `go`: a test can interrupt it in its middle,
however fast both are."""


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
    """Start the command, which waits after `chunks` chunks for the file `go` beside its folder."""
    return subprocess.Popen(
        [sys.executable, "-c", HELD, str(out.parent / "go"), str(chunks), *args, "--out", str(out)],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
    )


def wait_for(condition: Any, what: str) -> None:
    end = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < end, what
        time.sleep(0.01)


def chunks(folder: Path) -> list[str]:
    return sorted(file.name for file in (folder / CHUNK_FOLDER).glob("[!.]*")) if folder.exists() else []


def child_processes(pid: int) -> list[int] | None:
    """The processes that a process started; None where there is no /proc."""
    try:
        return [int(word) for word in Path(f"/proc/{pid}/task/{pid}/children").read_text("ascii").split()]
    except OSError:
        return None
