"""The call of one command, with the notes and details that all commands have in common."""

from __future__ import annotations

import argparse
import platform
import time
from importlib import import_module

from reefmu.verbosity import Verbosity, show_detail, verbosity

from .notes import convergence_notes


def call_command(module_name: str, args: argparse.Namespace) -> int:
    """Import the command's module and call its `run`; returns the exit status."""
    start = time.perf_counter()
    if verbosity() is Verbosity.VERBOSE:
        from reefmu import __version__

        show_detail(f"reefmu {__version__}, Python {platform.python_version()}, {platform.system()}")
    module = import_module(module_name)
    with convergence_notes():
        status = module.run(args)
    show_detail(f"reefmu {args.command} took {time.perf_counter() - start:.2f} s")
    return status
