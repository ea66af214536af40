"""Warnings of the physics as plain lines."""

from __future__ import annotations

import contextlib
import sys
import warnings
from collections.abc import Generator
from typing import TextIO

from stiffness_model.errors import NotConvergedWarning


@contextlib.contextmanager
def shown() -> Generator[None]:
    """Within, elements without an equilibrium are told in one line on stderr, once for a command."""
    with warnings.catch_warnings():
        warnings.simplefilter("always", NotConvergedWarning)
        usual, told = warnings.showwarning, False

        def show(
            message: Warning | str,
            category: type[Warning],
            filename: str,
            lineno: int,
            file: TextIO | None = None,
            line: str | None = None,
        ) -> None:
            nonlocal told
            if not issubclass(category, NotConvergedWarning):
                usual(message, category, filename, lineno, file, line)
            elif not told:
                told = True
                print(f"note: {message}", file=sys.stderr)

        warnings.showwarning = show
        yield
