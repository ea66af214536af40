"""Worker processes end with the block of their pool, whatever they are doing."""

from __future__ import annotations

import multiprocessing
import os
import signal
import subprocess
import sys
import time
from multiprocessing.connection import Connection
from pathlib import Path

import pytest

from reefmu.commands.terminal.worker_processes import process_pool
from tests.subprocesses import TIMEOUT

SCRIPT = """
import sys
from tests.integration.commands.console import test_workers
getattr(test_workers, sys.argv[1])()
"""
pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="foreign host: processes of Linux")


def _write_half_a_result() -> bytes:
    """The worker is killed while it writes its result."""

    def send(self: Connection, buffer: memoryview) -> None:
        os.write(self.fileno(), bytes(buffer[: len(buffer) // 2]))
        os.kill(os.getpid(), signal.SIGKILL)

    Connection._send = send  # type: ignore[attr-defined,method-assign]
    return bytes(1 << 15)


def stop_during_a_result() -> None:
    with process_pool(1) as pool:
        pool.submit(_write_half_a_result)
        while multiprocessing.active_children():
            time.sleep(0.01)
        raise SystemExit(3)


def stop_during_work() -> None:
    with process_pool(2) as pool:
        for _ in range(4):
            pool.submit(time.sleep, 1000.0)
        while len(multiprocessing.active_children()) < 2:
            time.sleep(0.01)
        raise SystemExit(3)


def stop_with_cancelled_work() -> None:
    """`Executor.map` cancels the work that is left; on one core, the workers end before the executor runs again."""
    os.sched_setaffinity(0, {min(os.sched_getaffinity(0))})
    with process_pool(2) as pool:
        waiting = [pool.submit(time.sleep, 1000.0) for _ in range(2000)]
        while len(multiprocessing.active_children()) < 2:
            time.sleep(0.01)
        for future in waiting:
            future.cancel()
        raise SystemExit(3)


@pytest.mark.parametrize("case", ["stop_during_a_result", "stop_during_work", "stop_with_cancelled_work"])
def test_an_exception_ends_the_pool_whatever_its_workers_do(case: str) -> None:
    root = Path(__file__).parents[4]
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, case],
        cwd=root,
        capture_output=True,
        text=True,
        timeout=TIMEOUT,
        env={**os.environ, "PYTHONPATH": str(root)},
        check=False,
    )
    assert done.returncode == 3
    assert done.stderr == ""
