"""The command line: the parsers of all commands, and the program that calls one of them.

    argument_types -> options -> parser -> program

Nothing here imports more than argparse, so that `reefmu --help` is quick: a command's module in `reefmu.commands` is
imported when the command is called.
"""

from .parser import build_parser
from .program import BLAS_THREADS, main

__all__ = ["BLAS_THREADS", "build_parser", "main"]
