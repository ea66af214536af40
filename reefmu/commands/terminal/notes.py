"""Notes and warnings: plain lines on stderr about the input or the results of a command that goes on."""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Generator, Sequence
from typing import TextIO

from reefmu.verbosity import Verbosity, verbosity
from stiffness_model.errors import NotConvergedWarning


class WarningText(str):
    """A note that is a warning: the drive cannot be built as drawn, or a result is not to be relied on."""

    __slots__ = ()


def show_notes(notes: Sequence[str]) -> None:
    """Write each note to stderr as a line of its own, unless the command is quiet."""
    for note in notes if verbosity() > Verbosity.QUIET else ():
        print(f"{'warning' if isinstance(note, WarningText) else 'note'}: {note}", file=sys.stderr)


@contextlib.contextmanager
def convergence_notes() -> Generator[None]:
    """In the block the first `NotConvergedWarning` is written as a warning, further ones are left out."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", NotConvergedWarning)
        show_other, shown = warnings.showwarning, False

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            nonlocal shown
            if not issubclass(category, NotConvergedWarning):
                show_other(message, category, filename, lineno, file, line)
            elif not shown:
                shown = True
                show_notes([WarningText(message)])

        warnings.showwarning = show
        yield
