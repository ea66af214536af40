"""Processes of this machine, for all commands that share their work among them."""

from __future__ import annotations

import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
from concurrent.futures import ProcessPoolExecutor
from typing import Any


def pool(count: int | None = None) -> ProcessPoolExecutor:
    """So many workers, one for each core if None; no process starts before there is work."""
    return ProcessPoolExecutor(count or os.cpu_count(), initializer=_quiet)


def _quiet() -> None:
    """A worker leaves Ctrl-C to its parent, and goes when the parent is gone, even if that was killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    parent = multiprocessing.parent_process()
    if parent is not None:
        threading.Thread(target=_follow, args=(parent.sentinel,), daemon=True).start()


def _follow(sentinel: Any) -> None:
    multiprocessing.connection.wait([sentinel])
    os._exit(1)
