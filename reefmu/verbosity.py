"""How much a command says on stderr beside its results and errors: nothing, notes and progress, or details too."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Generator
from contextvars import ContextVar
from enum import IntEnum


class Verbosity(IntEnum):
    """QUIET: results and errors only. NORMAL: notes, and progress of long work. VERBOSE: also details and durations."""

    QUIET = 0
    NORMAL = 1
    VERBOSE = 2


_current: ContextVar[Verbosity] = ContextVar("verbosity", default=Verbosity.NORMAL)


def verbosity() -> Verbosity:
    """The verbosity of the running command; NORMAL outside of commands."""
    return _current.get()


@contextlib.contextmanager
def verbosity_set(level: Verbosity) -> Generator[None]:
    """The verbosity within the block."""
    token = _current.set(level)
    try:
        yield
    finally:
        _current.reset(token)


def show_detail(text: str) -> None:
    """Write a line to stderr if the command is verbose."""
    if verbosity() >= Verbosity.VERBOSE:
        print(f"detail: {text}", file=sys.stderr)
