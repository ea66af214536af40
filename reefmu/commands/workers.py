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
from multiprocessing.synchronize import Event
from types import FrameType
from typing import Any

GRACE = 2.0
"""Seconds for which a worker outlives a SIGTERM: time for its parent, which got the same one, to say what happened."""


@contextlib.contextmanager
def pool(count: int | None = None) -> Generator[ProcessPoolExecutor]:
    """So many workers, one for each core if None; no process starts before there is work.

    They leave when the block ends; at once, in the middle of their work, if it ends with an exception.
    """
    leave = multiprocessing.Event()
    workers = ProcessPoolExecutor(count or os.cpu_count(), initializer=_start, initargs=(leave,))
    try:
        yield workers
    except BaseException:
        leave.set()
        raise
    finally:
        workers.shutdown(cancel_futures=True)


def _start(leave: Event) -> None:
    """A worker leaves Ctrl-C to its parent, and goes when that tells it to or is gone, even if it was killed."""
    for name in ("SIGINT", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _wait_and_leave)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_follow, args=(parent.sentinel,), daemon=True).start()
    threading.Thread(target=_leave_with, args=(leave,), daemon=True).start()


def _wait_and_leave(_number: int, _frame: FrameType | None) -> None:
    time.sleep(GRACE)
    os._exit(1)


def _follow(sentinel: Any) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)


def _leave_with(leave: Event) -> None:
    leave.wait()
    os._exit(1)
