"""`reefmu explore` with a dask scheduler."""

from __future__ import annotations

import builtins
import importlib.util
import json
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reefmu.cli import main
from tests.integration.commands.studies.explore_runs import (
    LONGER,
    chunks,
    designs,
    start,
    wait_for,
    write_study,
)
from tests.subprocesses import TIMEOUT

pytestmark = pytest.mark.slow


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[tuple[str, list[subprocess.Popen[bytes]]]]:
    """A dask scheduler and two workers, each a process of its own, without a nanny that would restart it."""
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


def test_a_dask_cluster_gives_the_same_designs_although_a_worker_is_killed(
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


@pytest.mark.parametrize("address", ["processes", "tcp://", " "])
def test_a_wrong_scheduler_address_is_one_line(address: str, tmp_path: Path) -> None:
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
    assert "pip install '.[cluster]' in a clone" in capsys.readouterr().err
