"""`reefmu explore`, killed, interrupted by a signal or deprived of a worker: what it keeps, and how it continues."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from reefmu.cli import main
from stiffness_model.explore.optimisation.run import CHUNK_FOLDER
from tests.integration.commands.studies.explore_runs import (
    LONGER,
    child_processes,
    chunks,
    designs,
    start,
    wait_for,
    write_study,
)
from tests.subprocesses import TIMEOUT, messages

pytestmark = pytest.mark.slow


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


def test_a_lost_worker_process_is_one_line_and_status_1(tmp_path: Path) -> None:
    path, out = write_study(tmp_path, **LONGER), tmp_path / "out"
    running = start(str(path), "--workers", "2", out=out, chunks=2)
    wait_for(lambda: len(chunks(out)) == 2, "the first chunks")
    children = child_processes(running.pid)
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


def test_a_killed_study_leaves_whole_chunks_and_no_workers_and_continues(
    tmp_path: Path, longer: dict[str, Any]
) -> None:
    path, out = write_study(tmp_path, **LONGER), tmp_path / "out"
    running = start(str(path), "--workers", "2", out=out, chunks=3)
    wait_for(lambda: len(chunks(out)) == 3, "the first chunks")
    children = child_processes(running.pid)
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
