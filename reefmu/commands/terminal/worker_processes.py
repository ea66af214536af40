"""Worker processes on this machine, which end with the command however it ends."""

from __future__ import annotations

import contextlib
import multiprocessing
import multiprocessing.connection
import os
import signal
import threading
import time
from collections.abc import Generator
from concurrent.futures import Executor, ProcessPoolExecutor
from multiprocessing.connection import Connection
from types import FrameType
from typing import Any

from reefmu.progress import CountingExecutor

GRACE = 2.0
"""s, for which a worker survives a SIGTERM, so that its parent, which got the same signal, can report it first; chosen
by judgement."""
RESULT_WAIT = 1.0
"""s, after which an executor that has not ended waits for a result that no worker will complete; chosen by judgement:
it ends within milliseconds otherwise."""


@contextlib.contextmanager
def process_pool(count: int | None = None) -> Generator[ProcessPoolExecutor]:
    """`count` worker processes, one for each core if None; none of them starts before there is work.

    They finish their work when the block ends; if it ends with an exception, they stop at once.
    """
    # One byte, which no worker takes out of the pipe, stops all of them. An event would wait for killed workers.
    stop_reader, stop_writer = multiprocessing.Pipe(duplex=False)
    workers = ProcessPoolExecutor(count or os.cpu_count(), initializer=_start, initargs=(stop_reader,))
    try:
        yield workers
    except BaseException:
        _stop(workers, stop_writer)
        raise
    else:
        workers.shutdown(cancel_futures=True)
    finally:
        stop_reader.close()
        stop_writer.close()


@contextlib.contextmanager
def pool_with_progress(what: str) -> Generator[Executor]:
    """`process_pool` on all cores as an executor that shows its progress on the work called `what`."""
    with process_pool() as workers:
        yield CountingExecutor(what, workers)


def _stop(workers: ProcessPoolExecutor, stop_writer: Connection) -> None:
    """Stop the workers at once, whatever they are doing, and wait until the executor has taken note of it."""
    manager = getattr(workers, "_executor_manager_thread", None)
    results = getattr(getattr(workers, "_result_queue", None), "_writer", None)
    # The executor drops cancelled work before it learns that its workers have ended: CPython before 3.13 would set an
    # error on that work, and its thread would end with a traceback (InvalidStateError) on the terminal.
    workers.shutdown(wait=False, cancel_futures=True)
    stop_writer.send_bytes(b"stop")
    if manager is None or results is None:
        return
    manager.join(RESULT_WAIT)
    # The executor (CPython 3.11 to 3.14) waits for the rest of a result that a stopped worker was writing: it sees the
    # end of the pipe only when no process, and so neither this one, has it open for writing. Closed any sooner, that
    # end would reach the executor before the news that work was cancelled.
    results.close()
    manager.join()


def _start(stop_reader: Connection) -> None:
    """In a worker: ignore Ctrl-C, which the parent handles, and exit when the parent says so or has ended."""
    for name in ("SIGINT", "SIGHUP"):
        if hasattr(signal, name):
            signal.signal(getattr(signal, name), signal.SIG_IGN)
    signal.signal(signal.SIGTERM, _wait_and_exit)
    parent = multiprocessing.parent_process()
    reasons: list[Any] = [stop_reader] if parent is None else [stop_reader, parent.sentinel]
    threading.Thread(target=_exit_with, args=(reasons,), daemon=True).start()


def _wait_and_exit(_number: int, _frame: FrameType | None) -> None:
    time.sleep(GRACE)
    os._exit(1)


def _exit_with(reasons: list[Any]) -> None:
    multiprocessing.connection.wait(reasons)
    os._exit(1)
