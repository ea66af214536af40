"""Processes of this machine, for all commands that share their work among them."""

from __future__ import annotations

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
import time
from collections.abc import Generator
from concurrent.futures import ProcessPoolExecutor
from multiprocessing.connection import Connection
from types import FrameType
from typing import Any

GRACE = 2.0
"""Seconds for which a worker outlives a SIGTERM: time for its parent, which got the same one, to say what happened."""


@contextlib.contextmanager
def pool(count: int | None = None) -> Generator[ProcessPoolExecutor]:
    """So many workers, one for each core if None; no process starts before there is work.

    They leave when the block ends; at once, in the middle of their work, if it ends with an exception.
    """
    # A byte that nobody reads tells all of them. (An event would wait for an answer from those that were killed.)
    leave, tell = multiprocessing.Pipe(duplex=False)
    workers = ProcessPoolExecutor(count or os.cpu_count(), initializer=_start, initargs=(leave,))
    try:
        yield workers
    except BaseException:
        tell.send_bytes(b"leave")
        _close_results(workers)
        raise
    finally:
        workers.shutdown(cancel_futures=True)
        leave.close()
        tell.close()


def _close_results(workers: ProcessPoolExecutor) -> None:
    """Close this process's own end of the pipe that workers write results to.

    A worker that leaves in the middle of a result is else waited for: the pipe has an end here that nobody writes to,
    and the executor (CPython 3.11 to 3.14) never sees that it is the last one.
    """
    writer = getattr(getattr(workers, "_result_queue", None), "_writer", None)
    if writer is not None:
        writer.close()


def _start(leave: Connection) -> None:
    """A worker leaves Ctrl-C to its parent, and goes when that tells it to or is gone, even if it was killed."""
    for name in ("SIGINT", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _wait_and_leave)
    parent = multiprocessing.parent_process()
    reasons: list[Any] = [leave] if parent is None else [leave, parent.sentinel]
    threading.Thread(target=_leave_with, args=(reasons,), daemon=True).start()


def _wait_and_leave(_number: int, _frame: FrameType | None) -> None:
    time.sleep(GRACE)
    os._exit(1)


def _leave_with(reasons: list[Any]) -> None:
    multiprocessing.connection.wait(reasons)
    os._exit(1)
