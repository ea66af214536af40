"""A command in a forked process: quick to start, limited in time and memory, and isolated from the caller."""

from __future__ import annotations

import importlib
import os
import pkgutil
import re
import resource
import signal
import sys
import time
import traceback
import warnings
from pathlib import Path

import reefmu.commands
from reefmu.cli import main

CRASHED = 70
"""Exit status after a traceback."""
MEMORY = 4 << 30
"""Bytes of address space."""

# Loaded here once, not again by every child.
for _module in pkgutil.walk_packages(reefmu.commands.__path__, "reefmu.commands."):
    importlib.import_module(_module.name)


def run(argv: list[str], folder: Path, seconds: float) -> tuple[int, str]:
    """Exit status of `main(argv)` in `folder`, negative for a signal, and the text that it wrote to stderr."""
    errors = folder.with_suffix(".stderr")
    child = os.fork()
    if child == 0:
        _run(argv, folder, errors)
    end = time.monotonic() + seconds
    while True:
        done, status = os.waitpid(child, os.WNOHANG)
        if done:
            text = errors.read_text("utf-8", "replace")
            errors.unlink()
            return os.waitstatus_to_exitcode(status), text
        if time.monotonic() > end:
            os.kill(child, signal.SIGKILL)
            seconds, end = 0.0, float("inf")
        time.sleep(0.002)


def _run(argv: list[str], folder: Path, errors: Path) -> None:
    status = CRASHED
    try:
        os.chdir(folder)
        for descriptor, name in ((1, os.devnull), (2, str(errors))):
            os.dup2(os.open(name, os.O_WRONLY | os.O_CREAT | os.O_TRUNC), descriptor)
        sys.stdout, sys.stderr = os.fdopen(1, "w"), os.fdopen(2, "w")
        warnings.resetwarnings()
        warnings.simplefilter("default")
        warnings.filterwarnings("ignore", category=DeprecationWarning)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))
        status = main(argv)
    except SystemExit as leaving:
        status = leaving.code if isinstance(leaving.code, int) else CRASHED
    except BaseException:
        traceback.print_exc()
    sys.stderr.flush()
    os._exit(status)


def error_lines(text: str) -> list[str]:
    """Lines of stderr without notes, warnings and progress."""
    return [line for line in text.splitlines() if not re.search(r"^(?:note|warning): |: \d+ %", line)]
