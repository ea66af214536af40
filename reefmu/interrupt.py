"""Ctrl-C, SIGTERM and a closed terminal, treated alike: work is unwound, and the exit status is 128 and the number."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Generator
from types import FrameType

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Interrupted(KeyboardInterrupt):
    """A signal, raised where the work stood. number: of the signal."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


def exit_status(stop: KeyboardInterrupt) -> int:
    """128 + the signal's number, as shells have it.

    >>> exit_status(Interrupted(15)), exit_status(KeyboardInterrupt())
    (143, 130)
    """
    return 128 + (stop.number if isinstance(stop, Interrupted) else signal.SIGINT)


@contextlib.contextmanager
def signals_raised(last: bool = False) -> Generator[None]:
    """Within the block a signal raises `Interrupted` in the main thread.

    Signals that are ignored already (nohup) stay so. last: the program ends with the block: what comes later changes
    nothing, and is ignored. Without effect in other threads, which cannot have handlers.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    before = {number: signal.getsignal(number) for number in SIGNALS}
    taken = [number for number, handler in before.items() if handler is not signal.SIG_IGN]
    try:
        for number in taken:
            signal.signal(number, _raise)
        yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_IGN if last else before[number])


def _raise(number: int, _frame: FrameType | None) -> None:
    raise Interrupted(number)
