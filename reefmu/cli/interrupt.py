"""Ctrl-C, SIGTERM and a closed terminal: each raises an exception, and the exit status is 128 + the signal's number."""

from __future__ import annotations

import _thread
import contextlib
import shutil
import signal
import sys
import threading
from collections.abc import Generator
from importlib.machinery import ExtensionFileLoader
from types import FrameType, FunctionType

SIGNALS = tuple(getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name))
PAUSE = 0.02
"""s, after which a signal that could not stop the command is received again; chosen by judgement."""
UNINTERRUPTED = tuple(
    function.__code__
    for function in (ExtensionFileLoader.create_module, ExtensionFileLoader.exec_module, shutil.rmtree)
    if isinstance(function, FunctionType)
)
"""What is finished before a signal stops the command.

Python aborts where an exception ends the initialisation of some compiled modules (those of pybind11), and a temporary
folder that is removed in part stays.
"""


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
    hook = sys.unraisablehook

    def receive_discarded(unraisable: sys.UnraisableHookArgs) -> None:
        # Python discards the exceptions of finalisers and of callbacks of weak references.
        if isinstance(unraisable.exc_value, Interrupted):
            _receive_later(unraisable.exc_value.number)
        else:
            hook(unraisable)

    try:
        sys.unraisablehook = receive_discarded
        for number in taken:
            signal.signal(number, _raise)
        yield
    finally:
        for number in taken:
            signal.signal(number, signal.SIG_IGN if last else before[number])
        sys.unraisablehook = hook


@contextlib.contextmanager
def interrupts_restored() -> Generator[None]:
    """Raise the `Interrupted` again that an error in the block has replaced.

    Python before 3.12 turns every exception of a `__set_name__` into a `RuntimeError`, codecs turn them into errors of
    their own, and who imports a library or parses a text may take such an error for one of the input.
    """
    try:
        yield
    except Exception as error:
        context = error.__context__
        while context is not None and not isinstance(context, Interrupted):
            context = context.__context__
        if context is None:
            raise
        raise context from error


def _raise(number: int, frame: FrameType | None) -> None:
    while frame is not None:
        if frame.f_code in UNINTERRUPTED:
            _receive_later(number)
            return
        frame = frame.f_back
    raise Interrupted(number)


def _receive_later(number: int) -> None:
    threading.Timer(PAUSE, _receive_again, [number]).start()


def _receive_again(number: int) -> None:
    main = threading.main_thread().ident
    # Only a signal to the main thread itself ends what it waits for.
    if hasattr(signal, "pthread_kill") and main is not None:
        signal.pthread_kill(main, number)
    else:
        _thread.interrupt_main(signal.Signals(number))
