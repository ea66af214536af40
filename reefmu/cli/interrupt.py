"""Ctrl-C, SIGTERM and a closed terminal: each raises an exception, and the exit status is 128 + the signal's number."""

from __future__ import annotations

import contextlib
import signal
import threading
from collections.abc import Generator
from types import FrameType

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))


class Interrupted(KeyboardInterrupt):
    """A signal that was received in the block of `signals_raised`. number: of the signal."""

    def __init__(self, number: int) -> None:
        super().__init__()
        self.number = number


def signal_exit_status(stop: KeyboardInterrupt) -> int:
    """128 + the signal's number, as shells report it.

    >>> signal_exit_status(Interrupted(15)), signal_exit_status(KeyboardInterrupt())
    (143, 130)
    """
    return 128 + (stop.number if isinstance(stop, Interrupted) else signal.SIGINT)


@contextlib.contextmanager
def signals_raised(last: bool = False) -> Generator[None]:
    """Within the block a signal raises `Interrupted` in the main thread.

    Signals that are ignored already (nohup) stay ignored. last: the program ends with the block, and later signals are
    ignored. Without effect in other threads, which cannot have handlers.
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
