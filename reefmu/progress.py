"""Progress of long work: one line that is rewritten on a terminal, a line now and then elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Executor, Future
from typing import Any, TextIO

from .verbosity import Verbosity, verbosity

TERMINAL_PAUSE, PLAIN_PAUSE, VERBOSE_PAUSE = 0.1, 5.0, 0.5
"""Seconds between two lines, on a terminal, elsewhere, so that short work leaves no line in a log, and elsewhere in a
verbose command; by judgement."""
clock: Callable[[], float] = time.monotonic
"""The clock of these pauses, s; tests replace it."""


class Progress:
    """Progress of `total` steps of the work `what`: a context manager that clears its line at the end."""

    def __init__(self, what: str, total: int, stream: TextIO | None = None) -> None:
        self._what, self._total, self._done = what, total, 0
        self._stream = sys.stderr if stream is None else stream
        self._terminal = self._stream.isatty()
        self._start = self._shown = clock()
        self._now = ""
        self._verbosity = verbosity()

    def advance_to(self, share: float, now: str = "") -> None:
        """Show this share of the work as done, and the present step `now`; the share never decreases."""
        self._done, self._now = max(self._done, round(share * self._total)), now
        self._show()

    def step(self) -> None:
        """Count one more step as done."""
        self._done += 1
        self._show()

    def _show(self) -> None:
        if self._verbosity is Verbosity.QUIET:
            return
        now = clock()
        plain = VERBOSE_PAUSE if self._verbosity is Verbosity.VERBOSE else PLAIN_PAUSE
        if now - self._shown < (TERMINAL_PAUSE if self._terminal else plain):
            return
        self._shown = now
        text = f"{self._what}: {100 * self._done // max(1, self._total)} %" + (f", {self._now}" if self._now else "")
        # On a terminal: return to the start of the line, and clear the remainder of a longer one.
        line = f"\r{text}\033[K" if self._terminal else f"{text}\n"
        print(line, end="", file=self._stream, flush=True)

    def __enter__(self) -> Progress:
        return self

    def __exit__(self, *_: object) -> None:
        if self._terminal and self._verbosity is not Verbosity.QUIET:
            print("\r\033[K", end="", file=self._stream, flush=True)
        if self._verbosity is Verbosity.VERBOSE:
            print(f"detail: {self._what} took {clock() - self._start:.2f} s", file=self._stream, flush=True)


class CountingExecutor(Executor):
    """An executor that shows progress, for functions that take an executor, such as `simulate`.

    It runs the tasks in this thread, one after another, or in `pool`. A function that asks for further tasks once it
    knows the results of the first, as a lookup that is checked and refined, has passes: each counts from 0 to 100 %,
    and all but the first state their number.
    """

    def __init__(self, what: str, pool: Executor | None = None) -> None:
        self._what, self._pool, self._passes = what, pool, 0

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Call `fn` at once, or submit it to the pool."""
        if self._pool is not None:
            return self._pool.submit(fn, *args, **kwargs)
        future: Future[Any] = Future()
        try:
            future.set_result(fn(*args, **kwargs))
        except Exception as error:
            future.set_exception(error)
        return future

    def map(
        self,
        fn: Callable[..., Any],
        *iterables: Iterable[Any],
        timeout: float | None = None,
        chunksize: int = 1,
        **_: Any,
    ) -> Iterator[Any]:
        """As the built-in `map`; timeout and chunksize are ignored."""
        tasks = list(zip(*iterables, strict=False))
        self._passes += 1
        what = self._what if self._passes == 1 else f"{self._what}, pass {self._passes}"
        with Progress(what, len(tasks)) as progress:
            here = (fn(*task) for task in tasks)
            results = here if self._pool is None else self._pool.map(fn, *zip(*tasks, strict=True))
            for result in results:
                yield result
                progress.step()
